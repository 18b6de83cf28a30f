// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include "lecalib/events/dat_decoder.hpp"
#include "support/decode_pieces.hpp"
#include "support/random_events.hpp"
#include "support/record_encoder.hpp"

namespace lecalib::test {
namespace {

constexpr SensorSize kSize{304, 240};

TEST_CASE("DAT: a record is a time and an address, which is packed closer in version 1") {
  const std::vector<Event> events = {{7, 303, 239, 1}, {7, 0, 0, 0}, {4'000'000'000, 3, 200, 1}};
  CHECK(decode_whole(DatDecoder(DatFormat(kSize, 2)), encode_dat(events, 2)).events == events);
  CHECK(decode_whole(DatDecoder(DatFormat(kSize, 1)), encode_dat(events, 1)).events == events);
  CHECK(decode_whole(DatDecoder(DatFormat({}, 0)), encode_dat(events, 1)).events == events);
  const std::vector<Event> wide = {{1, 16383, 16383, 1}};
  CHECK(decode_whole(DatDecoder(), encode_dat(wide)).events == wide);
}

TEST_CASE("DAT: 32 bits of time roll over; lesser steps back are counted") {
  const std::int64_t range = std::int64_t{1} << 32;
  const std::vector<Event> events = {{range - 2, 1, 1, 1}, {range + 1, 1, 1, 1}, {range + 500, 1, 1, 0}};
  Bytes bytes = encode_dat(events);
  const Decoded decoded = decode_whole(DatDecoder(kSize), bytes);
  CHECK(decoded.events == events);
  CHECK(decoded.stats.time_wraps == 1);
  CHECK(decoded.stats.time_steps_back == 0);
  const Decoded back = decode_whole(DatDecoder(kSize), encode_dat({{500, 1, 1, 1}, {400, 1, 1, 1}}));
  CHECK(back.events == std::vector<Event>{{500, 1, 1, 1}, {400, 1, 1, 1}});
  CHECK(back.stats.time_steps_back == 1);
  CHECK(back.stats.time_wraps == 0);
}

TEST_CASE("DAT: events beside the sensor are counted") {
  const Decoded decoded = decode_whole(DatDecoder(kSize), encode_dat({{1, 304, 0, 1}, {2, 0, 240, 1}, {3, 5, 6, 0}}));
  CHECK(decoded.events == std::vector<Event>{{3, 5, 6, 0}});
  CHECK(decoded.stats.outside == 2);
}

TEST_CASE("DAT: a cut last record is told with its place") {
  const Bytes bytes = encode_dat({{1, 2, 3, 1}, {2, 3, 4, 1}});
  for (std::size_t size = 9; size < 16; ++size) {
    const Decoded decoded = decode_pieces(DatDecoder(kSize), {Span<const std::uint8_t>(bytes).first(size)});
    CHECK(decoded.status == Status::malformed_input);
    CHECK(decoded.error_offset == 8);
    CHECK(decoded.events.size() == 1);
  }
}

TEST_CASE("DAT: a file of triggers gives time, channel and edge of each, and rolls over like one of events") {
  const std::int64_t range = std::int64_t{1} << 32;
  const std::vector<TriggerEvent> triggers = {
      {range - 5, 0, TriggerKind::rising}, {range - 4, 63, TriggerKind::falling}, {range + 9, 1, TriggerKind::rising}};
  const DatDecoder decoder(DatFormat({}, 2, DatContent::triggers));
  const Decoded decoded = decode_whole(decoder, encode_dat_triggers(triggers));
  CHECK(decoded.triggers == triggers);
  CHECK(decoded.events.empty());
  CHECK(decoded.stats.triggers == 3);
  CHECK(decoded.stats.time_wraps == 1);
  check_every_split(decoder, encode_dat_triggers(triggers));
}

TEST_CASE("DAT: what is encoded is decoded, wherever the bytes are cut") {
  Rng rng(3);
  const std::vector<Event> events =
      random_events(&rng, 100, (std::int64_t{1} << 32) - 2000, 100, kSize.width, kSize.height);
  const Bytes bytes = encode_dat(events);
  CHECK(decode_whole(DatDecoder(kSize), bytes).events == events);
  check_every_split(DatDecoder(kSize), bytes);
}

}  // namespace
}  // namespace lecalib::test
