// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/events/event_stream.hpp"
#include "lecalib/host/raw_writer.hpp"

using lecalib::Event;
using lecalib::host::encode_evt3;

namespace {

/// The 16-bit words after the header.
std::vector<unsigned> words_of(const std::string& file) {
  constexpr std::string_view kEnd = "% end\n";
  const std::size_t first = file.find(kEnd) + kEnd.size();
  std::vector<unsigned> words;
  for (std::size_t i = first; i + 1 < file.size(); i += 2) {
    words.push_back(static_cast<unsigned char>(file[i]) | static_cast<unsigned>(static_cast<unsigned char>(file[i + 1]))
                                                              << 8U);
  }
  return words;
}

std::vector<Event> decode(const std::string& file, lecalib::EventStreamDecoder* decoder) {
  const std::vector<std::uint8_t> bytes(file.begin(), file.end());
  lecalib::Span<const std::uint8_t> input(bytes);
  std::vector<Event> events;
  Event batch[100];
  std::size_t count = 0;
  do {
    REQUIRE(decoder->decode(&input, batch, &count) == lecalib::Status::ok);
    events.insert(events.end(), batch, batch + count);
  } while (count > 0);
  do {
    REQUIRE(decoder->finish(batch, &count) == lecalib::Status::ok);
    events.insert(events.end(), batch, batch + count);
  } while (count > 0);
  return events;
}

/// Events with every distance in time, many of them together in one row.
std::vector<Event> random_events(std::size_t count, std::uint16_t width, std::uint16_t height) {
  lecalib::Rng rng(12);
  std::vector<Event> events;
  Event e{16'000'000, 0, 0, 1};
  while (events.size() < count) {
    const std::uint32_t kind = rng.below(4);
    if (kind == 0) {
      e.t_us += rng.below(1U << rng.below(24));
      e.y = static_cast<std::uint16_t>(rng.below(height));
      e.x = static_cast<std::uint16_t>(rng.below(width));
      e.polarity = static_cast<std::uint8_t>(rng.below(2));
    } else {
      e.x = static_cast<std::uint16_t>((e.x + 1U + rng.below(kind * kind)) % width);
    }
    events.push_back(e);
  }
  return events;
}

}  // namespace

TEST_CASE("encode_evt3: the decoder gives back what was written, over roll-overs too") {
  const std::vector<Event> events = random_events(5000, 2048, 1500);
  const auto file = encode_evt3(events, 2048, 1500);
  REQUIRE(file.ok());
  lecalib::EventStreamDecoder decoder;
  const std::vector<Event> read = decode(file.value(), &decoder);
  CHECK(decoder.width() == 2048);
  CHECK(decoder.height() == 1500);
  CHECK(decoder.stats().time_wraps > 1);
  CHECK(decoder.stats().time_steps_back == 0);
  REQUIRE(read.size() == events.size());
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < read.size(); ++i) {
    const Event &a = read[i], &b = events[i];
    if (a.t_us != b.t_us || a.x != b.x || a.y != b.y || a.polarity != b.polarity) ++wrong;
  }
  CHECK(wrong == 0);
}

TEST_CASE("encode_evt3: the header tells format and size") {
  const auto file = encode_evt3({}, 346, 260);
  REQUIRE(file.ok());
  CHECK(file.value().find("% evt 3.0\n") != std::string::npos);
  CHECK(file.value().find("% format EVT3;height=260;width=346\n") != std::string::npos);
  CHECK(words_of(file.value()).empty());
}

TEST_CASE("encode_evt3: one word per change of time, row and column") {
  const std::vector<Event> events = {{5, 7, 3, 1}, {5, 9, 3, 0}, {6, 9, 4, 1}, {4097, 9, 4, 1}};
  const auto file = encode_evt3(events, 10, 10);
  REQUIRE(file.ok());
  CHECK(words_of(file.value()) == std::vector<unsigned>{0x8000, 0x6005, 0x0003, 0x2807, 0x2009,  //
                                                        0x6006, 0x0004, 0x2809, 0x8001, 0x6001, 0x2809});
}

TEST_CASE("encode_evt3: five events or more within 32 columns become a vector of 12, 12 and 8") {
  std::vector<Event> events = {{0, 10, 0, 1}, {0, 12, 0, 1}, {0, 21, 0, 1},
                               {0, 22, 0, 1}, {0, 41, 0, 1}, {0, 42, 0, 1}};
  const auto file = encode_evt3(events, 50, 1);
  REQUIRE(file.ok());
  CHECK(words_of(file.value()) ==
        std::vector<unsigned>{0x8000, 0x6000, 0x0000, 0x380A, 0x4805, 0x4001, 0x5080, 0x282A});
  events.erase(events.begin());
  const auto none = encode_evt3(lecalib::Span<const Event>(events).first(4), 50, 1);
  REQUIRE(none.ok());
  CHECK(words_of(none.value()) == std::vector<unsigned>{0x8000, 0x6000, 0x0000, 0x280C, 0x2815, 0x2816, 0x2829});
}

TEST_CASE("encode_evt3: vectors end on the sensor, as those that sensors send") {
  const std::vector<Event> events = {{0, 27, 0, 0}, {0, 28, 0, 0}, {0, 29, 0, 0}, {0, 30, 0, 0}, {0, 31, 0, 0}};
  const auto wide = encode_evt3(events, 33, 1);
  REQUIRE(wide.ok());
  CHECK(words_of(wide.value()) == std::vector<unsigned>{0x8000, 0x6000, 0x0000, 0x3001, 0x4000, 0x4000, 0x507C});
  // No room for 32 columns at all.
  std::vector<Event> left = events;
  for (Event& e : left) e.x = static_cast<std::uint16_t>(e.x - 1);
  const auto narrow = encode_evt3(left, 31, 1);
  REQUIRE(narrow.ok());
  CHECK(words_of(narrow.value()) ==
        std::vector<unsigned>{0x8000, 0x6000, 0x0000, 0x201A, 0x201B, 0x201C, 0x201D, 0x201E});
}

TEST_CASE("encode_evt3: no gap hides a roll-over of the 24-bit time") {
  constexpr std::int64_t kRollOver = std::int64_t{1} << 24;
  const std::vector<Event> events = {{kRollOver - 1, 0, 0, 1}, {3 * kRollOver, 0, 0, 1}};
  const auto file = encode_evt3(events, 1, 1);
  REQUIRE(file.ok());
  const std::vector<unsigned> words = words_of(file.value());
  unsigned high_words = 0;
  unsigned wraps = 0;
  unsigned last = 0;
  for (const unsigned word : words) {
    if (word >> 12U != 8) continue;
    ++high_words;
    if ((word & 0xFFFU) < last) ++wraps;
    last = word & 0xFFFU;
  }
  CHECK(high_words == 1 + 2 * 4096 + 1);
  CHECK(wraps == 3);
}

TEST_CASE("encode_evt3: small steps back in time are kept, over roll-overs too") {
  constexpr std::int64_t kRollOver = std::int64_t{1} << 24;
  std::vector<Event> events;
  lecalib::Rng rng(11);
  for (int i = 0; i < 20'000; ++i) {
    const std::int64_t t_us = kRollOver - 50'000 + 5 * i - static_cast<std::int64_t>(rng.below(10'000));
    events.push_back({t_us, static_cast<std::uint16_t>(rng.below(9)), 0, 1});
  }
  const auto file = encode_evt3(events, 9, 1);
  REQUIRE(file.ok());
  lecalib::EventStreamDecoder decoder;
  const std::vector<Event> read = decode(file.value(), &decoder);
  REQUIRE(read.size() == events.size());
  const auto same = [](const Event& a, const Event& b) { return a.t_us == b.t_us && a.x == b.x; };
  CHECK(std::equal(read.begin(), read.end(), events.begin(), same));
}

TEST_CASE("encode_evt3: in pieces as in one") {
  const std::vector<Event> events = random_events(5000, 300, 200);
  lecalib::host::Evt3Encoder encoder(300, 200);
  std::string bytes;
  REQUIRE_FALSE(encoder.begin(&bytes));
  for (std::size_t at = 0; at < events.size(); at += 7) {
    REQUIRE_FALSE(encoder.append(lecalib::Span<const Event>(events).subspan(at, 7), &bytes));
  }
  lecalib::EventStreamDecoder decoder;
  const std::vector<Event> read = decode(bytes, &decoder);
  REQUIRE(read.size() == events.size());
  const auto same = [](const Event& a, const Event& b) { return a.t_us == b.t_us && a.x == b.x && a.y == b.y; };
  CHECK(std::equal(read.begin(), read.end(), events.begin(), same));
  // An event that cannot be written is counted from the first of all, and leaves nothing behind.
  const std::string before = bytes;
  const std::vector<Event> bad = {events.back(), {events.back().t_us, 300, 0, 1}};
  const auto error = encoder.append(bad, &bytes);
  REQUIRE(error);
  CHECK(error->message == "event 5001 lies outside of the sensor, which EVT3 cannot hold");
  CHECK(bytes == before);
  CHECK(encoder.append(std::vector<Event>{{events.back().t_us + 3'600'000'001, 0, 0, 1}}, &bytes));
}

TEST_CASE("encode_evt3: what cannot be written is an error") {
  CHECK_FALSE(encode_evt3({}, 0, 10).ok());
  CHECK_FALSE(encode_evt3({}, 10, 2049).ok());
  CHECK(encode_evt3({}, 2048, 2048).ok());
  CHECK_FALSE(encode_evt3(std::vector<Event>{{10, 2, 1, 1}}, 2, 2).ok());
  CHECK_FALSE(encode_evt3(std::vector<Event>{{10, 1, 2, 1}}, 2, 2).ok());
  CHECK_FALSE(encode_evt3(std::vector<Event>{{-1, 1, 1, 1}}, 2, 2).ok());
  const auto disorder = encode_evt3(std::vector<Event>{{5'000'000, 1, 1, 1}, {9, 1, 1, 1}}, 2, 2);
  REQUIRE_FALSE(disorder.ok());
  CHECK(disorder.error().message.find("event 1 ") != std::string::npos);
  const auto before_all = encode_evt3(std::vector<Event>{{0, 1, 1, 1}, {-9'223'372'036'854'775'807, 1, 1, 1}}, 2, 2);
  REQUIRE_FALSE(before_all.ok());
  CHECK(before_all.error().message.find("event 1 is older than 0") != std::string::npos);
}
