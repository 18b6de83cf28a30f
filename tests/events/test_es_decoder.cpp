// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include "lecalib/events/es_decoder.hpp"
#include "support/decode_pieces.hpp"
#include "support/random_events.hpp"
#include "support/record_encoder.hpp"

namespace lecalib::test {
namespace {

constexpr SensorSize kSize{1280, 720};

TEST_CASE("Event Stream: an event is 5 bytes, and rows count from the bottom") {
  const Bytes bytes = {2 * 126 + 1, 0xFF, 0x04, 0xCF, 0x02, 0, 0, 0, 0, 0};
  const Decoded decoded = decode_whole(EsDecoder(kSize), bytes);
  CHECK(decoded.events == std::vector<Event>{{126, 1279, 0, 1}, {126, 0, 719, 0}});
}

TEST_CASE("Event Stream: overflows let time pass, resets do nothing between events") {
  const Bytes bytes = {0xFF, 0xFF, 0xFE, 0xFE, 2 * 3, 1, 0, 2, 0};
  const Decoded decoded = decode_whole(EsDecoder(kSize), bytes);
  CHECK(decoded.events == std::vector<Event>{{2 * 127 + 3, 1, 717, 0}});
  CHECK(decoded.stats.other_words == 2);
}

TEST_CASE("Event Stream: of ATIS the exposure measurements are counted") {
  // Overflow of 3 and of 1, a reset, an ON event after 5 us, a measurement after 1 us, an OFF event after 62 us.
  const Bytes bytes = {0xFF, 0xFD, 0xFC, 5 * 4 + 2, 1, 0, 0, 0, 4 + 2 + 1, 9, 0, 9, 0, 62 * 4, 2, 0, 0, 0};
  const Decoded decoded = decode_whole(EsDecoder(EsFormat({304, 240}, EsContent::atis)), bytes);
  const std::int64_t begin_us = 4 * 63 + 5;
  CHECK(decoded.events == std::vector<Event>{{begin_us, 1, 239, 1}, {begin_us + 63, 2, 239, 0}});
  CHECK(decoded.stats.other_words == 2);
}

TEST_CASE("Event Stream: events beside the sensor are counted") {
  const Bytes bytes = {0, 0, 5, 0, 0, 0, 0, 0, 0xD0, 2};
  const Decoded decoded = decode_whole(EsDecoder(kSize), bytes);
  CHECK(decoded.events.empty());
  CHECK(decoded.stats.outside == 2);
}

TEST_CASE("Event Stream: a cut last event is told with its place") {
  const Bytes bytes = {0, 0, 0, 0, 0, 7, 0, 0, 0, 0};
  for (std::size_t size = 6; size < 10; ++size) {
    const Decoded decoded = decode_pieces(EsDecoder(kSize), {Span<const std::uint8_t>(bytes).first(size)});
    CHECK(decoded.status == Status::malformed_input);
    CHECK(decoded.error_offset == 5);
    CHECK(decoded.events.size() == 1);
  }
}

TEST_CASE("Event Stream: what is encoded is decoded, wherever the bytes are cut") {
  Rng rng(5);
  const std::vector<Event> events = random_events(&rng, 100, 1000, 300, kSize.width, kSize.height);
  const Bytes bytes = encode_es(events, kSize.height);
  CHECK(decode_whole(EsDecoder(kSize), bytes).events == events);
  check_every_split(EsDecoder(kSize), bytes);
  Bytes noise;
  for (int i = 0; i < 500; ++i) noise.push_back(static_cast<std::uint8_t>(rng.next()));
  check_every_split(EsDecoder(EsFormat(kSize, EsContent::atis)), noise);
}

}  // namespace
}  // namespace lecalib::test
