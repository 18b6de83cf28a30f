// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>

#include "lecalib/events/evt2_decoder.hpp"
#include "support/decode_pieces.hpp"
#include "support/random_events.hpp"

namespace lecalib::test {
namespace {

constexpr SensorSize kSize{640, 480};
enum Type : unsigned { kOff = 0, kOn = 1, kHigh = 8, kTrigger = 10, kOthers = 14, kContinued = 15 };

constexpr std::uint32_t cd(std::uint32_t low, std::uint32_t x, std::uint32_t y) { return low << 22U | x << 11U | y; }

TEST_CASE("EVT2: a word carries the lower time, column and row") {
  const Decoded decoded =
      decode_whole(Evt2Decoder(kSize), evt2_bytes({{kHigh, 1000}, {kOn, cd(63, 639, 479)}, {kOff, cd(0, 0, 0)}}));
  CHECK(decoded.status == Status::ok);
  CHECK(decoded.events == std::vector<Event>{{64063, 639, 479, 1}, {64000, 0, 0, 0}});
}

TEST_CASE("EVT2: events before the first TIME_HIGH are counted, not guessed") {
  const Decoded decoded =
      decode_whole(Evt2Decoder(kSize), evt2_bytes({{kOn, cd(5, 1, 1)}, {kHigh, 1}, {kOn, cd(6, 2, 2)}}));
  CHECK(decoded.events == std::vector<Event>{{70, 2, 2, 1}});
  CHECK(decoded.stats.unplaced == 1);
}

TEST_CASE("EVT2: 34 bits of time roll over") {
  constexpr std::uint32_t kMax = (1U << 28U) - 1;
  const Decoded decoded = decode_whole(
      Evt2Decoder(kSize),
      evt2_bytes(
          {{kHigh, kMax}, {kOn, cd(63, 0, 0)}, {kHigh, 0}, {kOn, cd(0, 0, 0)}, {kHigh, kMax}, {kOn, cd(0, 0, 0)}}));
  REQUIRE(decoded.events.size() == 3);
  CHECK(decoded.events[1].t_us == decoded.events[0].t_us + 1);
  CHECK(decoded.events[2].t_us == decoded.events[0].t_us - 63);  // late, from before the roll-over
  CHECK(decoded.stats.time_wraps == 0);
  CHECK(decoded.stats.time_steps_back == 1);
}

TEST_CASE("EVT2: other words and events beside the sensor are counted") {
  const Decoded decoded = decode_whole(Evt2Decoder(kSize), evt2_bytes({{kHigh, 0},
                                                                       {kTrigger, 1},
                                                                       {kOthers, 2},
                                                                       {kContinued, 3},
                                                                       {2, 0},
                                                                       {9, 0},
                                                                       {kOn, cd(0, 640, 0)},
                                                                       {kOn, cd(0, 0, 480)},
                                                                       {kOff, cd(0, 1, 2)}}));
  CHECK(decoded.events == std::vector<Event>{{0, 1, 2, 0}});
  CHECK(decoded.stats.triggers == 1);
  CHECK(decoded.stats.other_words == 2);
  CHECK(decoded.stats.undefined_words == 2);
  CHECK(decoded.stats.outside == 2);
}

TEST_CASE("EVT2: triggers come beside events with time, channel and edge, and wait for the first time") {
  constexpr unsigned kEdge = 5U << 22U | 17U << 8U;
  const Bytes bytes =
      evt2_bytes({{kTrigger, kEdge}, {kHigh, 3}, {kTrigger, kEdge + 1}, {kOn, cd(6, 1, 2)}, {kTrigger, kEdge}});
  const Decoded decoded = decode_whole(Evt2Decoder(kSize), bytes);
  const std::vector<TriggerEvent> expected = {{3 * 64 + 5, 17, TriggerKind::rising},
                                              {3 * 64 + 5, 17, TriggerKind::falling}};
  CHECK(decoded.triggers == expected);
  CHECK(decoded.stats.unplaced == 1);
  check_every_split(Evt2Decoder(kSize), bytes);
}

TEST_CASE("EVT2: six words are an IMU sample with the first one's time, in SI units along the camera's axes") {
  std::vector<Word> words = evt2_imu(5, {16384, -16384, 8192, 32767, -16384, 1});
  words.insert(words.begin(), {kHigh, 3});
  words.insert(words.begin() + 2, {{kOn, cd(6, 1, 2)}, {kHigh, 4}});  // between its words
  const Bytes bytes = evt2_bytes(words);
  const Decoded decoded = decode_whole(Evt2Decoder(kSize), bytes);
  REQUIRE(decoded.imu_samples.size() == 1);
  const ImuSample& sample = decoded.imu_samples[0];
  CHECK(sample.t_us == 3 * 64 + 5);
  // The sensor's axes point to the left, up and forwards.
  constexpr double kGravity = 9.80665;
  CHECK(sample.accel_m_s2[0] == doctest::Approx(-kGravity));
  CHECK(sample.accel_m_s2[1] == doctest::Approx(kGravity));
  CHECK(sample.accel_m_s2[2] == doctest::Approx(kGravity / 2));
  constexpr double kLargest = 2000 * 3.14159265358979 / 180;
  CHECK(sample.gyro_rad_s[0] == doctest::Approx(-kLargest).epsilon(1e-4));
  CHECK(sample.gyro_rad_s[1] == doctest::Approx(kLargest / 2));
  CHECK(sample.gyro_rad_s[2] == doctest::Approx(kLargest / 32768));
  CHECK(std::isnan(sample.temperature_c));
  CHECK(decoded.events == std::vector<Event>{{3 * 64 + 6, 1, 2, 1}});
  CHECK(decoded.stats.other_words == 0);
  CHECK(decoded.stats.undefined_words == 0);
  check_every_split(Evt2Decoder(kSize), bytes);
}

TEST_CASE("EVT2: IMU samples that are cut short, or come before the first time, are counted and spoil no other") {
  const std::vector<Word> whole = evt2_imu(1, {1, 2, 3, 4, 5, 6});
  std::vector<Word> words = whole;  // before the first time: 6 words
  words.push_back({kHigh, 1});
  words.insert(words.end(), whole.begin(), whole.begin() + 3);  // cut short by the next: 3 words
  words.insert(words.end(), whole.begin(), whole.end());
  words.push_back({kContinued, 7});                             // of nothing
  words.insert(words.end(), whole.begin(), whole.begin() + 5);  // cut short by another word with parts: 5 words
  words.insert(words.end(), {{kOthers, 1}, {kContinued, 7}, {kContinued, 7}});
  const Bytes bytes = evt2_bytes(words);
  const Decoded decoded = decode_whole(Evt2Decoder(kSize), bytes);
  CHECK(decoded.imu_samples.size() == 1);
  CHECK(decoded.stats.imu_samples == 1);
  CHECK(decoded.stats.unplaced == 1);
  CHECK(decoded.stats.other_words == 6 + 3 + 1 + 5 + 3);
  check_every_split(Evt2Decoder(kSize), bytes);
}

TEST_CASE("EVT2: a cut last word is told with its place") {
  Bytes bytes = evt2_bytes({{kHigh, 0}, {kOn, cd(1, 2, 3)}});
  for (const std::size_t size : {5U, 6U, 7U}) {
    const Decoded decoded = decode_pieces(Evt2Decoder(kSize), {Span<const std::uint8_t>(bytes).first(size)});
    CHECK(decoded.status == Status::malformed_input);
    CHECK(decoded.error_offset == 4);
    CHECK(decoded.events.empty());
  }
}

TEST_CASE("EVT2: what is encoded is decoded, wherever the bytes are cut") {
  Rng rng(2);
  const std::vector<Event> events =
      random_events(&rng, 150, (std::int64_t{1} << 34) - 3000, 100, kSize.width, kSize.height);
  REQUIRE(events.back().t_us > std::int64_t{1} << 34);
  const Bytes bytes = encode_evt2(events);
  CHECK(decode_whole(Evt2Decoder(kSize), bytes).events == events);
  check_every_split(Evt2Decoder(kSize), bytes);

  Bytes noise;
  for (int i = 0; i < 502; ++i) noise.push_back(static_cast<std::uint8_t>(rng.next()));
  check_every_split(Evt2Decoder(kSize), noise);
}

}  // namespace
}  // namespace lecalib::test
