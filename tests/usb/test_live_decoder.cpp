// SPDX-License-Identifier: MIT
#include "lecalib/usb/live_decoder.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "lecalib/host/raw_writer.hpp"
#include "support/decode_pieces.hpp"
#include "support/random_events.hpp"

using namespace lecalib;
using namespace lecalib::usb;
using namespace lecalib::test;

namespace {

constexpr SensorSize kSensor{640, 480};
constexpr std::size_t kPlaces = 16;
constexpr std::size_t kMostWaiting = 8;
constexpr std::size_t kBufferBytes = 1000;

/// Events and the words of a camera that sends them.
struct Recording {
  explicit Recording(std::size_t count = 60'000, std::int64_t begin_us = 70) {
    Rng rng(7);
    events = random_events(&rng, count, begin_us, 9, kSensor.width, kSensor.height);
    std::string text;
    host::Evt3Encoder encoder(kSensor.width, kSensor.height);
    REQUIRE_FALSE(encoder.append(events, &text));
    words.assign(text.begin(), text.end());
  }
  std::vector<Event> events;
  Bytes words;
};

/// A camera and a reader that take turns, so that which of them is faster does not hang on the machine.
struct Turns {
  explicit Turns(std::size_t most_waiting = kMostWaiting) : decoder(most_waiting) {
    REQUIRE(buffer.init({kPlaces, kBufferBytes, DropPolicy::newest, 2}) == Status::ok);
    REQUIRE(decoder.begin(host::evt3_header(kSensor.width, kSensor.height)) == Status::ok);
  }
  void send(Span<const std::uint8_t>* words, std::size_t buffers) {
    for (; buffers > 0 && !words->empty(); --buffers) {
      buffer.take(words->first(kBufferBytes));
      *words = words->subspan(std::min(kBufferBytes, words->size()));
    }
  }
  /// Reads one buffer. @return false when none waits
  bool read() {
    BufferRing::Buffer part;
    if (buffer.read(std::chrono::milliseconds(0), &part) != StreamBuffer::Wait::data) return false;
    decoder.take(part, buffer.waiting());
    while (true) {
      Span<const Event> events;
      REQUIRE(decoder.next(&events) == Status::ok);
      if (events.empty()) return true;
      if (decoder.has_gap()) gaps.push_back(given.size());
      given.insert(given.end(), events.begin(), events.end());
    }
  }
  /// Reads one buffer whose events are given; those that are left out take no time. @return false when none waits
  bool read_given() {
    const std::size_t before = given.size();
    while (given.size() == before) {
      if (!read()) return false;
    }
    return true;
  }

  StreamBuffer buffer;
  LiveDecoder decoder;
  std::vector<Event> given;
  std::vector<std::size_t> gaps;  ///< positions in `given` before which events are missing
};

/// Whether `part` is `all` without one stretch at each of `gaps`.
bool is_without_stretches(const std::vector<Event>& part, const std::vector<std::size_t>& gaps,
                          const std::vector<Event>& all) {
  std::size_t at = 0;
  for (std::size_t i = 0; i < part.size(); ++i, ++at) {
    if (std::find(gaps.begin(), gaps.end(), i) != gaps.end()) {
      while (at < all.size() && !(all[at] == part[i])) ++at;
    }
    if (at == all.size() || !(all[at] == part[i])) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("live_decoder: a reader that keeps up gets every event and no gap") {
  const Recording recording;
  Turns turns;
  Span<const std::uint8_t> rest(recording.words);
  while (!rest.empty()) {
    turns.send(&rest, kMostWaiting);
    while (turns.read()) {
    }
  }
  CHECK(turns.decoder.left_out().times == 0);
  CHECK(turns.gaps.empty());
  const bool is_same = turns.given == recording.events;
  CHECK(is_same);
  CHECK(turns.decoder.stats().events == recording.events.size());
}

TEST_CASE("live_decoder: a reader at half or a third of the rate gets whole stretches, and the rest is counted") {
  const Recording recording;
  for (const std::size_t sent_per_read : {2U, 3U}) {
    Turns turns;
    Span<const std::uint8_t> rest(recording.words);
    while (!rest.empty()) {
      turns.send(&rest, sent_per_read);
      (void)turns.read_given();
    }
    while (turns.read()) {
    }
    const LeftOut& left_out = turns.decoder.left_out();
    CHECK(turns.buffer.dropped() == 0);
    CHECK(turns.decoder.stats().events == recording.events.size());
    CHECK(turns.given.size() + left_out.events == recording.events.size());
    CHECK(turns.gaps.size() <= left_out.times);
    CHECK(turns.gaps.size() + 1 >= left_out.times);  // the last one may reach to the end
    const bool fits = is_without_stretches(turns.given, turns.gaps, recording.events);
    CHECK(fits);
    // Most of the share that the reader can take; in a ring as small as this it waits now and then.
    const std::size_t share = recording.events.size() / sent_per_read;
    CHECK(turns.given.size() > share * 3 / 4);
    // Stretches last until what is sent beyond what is read has filled the room.
    const std::size_t buffers = recording.words.size() / kBufferBytes;
    CHECK(left_out.times <= buffers / (kMostWaiting / (sent_per_read - 1) * sent_per_read));
  }
}

TEST_CASE("live_decoder: where even decoding is too slow, what waits behind lost buffers goes as it is") {
  const Recording recording(400'000);
  Turns turns;
  Span<const std::uint8_t> rest(recording.words);
  for (int i = 0; i < 1000 && !rest.empty(); ++i) {
    turns.send(&rest, 3);
    // Two buffers' time, in which nothing is decoded of those that are skipped.
    for (std::size_t worked_on = 0; worked_on < 2;) {
      const std::uint64_t skipped = turns.decoder.left_out().buffers;
      if (!turns.read()) break;
      if (turns.decoder.left_out().buffers == skipped) ++worked_on;
    }
  }
  const LeftOut& left_out = turns.decoder.left_out();
  CHECK(turns.buffer.dropped() > 0);
  CHECK(left_out.buffers > 0);
  CHECK(left_out.events > 0);
  // It comes back to what is of now again and again, and gives whole stretches of it.
  CHECK(turns.gaps.size() > 3);
  CHECK(turns.given.size() / (turns.gaps.size() + 1) > kMostWaiting * kBufferBytes / 8);
}

TEST_CASE("live_decoder: the times of a camera that was plugged in anew go on after a gap") {
  const Recording first(2000);
  const Recording second(2000, 5);
  Turns turns;
  for (const Recording* recording : {&first, &second}) {
    if (recording == &second) {
      REQUIRE(turns.decoder.begin(host::evt3_header(kSensor.width, kSensor.height)) == Status::ok);
    }
    Span<const std::uint8_t> rest(recording->words);
    while (!rest.empty()) {
      turns.send(&rest, 1);
      (void)turns.read_given();
    }
  }
  REQUIRE(turns.given.size() == 4000);
  CHECK(turns.gaps == std::vector<std::size_t>{2000});
  CHECK(turns.given[2000].t_us == turns.given[1999].t_us + 1'000'000 + second.events[0].t_us);
  CHECK(turns.decoder.stats().events == 4000);
  CHECK(turns.decoder.left_out().events == 0);
}

TEST_CASE("live_decoder: a stream that cannot be decoded is an error that says what was expected") {
  LiveDecoder decoder(kMostWaiting);
  CHECK(is_error(decoder.begin("1 2 3 x\n")));
  CHECK(std::string(decoder.error().expected) != "");
}
