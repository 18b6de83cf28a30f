// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include "lecalib/events/evt3_decoder.hpp"
#include "support/alloc_counter.hpp"
#include "support/decode_pieces.hpp"
#include "support/random_events.hpp"

namespace lecalib::test {
namespace {

constexpr SensorSize kSize{640, 480};
enum Type : unsigned {
  kRow = 0,
  kX = 2,
  kBase = 3,
  kVect12 = 4,
  kVect8 = 5,
  kLow = 6,
  kContinued4 = 7,
  kHigh = 8,
  kTrigger = 10,
  kOthers = 14,
  kContinued12 = 15
};
constexpr unsigned kOn = 2048;

TEST_CASE("EVT3: an event takes time, row, column and polarity from four words") {
  const Decoded decoded =
      decode_whole(Evt3Decoder(kSize), evt3_bytes({{kHigh, 3}, {kLow, 7}, {kRow, 100}, {kX, 200 + kOn}}));
  CHECK(decoded.status == Status::ok);
  CHECK(decoded.events == std::vector<Event>{{3 * 4096 + 7, 200, 100, 1}});
}

TEST_CASE("EVT3: vector words give one event a bit and move the base on") {
  const Decoded decoded =
      decode_whole(Evt3Decoder(kSize),
                   evt3_bytes({{kHigh, 0}, {kRow, 5}, {kBase, 10}, {kVect12, 0x801}, {kVect8, 0xF81}, {kVect12, 1}}));
  const std::vector<Event> expected{{0, 10, 5, 0}, {0, 21, 5, 0}, {0, 22, 5, 0}, {0, 29, 5, 0}, {0, 30, 5, 0}};
  CHECK(decoded.events == expected);
}

TEST_CASE("EVT3: a vector's events wait while there is no room for them") {
  const Bytes bytes = evt3_bytes({{kHigh, 0}, {kRow, 5}, {kBase, kOn}, {kVect12, 0xFFF}, {kX, 9}});
  for (std::size_t room = 1; room < 14; ++room) {
    const Decoded decoded = decode_whole(Evt3Decoder(kSize), bytes, room);
    REQUIRE(decoded.events.size() == 13);
    CHECK(decoded.events[11] == Event{0, 11, 5, 1});
    CHECK(decoded.events[12] == Event{0, 9, 5, 0});
  }
}

TEST_CASE("EVT3: words before the first time and the first row are counted, not guessed") {
  const Decoded decoded =
      decode_whole(Evt3Decoder(kSize), evt3_bytes({{kRow, 5}, {kX, 1}, {kBase, 0}, {kVect8, 7}, {kHigh, 2}, {kX, 2}}));
  CHECK(decoded.events == std::vector<Event>{{2 * 4096, 2, 5, 0}});
  CHECK(decoded.stats.unplaced == 4);
  const Decoded no_row = decode_whole(Evt3Decoder(kSize), evt3_bytes({{kHigh, 2}, {kX, 2}, {kRow, 0}, {kX, 3}}));
  CHECK(no_row.events == std::vector<Event>{{2 * 4096, 3, 0, 0}});
  CHECK(no_row.stats.unplaced == 1);
}

TEST_CASE("EVT3: a repeated TIME_HIGH keeps TIME_LOW, a new one sets it to 0") {
  const Decoded decoded = decode_whole(
      Evt3Decoder(kSize), evt3_bytes({{kRow, 0}, {kHigh, 2}, {kLow, 100}, {kHigh, 2}, {kX, 0}, {kHigh, 3}, {kX, 1}}));
  CHECK(decoded.events == std::vector<Event>{{2 * 4096 + 100, 0, 0, 0}, {3 * 4096, 1, 0, 0}});
  CHECK(decoded.stats.time_steps_back == 0);
}

TEST_CASE("EVT3: TIME_LOW out of order is no carry") {
  const Decoded decoded = decode_whole(
      Evt3Decoder(kSize),
      evt3_bytes({{kRow, 0}, {kHigh, 2}, {kLow, 100}, {kX, 0}, {kLow, 98}, {kX, 1}, {kLow, 101}, {kX, 2}}));
  REQUIRE(decoded.events.size() == 3);
  CHECK(decoded.events[1].t_us == 2 * 4096 + 98);
  CHECK(decoded.events[2].t_us == 2 * 4096 + 101);
  CHECK(decoded.stats.time_steps_back == 1);
}

TEST_CASE("EVT3: only a large step back of TIME_HIGH is a roll-over") {
  const auto last_time = [](std::vector<unsigned> highs) {
    std::vector<Word> words{{kRow, 0}};
    for (const unsigned high : highs) words.push_back({kHigh, high});
    words.push_back({kX, 0});
    const Decoded decoded = decode_whole(Evt3Decoder(kSize), evt3_bytes(words));
    REQUIRE(decoded.events.size() == 1);
    return decoded.events[0].t_us / 4096;
  };
  CHECK(last_time({4095, 0}) == 4096);
  CHECK(last_time({4095, 0, 4095, 0}) == 4096);  // a late word from before the roll-over
  CHECK(last_time({4095, 0, 2048, 4095, 0}) == 2 * 4096);
  CHECK(last_time({100, 99}) == 99);                    // disorder
  CHECK(last_time({100, 100 + 2048, 101}) == 101);      // one wrong bit, up and back
  CHECK(last_time({3000, 3000 - 2048, 3001}) == 3001);  // down and up
  CHECK(last_time({3072, 0}) == 0);                     // three quarters are not enough
  CHECK(last_time({3073, 0}) == 4096);
}

TEST_CASE("EVT3: words without events are skipped and counted") {
  std::vector<Word> words{{kHigh, 0}, {kRow, 0}};
  for (const unsigned type : {kContinued4, kTrigger, kOthers, kContinued12}) words.push_back({type, 0xABC});
  for (const unsigned type : {0x1U, 0x9U, 0xBU, 0xCU, 0xDU}) words.push_back({type, 0xABC});
  words.push_back({kX, 3});
  const Decoded decoded = decode_whole(Evt3Decoder(kSize), evt3_bytes(words));
  CHECK(decoded.events == std::vector<Event>{{0, 3, 0, 0}});
  CHECK(decoded.stats.triggers == 1);
  CHECK(decoded.stats.other_words == 3);
  CHECK(decoded.stats.undefined_words == 5);
}

TEST_CASE("EVT3: triggers come beside events with time, channel and edge, and wait for the first time") {
  const Bytes bytes =
      evt3_bytes({{kTrigger, 0x301}, {kHigh, 2}, {kTrigger, 0x301}, {kLow, 9}, {kRow, 5}, {kX, 1}, {kTrigger, 0xF00}});
  const Decoded decoded = decode_whole(Evt3Decoder(kSize), bytes);
  const std::vector<TriggerEvent> expected = {{2 * 4096, 3, TriggerKind::rising},
                                              {2 * 4096 + 9, 15, TriggerKind::falling}};
  CHECK(decoded.triggers == expected);
  CHECK(decoded.stats.triggers == 2);
  CHECK(decoded.stats.unplaced == 1);
  CHECK(decoded.events.size() == 1);
  check_every_split(Evt3Decoder(kSize), bytes);
}

TEST_CASE("EVT3: triggers without room are counted, and need no taker") {
  const Bytes bytes = evt3_bytes({{kHigh, 0}, {kTrigger, 1}, {kTrigger, 0}, {kTrigger, 1}});
  Event out[1];
  TriggerEvent room[2];
  SideRecords side{FixedVector<TriggerEvent>(room), {}};
  std::size_t count = 0;
  Evt3Decoder decoder;
  Span<const std::uint8_t> input(bytes);
  CHECK(decoder.decode(&input, out, &count, &side) == Status::ok);
  CHECK(side.triggers.size() == 2);
  CHECK(side.triggers.dropped() == 1);
  CHECK(decoder.stats().triggers == 3);
  input = bytes;
  CHECK(decoder.decode(&input, out, &count) == Status::ok);
  CHECK(decoder.stats().triggers == 6);
}

TEST_CASE("EVT3: events beside the sensor are dropped and counted") {
  const Bytes bytes = evt3_bytes({{kHigh, 0},
                                  {kRow, 479},
                                  {kX, 639},
                                  {kX, 640},
                                  {kBase, 632},
                                  {kVect12, 0xFFF},
                                  {kVect12, 0xFFF},
                                  {kRow, 480},
                                  {kX, 0},
                                  {kBase, 0},
                                  {kVect8, 0xFF}});
  const Decoded decoded = decode_whole(Evt3Decoder(kSize), bytes);
  CHECK(decoded.events.size() == 1 + 8);
  CHECK(decoded.stats.outside == 1 + 4 + 12 + 1 + 8);
  const Decoded unknown_size = decode_whole(Evt3Decoder(), bytes);
  CHECK(unknown_size.events.size() == 1 + 1 + 24 + 1 + 8);
  CHECK(unknown_size.stats.outside == 0);
}

TEST_CASE("EVT3: vectors without end do not come round into the image") {
  std::vector<Word> words{{kHigh, 0}, {kRow, 0}, {kBase, 0}};
  words.insert(words.end(), 100'000, {kVect12, 1});
  const Decoded decoded = decode_whole(Evt3Decoder(), evt3_bytes(words));
  CHECK(decoded.events.size() == 2048 / 12 + 1);
  CHECK(decoded.stats.outside == 100'000 - decoded.events.size());
}

TEST_CASE("EVT3: a cut last word is told by finish(), with its place, and sticks") {
  Evt3Decoder decoder(kSize);
  const Bytes bytes = evt3_bytes({{kHigh, 0}, {kRow, 0}, {kX, 0}, {kX, 1}});
  Span<const std::uint8_t> input = Span<const std::uint8_t>(bytes).first(7);
  Event out[4];
  std::size_t count = 0;
  CHECK(decoder.decode(&input, out, &count) == Status::ok);
  CHECK(count == 1);
  CHECK(decoder.finish(out, &count) == Status::malformed_input);
  CHECK(count == 0);
  CHECK(decoder.error().offset == 6);
  input = bytes;
  CHECK(decoder.decode(&input, out, &count) == Status::malformed_input);
  CHECK(input.size() == bytes.size());
  CHECK(decoder.finish(out, &count) == Status::malformed_input);
}

TEST_CASE("EVT3: without room there is nothing to do, and no harm") {
  Evt3Decoder decoder(kSize);
  const Bytes bytes = evt3_bytes({{kHigh, 0}, {kRow, 0}, {kX, 0}});
  Span<const std::uint8_t> input(bytes);
  std::size_t count = 1;
  CHECK(decoder.decode(&input, {}, &count) == Status::invalid_argument);
  CHECK(count == 0);
  CHECK(decoder.finish({}, &count) == Status::invalid_argument);
  Event out[1];
  CHECK(decoder.decode(&input, out, &count) == Status::ok);
  CHECK(count == 1);
}

TEST_CASE("EVT3: what is encoded is decoded, across roll-overs, wherever the bytes are cut") {
  Rng rng(3);
  const std::vector<Event> events = random_events(&rng, 300, 16'700'000, 1000, kSize.width, kSize.height);
  const Bytes bytes = encode_evt3(events);
  const Decoded decoded = decode_whole(Evt3Decoder(kSize), bytes);
  CHECK(decoded.events == events);
  check_every_split(Evt3Decoder(kSize), bytes);

  std::vector<Event> sparse = random_events(&rng, 3000, 5, 2'000'000, kSize.width, kSize.height);
  const Decoded wrapped = decode_whole(Evt3Decoder(kSize), encode_evt3(sparse));
  CHECK(wrapped.events == sparse);
  CHECK(wrapped.stats.time_wraps == static_cast<std::uint64_t>(sparse.back().t_us >> 24));
}

TEST_CASE("EVT3: random words say the same wherever they are cut, and allocate nothing") {
  Rng rng(4);
  Bytes bytes;
  for (int i = 0; i < 501; ++i) bytes.push_back(static_cast<std::uint8_t>(rng.next()));
  check_every_split(Evt3Decoder(kSize), bytes);

  Evt3Decoder decoder;
  Event out[64];
  Span<const std::uint8_t> input(bytes);
  std::size_t count = 0;
  const AllocScope heap;
  const Status status = decoder.decode(&input, out, &count);
  CHECK(heap.allocations() == 0);
  CHECK(status == Status::ok);
}

}  // namespace
}  // namespace lecalib::test
