// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include "lecalib/events/evt21_decoder.hpp"
#include "support/decode_pieces.hpp"
#include "support/random_events.hpp"
#include "support/record_encoder.hpp"

namespace lecalib::test {
namespace {

constexpr SensorSize kSize{320, 320};
enum Type : unsigned { kOff = 0, kOn = 1, kHigh = 8, kTrigger = 10, kOthers = 14, kContinued = 15 };

constexpr std::uint32_t cd(std::uint32_t low, std::uint32_t x, std::uint32_t y) { return low << 22U | x << 11U | y; }

TEST_CASE("EVT2.1: a word carries up to 32 events of a row") {
  const Decoded decoded =
      decode_whole(Evt21Decoder(kSize),
                   evt21_bytes({{kHigh, 1000, 0}, {kOn, cd(63, 288, 319), 0x80000001}, {kOff, cd(0, 32, 0), 2}}));
  CHECK(decoded.status == Status::ok);
  CHECK(decoded.events == std::vector<Event>{{64063, 288, 319, 1}, {64063, 319, 319, 1}, {64000, 33, 0, 0}});
}

TEST_CASE("EVT2.1: the halves of a word may be swapped") {
  const std::vector<Word64> words = {{kHigh, 1000, 0}, {kOn, cd(63, 288, 319), 0x80000001}};
  const Decoded legacy = decode_whole(Evt21Decoder(Evt21Format(kSize, Evt21Order::legacy)), evt21_bytes(words, true));
  CHECK(legacy == decode_whole(Evt21Decoder(kSize), evt21_bytes(words)));
  CHECK(legacy.events.size() == 2);
}

TEST_CASE("EVT2.1: what is not given out is counted") {
  const Decoded decoded = decode_whole(Evt21Decoder(kSize), evt21_bytes({{kOn, cd(0, 0, 0), 7},
                                                                         {kHigh, 5, 0},
                                                                         {kTrigger, 1, 0},
                                                                         {kOthers, 2, 9},
                                                                         {kContinued, 3, 9},
                                                                         {2, 0, 1},
                                                                         {kOn, cd(0, 310, 1), 0xFFFFFFFF},
                                                                         {kOn, cd(0, 352, 1), 3},
                                                                         {kOn, cd(0, 0, 320), 0x10001},
                                                                         {kHigh, 4, 0},
                                                                         {kOff, cd(0, 1, 2), 1}}));
  CHECK(decoded.events.size() == 11);
  CHECK(decoded.events[9] == Event{320, 319, 1, 1});
  CHECK(decoded.events[10] == Event{256, 1, 2, 0});
  CHECK(decoded.stats.unplaced == 3);
  CHECK(decoded.stats.triggers == 1);
  CHECK(decoded.stats.other_words == 2);
  CHECK(decoded.stats.undefined_words == 1);
  CHECK(decoded.stats.outside == 22 + 2 + 2);
  CHECK(decoded.stats.time_steps_back == 1);
}

TEST_CASE("EVT2.1: triggers come beside events with time, channel and edge") {
  const Bytes bytes = evt21_bytes({{kHigh, 3, 0}, {kTrigger, (5U << 22U) + (17U << 8U) + 1, 0xFFFFFFFF}});
  const Decoded decoded = decode_whole(Evt21Decoder(), bytes);
  CHECK(decoded.triggers == std::vector<TriggerEvent>{{3 * 64 + 5, 17, TriggerKind::rising}});
  check_every_split(Evt21Decoder(), bytes);
}

TEST_CASE("EVT2.1: without a size x and y reach 2047, and no vector leads beyond") {
  const Decoded decoded =
      decode_whole(Evt21Decoder(), evt21_bytes({{kHigh, 0, 0}, {kOn, cd(0, 2047, 2047), 0xFFFFFFFF}}));
  CHECK(decoded.events == std::vector<Event>{{0, 2047, 2047, 1}});
  CHECK(decoded.stats.outside == 31);
}

TEST_CASE("EVT2.1: a cut last word is told with its place") {
  const Bytes bytes = evt21_bytes({{kHigh, 0, 0}, {kOn, cd(1, 2, 3), 1}});
  for (std::size_t size = 9; size < 16; ++size) {
    const Decoded decoded = decode_pieces(Evt21Decoder(kSize), {Span<const std::uint8_t>(bytes).first(size)});
    CHECK(decoded.status == Status::malformed_input);
    CHECK(decoded.error_offset == 8);
  }
}

TEST_CASE("EVT2.1: what is encoded is decoded, wherever the bytes are cut") {
  Rng rng(21);
  const std::vector<Event> events =
      random_events(&rng, 150, (std::int64_t{1} << 34) - 3000, 100, kSize.width, kSize.height);
  REQUIRE(events.back().t_us > std::int64_t{1} << 34);
  for (const bool legacy : {false, true}) {
    const Evt21Decoder decoder(Evt21Format(kSize, legacy ? Evt21Order::legacy : Evt21Order::little));
    const Bytes bytes = encode_evt21(events, legacy);
    CHECK(decode_whole(decoder, bytes).events == events);
    CHECK(decode_whole(decoder, bytes).stats.time_wraps == 1);
    check_every_split(decoder, bytes);
    Bytes noise;
    for (int i = 0; i < 503; ++i) noise.push_back(static_cast<std::uint8_t>(rng.next()));
    check_every_split(decoder, noise);
  }
}

}  // namespace
}  // namespace lecalib::test
