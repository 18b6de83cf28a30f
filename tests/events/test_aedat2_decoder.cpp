// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include "lecalib/events/aedat2_decoder.hpp"
#include "support/decode_pieces.hpp"
#include "support/random_events.hpp"
#include "support/record_encoder.hpp"

namespace lecalib::test {
namespace {

constexpr SensorSize kDavis240{240, 180};
constexpr SensorSize kDavis346{346, 260};
constexpr SensorSize kDvs128{128, 128};

Aedat2Decoder dvs128() { return Aedat2Decoder(Aedat2Format(kDvs128, Aedat2Layout::dvs128)); }

TEST_CASE("AEDAT 2: the addresses of a DAVIS count from the lower right corner") {
  // y 0 (bits 30 to 22), x 0 (bits 21 to 12), ON (bit 11) at 0x01020304 us; then y 259, x 345, OFF.
  const Bytes bytes = {0, 0, 8, 0, 1, 2, 3, 4, 0x40, 0xD5, 0x90, 0, 1, 2, 3, 5};
  const Decoded decoded = decode_whole(Aedat2Decoder(kDavis346), bytes);
  CHECK(decoded.events == std::vector<Event>{{0x01020304, 345, 259, 1}, {0x01020305, 0, 0, 0}});
}

TEST_CASE("AEDAT 2: the addresses of a DVS128 count from the lower right corner, and 0 is ON") {
  const Bytes bytes = {0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0x7F, 0xFF, 0, 0, 0, 10};
  const Decoded decoded = decode_whole(dvs128(), bytes);
  CHECK(decoded.events == std::vector<Event>{{9, 127, 127, 1}, {10, 0, 0, 0}});
}

TEST_CASE("AEDAT 2: frames, IMU samples and triggers are told from events and counted") {
  Bytes bytes;
  for (std::uint64_t word = 0; word < 7; ++word) bytes = bytes + aedat2_record(0x80000C00 + word * 0x10000000, 1);
  bytes = bytes + aedat2_record(0x80000000, 2) + aedat2_record(0x80000400, 3) + aedat2_record(0x400, 4);
  bytes = bytes + encode_davis({{5, 1, 2, 1}}, 240, 180);
  const Decoded decoded = decode_whole(Aedat2Decoder(kDavis240), bytes);
  CHECK(decoded.events == std::vector<Event>{{5, 1, 2, 1}});
  CHECK(decoded.stats.imu_samples == 1);
  CHECK(decoded.stats.other_words == 2);
  CHECK(decoded.triggers == std::vector<TriggerEvent>{{4, 0, TriggerKind::other}});

  const Decoded small = decode_whole(dvs128(), aedat2_record(0x8000, 1) + aedat2_record(0x10000, 2));
  CHECK(small.stats.triggers == 1);
  CHECK(small.stats.undefined_words == 1);
}

TEST_CASE("AEDAT 2: seven words make an IMU sample in the camera's axes") {
  // One g down the sensor's y axis, 0.5 g to its x; 36 degrees; 1, 2 and -3 deg/s.
  const Bytes bytes = aedat2_imu(77, {4096, -8192, 0, 340, 65 + 1, 131, -197}) + encode_davis({{5, 1, 2, 1}}, 240, 180);
  const Decoded decoded = decode_whole(Aedat2Decoder(kDavis240), bytes);
  REQUIRE(decoded.imu_samples.size() == 1);
  const ImuSample& sample = decoded.imu_samples[0];
  CHECK(sample.t_us == 77);
  CHECK(sample.accel_m_s2[0] == doctest::Approx(-0.5 * 9.80665));
  CHECK(sample.accel_m_s2[1] == doctest::Approx(-9.80665));
  CHECK(sample.accel_m_s2[2] == 0);
  CHECK(sample.temperature_c == doctest::Approx(36));
  constexpr double kDegree = 3.14159265358979 / 180;
  CHECK(sample.gyro_rad_s[0] == doctest::Approx(-66 / 65.5 * kDegree));
  CHECK(sample.gyro_rad_s[1] == doctest::Approx(2 * kDegree));
  CHECK(sample.gyro_rad_s[2] == doctest::Approx(197 / 65.5 * kDegree));
  check_every_split(Aedat2Decoder(kDavis240), bytes);
}

TEST_CASE("AEDAT 2: words that make no whole IMU sample are counted as others") {
  const Bytes whole = aedat2_imu(1, {1, 2, 3, 4, 5, 6, 7});
  const Bytes begin(whole.begin(), whole.begin() + 3 * 8);
  const Bytes end(whole.begin() + 3 * 8, whole.end());
  const auto decode = [](const Bytes& bytes) { return decode_whole(Aedat2Decoder(kDavis240), bytes); };
  for (const Bytes& broken : {end, begin + whole, whole + end, begin + begin + end, whole + begin}) {
    const std::size_t words = broken.size() / 8;
    const Decoded decoded = decode(broken);
    CHECK(decoded.imu_samples.size() == words / 7);
    CHECK(decoded.stats.imu_samples == words / 7);
    CHECK(decoded.stats.other_words == words % 7);
  }
  CHECK(decode(begin + begin).stats.other_words == 6);
  CHECK(decode(aedat2_imu(1, {1, 2, 3, 4, 5, 6, 7, 8})).stats.other_words == 1);
}

TEST_CASE("AEDAT 2: an IMU sample out of the events' order leaves their clock alone") {
  const std::int64_t range = std::int64_t{1} << 32;
  const std::vector<Event> events = {{range - 2, 1, 1, 1}, {range + 1, 1, 1, 1}};
  const Bytes bytes = encode_davis({events[0]}, 240, 180) + aedat2_imu(range + 5, {0, 0, 0, 0, 0, 0, 0}) +
                      encode_davis({events[1]}, 240, 180) + aedat2_imu(range - 7, {0, 0, 0, 0, 0, 0, 0});
  const Decoded decoded = decode_whole(Aedat2Decoder(kDavis240), bytes);
  CHECK(decoded.events == events);
  REQUIRE(decoded.imu_samples.size() == 2);
  CHECK(decoded.imu_samples[0].t_us == range + 5);
  CHECK(decoded.imu_samples[1].t_us == range - 7);
  CHECK(decoded.stats.time_steps_back == 0);
}

TEST_CASE("AEDAT 2: addresses beside the sensor are counted, all of them when its size is unknown") {
  const Bytes bytes = encode_davis({{5, 1, 2, 1}, {6, 0, 0, 1}}, 346, 260);
  CHECK(decode_whole(Aedat2Decoder(kDavis240), bytes).stats.outside == 2);
  CHECK(decode_whole(Aedat2Decoder(), bytes).stats.outside == 2);
  CHECK(decode_whole(Aedat2Decoder(), bytes).events.empty());
}

TEST_CASE("AEDAT 2: 32 bits of time roll over; lesser steps back are counted") {
  const std::int64_t range = std::int64_t{1} << 32;
  const std::vector<Event> events = {{range - 2, 1, 1, 1}, {range + 1, 1, 1, 1}};
  const Decoded decoded = decode_whole(Aedat2Decoder(kDavis240), encode_davis(events, 240, 180));
  CHECK(decoded.events == events);
  CHECK(decoded.stats.time_wraps == 1);
  const Decoded back = decode_whole(dvs128(), encode_dvs128({{500, 1, 1, 1}, {400, 1, 1, 1}}));
  CHECK(back.events.back().t_us == 400);
  CHECK(back.stats.time_steps_back == 1);
}

TEST_CASE("AEDAT 2: a cut last record is told with its place") {
  const Bytes bytes = encode_davis({{1, 2, 3, 1}, {2, 3, 4, 1}}, 240, 180);
  for (std::size_t size = 9; size < 16; ++size) {
    const Decoded decoded = decode_pieces(Aedat2Decoder(kDavis240), {Span<const std::uint8_t>(bytes).first(size)});
    CHECK(decoded.status == Status::malformed_input);
    CHECK(decoded.error_offset == 8);
  }
}

TEST_CASE("AEDAT 2: what is encoded is decoded, wherever the bytes are cut") {
  Rng rng(4);
  const std::vector<Event> large = random_events(&rng, 100, 1000, 100, 346, 260);
  const Bytes davis = encode_davis(large, 346, 260);
  CHECK(decode_whole(Aedat2Decoder(kDavis346), davis).events == large);
  check_every_split(Aedat2Decoder(kDavis346), davis);
  const std::vector<Event> small = random_events(&rng, 100, 1000, 100, 128, 128);
  CHECK(decode_whole(dvs128(), encode_dvs128(small)).events == small);
  check_every_split(dvs128(), encode_dvs128(small));
}

}  // namespace
}  // namespace lecalib::test
