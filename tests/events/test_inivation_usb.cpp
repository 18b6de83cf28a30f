// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>

#include "lecalib/events/davis_usb_decoder.hpp"
#include "lecalib/events/dvxplorer_usb_decoder.hpp"
#include "support/decode_pieces.hpp"
#include "support/inivation_encoder.hpp"
#include "support/random_events.hpp"

namespace lecalib::test {
namespace {

constexpr SensorSize kDavis{346, 260};
constexpr SensorSize kDvxplorer{640, 480};
constexpr double kRadPerDegree = 3.14159265358979 / 180;
constexpr double kGravity = 9.80665;

DavisUsbDecoder davis(const InivationFacts& facts) { return DavisUsbDecoder(DavisUsbFormat(facts)); }
DvxplorerUsbDecoder dvxplorer(const InivationFacts& facts) { return DvxplorerUsbDecoder(DvxplorerUsbFormat(facts)); }

void check_bit_flips(const Bytes& bytes, const std::vector<Event>& events, SensorSize size, bool is_davis) {
  for (std::size_t i = 0; i < bytes.size() * 8; ++i) {
    Bytes broken = bytes;
    broken[i / 8] = static_cast<std::uint8_t>(broken[i / 8] ^ 1U << i % 8);
    const Decoded decoded =
        is_davis ? decode_whole(DavisUsbDecoder(size), broken) : decode_whole(DvxplorerUsbDecoder(size), broken);
    REQUIRE(decoded.events.size() <= events.size() + 8);
    for (const Event& event : decoded.events) REQUIRE((event.x < size.width && event.y < size.height));
  }
}

}  // namespace

TEST_CASE("DAVIS USB: a row stands for the events after it, a time for all that follows") {
  const Bytes bytes = {0x07, 0x80, 0x03, 0x11, 0x59, 0x31, 0x00, 0x20, 0x08, 0x80, 0x05, 0x30};
  const Decoded decoded = decode_whole(DavisUsbDecoder(SensorSize{346, 300}), bytes);
  CHECK(decoded.events == std::vector<Event>{{7, 345, 259, 1}, {7, 0, 259, 0}, {8, 5, 259, 1}});
}

TEST_CASE("DAVIS USB: a wrap says how many times the clock ran over, and 0 is one time") {
  const Bytes event = usb_word(1, 2) + usb_word(3, 1);
  const Bytes bytes = usb_time(0, 9) + event + usb_word(7, 5) + event + usb_word(7, 0) + event + usb_time(3, 3) + event;
  const Decoded decoded = decode_whole(DavisUsbDecoder(kDavis), bytes);
  REQUIRE(decoded.events.size() == 4);
  CHECK(decoded.events[1].t_us == 5 * 32768);
  CHECK(decoded.events[2].t_us == 6 * 32768);
  CHECK(decoded.events[3].t_us == 6 * 32768 + 3);
  CHECK(decoded.stats.time_wraps == 6);
  CHECK(decoded.stats.time_steps_back == 0);
}

TEST_CASE("DAVIS USB: after a reset times go on from the last one; a step back is counted") {
  const Bytes event = usb_word(1, 2) + usb_word(3, 1);
  const Bytes bytes =
      usb_time(0, 40'000) + event + usb_word(0, 1) + event + usb_time(0, 10) + event + usb_time(0, 4) + event;
  const Decoded decoded = decode_whole(DavisUsbDecoder(kDavis), bytes);
  REQUIRE(decoded.events.size() == 4);
  CHECK(decoded.events[1].t_us == 40'000);
  CHECK(decoded.events[2].t_us == 40'010);
  CHECK(decoded.events[3].t_us == 40'004);
  CHECK(decoded.stats.time_resets == 1);
  CHECK(decoded.stats.time_steps_back == 1);
}

TEST_CASE("DAVIS USB: events before the first time and the first row are counted, not guessed") {
  const Bytes bytes = usb_word(1, 1) + usb_word(3, 1) + usb_word(0, 3) + usb_time(0, 5) + usb_word(3, 2);
  const Decoded decoded = decode_whole(DavisUsbDecoder(kDavis), bytes);
  CHECK(decoded.events == std::vector<Event>{{5, 2, 1, 1}});
  CHECK(decoded.stats.unplaced == 2);  // an event and a trigger
  CHECK(decode_whole(DavisUsbDecoder(kDavis), usb_time(0, 5) + usb_word(3, 2)).stats.unplaced == 1);
}

TEST_CASE("DAVIS USB: a row beside the sensor takes its events along") {
  const Bytes bytes = usb_time(0, 0) + usb_word(1, 259) + usb_word(3, 345) + usb_word(3, 346) + usb_word(1, 260) +
                      usb_word(2, 0) + usb_word(2, 1);
  CHECK(decode_whole(DavisUsbDecoder(kDavis), bytes).stats.outside == 3);
  CHECK(decode_whole(DavisUsbDecoder(), bytes).events.size() == 4);
  // With exchanged axes the row word is x, and the limits go with it.
  const Decoded swapped = decode_whole(davis({SensorSize{260, 346}, true}), bytes);
  CHECK(swapped.events == std::vector<Event>{{0, 259, 345, 1}});
  CHECK(swapped.stats.outside == 3);
}

TEST_CASE("DAVIS USB: triggers tell their edge, and whether the camera made them") {
  const Bytes bytes =
      usb_time(0, 9) + usb_word(0, 2) + usb_word(0, 3) + usb_word(0, 4) + usb_word(0, 16) + usb_word(0, 17);
  const std::vector<TriggerEvent> expected = {{9, 0, TriggerKind::falling},
                                              {9, 0, TriggerKind::rising},
                                              {9, 0, TriggerKind::pulse},
                                              {9, 1, TriggerKind::falling},
                                              {9, 1, TriggerKind::rising}};
  CHECK(decode_whole(DavisUsbDecoder(kDavis), bytes).triggers == expected);
}

TEST_CASE("DAVIS USB: an IMU sample is put together in its ranges and the camera's axes") {
  // 4 g and 500 deg/s; one g down the sensor's y axis; 10, -20 and 30 deg/s.
  const Bytes bytes = usb_time(0, 77) + usb_imu(0xE0 + 1 * 4 + 1, {4096, -8192, 0, 340, 655, -1311, 1966});
  const Decoded decoded = decode_whole(DavisUsbDecoder(kDavis), bytes);
  REQUIRE(decoded.imu_samples.size() == 1);
  const ImuSample& sample = decoded.imu_samples[0];
  CHECK(sample.t_us == 77);
  CHECK(sample.accel_m_s2[0] == doctest::Approx(-0.5 * kGravity));
  CHECK(sample.accel_m_s2[1] == doctest::Approx(-kGravity));
  CHECK(sample.temperature_c == doctest::Approx(36));
  CHECK(sample.gyro_rad_s[0] == doctest::Approx(-655 * 500 / 32768.0 * kRadPerDegree));
  CHECK(sample.gyro_rad_s[1] == doctest::Approx(-1311 * 500 / 32768.0 * kRadPerDegree));
  CHECK(sample.gyro_rad_s[2] == doctest::Approx(-1966 * 500 / 32768.0 * kRadPerDegree));
  CHECK(decoded.stats.other_words == 0);
  check_every_split(DavisUsbDecoder(kDavis), bytes);

  const Decoded mounted = decode_whole(davis({kDavis, false, {true, false, true}, 2}), bytes);
  REQUIRE(mounted.imu_samples.size() == 1);
  CHECK(mounted.imu_samples[0].accel_m_s2[0] == -sample.accel_m_s2[0]);
  CHECK(mounted.imu_samples[0].accel_m_s2[1] == sample.accel_m_s2[1]);
  CHECK(mounted.imu_samples[0].gyro_rad_s[2] == -sample.gyro_rad_s[2]);
  CHECK(mounted.imu_samples[0].temperature_c == doctest::Approx(340 / 333.87 + 21));
}

TEST_CASE("DAVIS USB: every range of the IMU, and samples of some of its parts") {
  for (unsigned range = 0; range < 4; ++range) {
    const Bytes bytes = usb_imu(0xC0 + range * 4 + range, {0, 16384, 0, 0, 16384, 0});
    const Decoded decoded = decode_whole(DavisUsbDecoder(kDavis), bytes);
    REQUIRE(decoded.imu_samples.size() == 1);
    CHECK(decoded.imu_samples[0].accel_m_s2[1] == doctest::Approx(std::pow(2.0, range) * kGravity));
    CHECK(decoded.imu_samples[0].gyro_rad_s[1] == doctest::Approx(125 * std::pow(2.0, range) * kRadPerDegree));
    CHECK(std::isnan(decoded.imu_samples[0].temperature_c));
  }
  const auto parts = [](unsigned format, const std::vector<int>& readings) {
    const Decoded decoded = decode_whole(DavisUsbDecoder(kDavis), usb_imu(format, readings));
    REQUIRE(decoded.imu_samples.size() == 1);
    const ImuSample& sample = decoded.imu_samples[0];
    return std::vector<bool>{!std::isnan(sample.accel_m_s2[2]), !std::isnan(sample.temperature_c),
                             !std::isnan(sample.gyro_rad_s[0])};
  };
  CHECK(parts(0x80, {1, 2, 3}) == std::vector<bool>{true, false, false});
  CHECK(parts(0x40, {1, 2, 3}) == std::vector<bool>{false, false, true});
  CHECK(parts(0x20, {1}) == std::vector<bool>{false, true, false});
  CHECK(parts(0xA0, {1, 2, 3, 4}) == std::vector<bool>{true, true, false});
  CHECK(parts(0x60, {1, 2, 3, 4}) == std::vector<bool>{false, true, true});
}

TEST_CASE("DAVIS USB: IMU samples that are not whole and frames are counted as others") {
  const Bytes whole = usb_imu(0xE5, {1, 2, 3, 4, 5, 6, 7});
  const std::size_t words = whole.size() / 2;
  const auto without = [&](std::size_t word) {
    Bytes bytes = whole;
    const auto at = bytes.begin() + static_cast<std::ptrdiff_t>(2 * word);
    bytes.erase(at, at + 2);
    return bytes;
  };
  for (std::size_t word = 0; word < words; ++word) {
    const Decoded decoded = decode_whole(DavisUsbDecoder(kDavis), without(word) + whole);
    CHECK(decoded.imu_samples.size() == 1);
    CHECK(decoded.stats.other_words == words - 1);
  }
  const Decoded longer = decode_whole(DavisUsbDecoder(kDavis), usb_imu(0xE5, {1, 2, 3, 4, 5, 6, 7, 8}));
  CHECK(longer.imu_samples.empty());
  CHECK(longer.stats.other_words == words + 2);

  const Bytes event = usb_time(0, 1) + usb_word(1, 2) + usb_word(3, 4);
  const Decoded framed = decode_whole(DavisUsbDecoder(kDavis), usb_frame() + event + usb_frame() + usb_word(0, 0));
  CHECK(framed.events == std::vector<Event>{{1, 4, 2, 1}});
  CHECK(framed.stats.other_words == 2 * kUsbFrameWords + 1);
  CHECK(framed.stats.undefined_words == 0);
}

TEST_CASE("DAVIS USB: words that are not defined are counted") {
  const Bytes bytes = usb_word(0, 6) + usb_word(0, 18) + usb_word(5, 4 * 256) + usb_word(5, 15 * 256);
  CHECK(decode_whole(DavisUsbDecoder(kDavis), bytes).stats.undefined_words == 4);
}

TEST_CASE("DAVIS USB: a cut last word is told with its place") {
  const Bytes bytes = usb_time(0, 1) + usb_word(1, 2) + usb_word(3, 4);
  const Decoded decoded = decode_pieces(DavisUsbDecoder(kDavis), {Span<const std::uint8_t>(bytes).first(5)});
  CHECK(decoded.status == Status::malformed_input);
  CHECK(decoded.error_offset == 4);
}

TEST_CASE("DAVIS USB: what is encoded is decoded, wherever the bytes are cut and whichever bit is wrong") {
  Rng rng(11);
  const std::vector<Event> events = random_events(&rng, 120, 30'000, 9000, kDavis.width, kDavis.height);
  const Bytes bytes = encode_davis_usb(events);
  CHECK(decode_whole(DavisUsbDecoder(kDavis), bytes).events == events);
  check_every_split(DavisUsbDecoder(kDavis), bytes);
  check_bit_flips(bytes, events, kDavis, true);
  const std::vector<Event> sparse = random_events(&rng, 300, 0, 300'000'000, kDavis.width, kDavis.height);
  CHECK(decode_whole(DavisUsbDecoder(kDavis), encode_davis_usb(sparse)).events == sparse);
}

TEST_CASE("DVXplorer USB: two groups of eight rows share a column") {
  const Bytes bytes = usb_time(0, 5) + usb_word(1, 639) + usb_word(4, 10 + 3 * 64) + usb_word(3, 0x81) +
                      usb_word(2, 0x100 + 0x02) + usb_word(4, 59 + 59 * 64 % 2048 + 2048) + usb_word(3, 0x80);
  const Decoded decoded = decode_whole(DvxplorerUsbDecoder(kDvxplorer), bytes);
  const std::vector<Event> expected = {{5, 639, 80, 1}, {5, 639, 87, 1}, {5, 639, 105, 0}, {5, 639, 479, 1}};
  CHECK(decoded.events == expected);
  CHECK(decoded.stats.undefined_words == 0);
}

TEST_CASE("DVXplorer USB: groups and columns beside the sensor are counted") {
  const auto outside = [](const Bytes& words, SensorSize size) {
    const Decoded decoded = decode_whole(DvxplorerUsbDecoder(size), usb_time(0, 5) + words);
    CHECK(decoded.stats.outside + decoded.events.size() == 8);
    return decoded.stats.outside;
  };
  CHECK(outside(usb_word(1, 640) + usb_word(4, 0) + usb_word(3, 0xFF), kDvxplorer) == 8);
  CHECK(outside(usb_word(1, 0) + usb_word(4, 60) + usb_word(3, 0xFF), kDvxplorer) == 8);
  CHECK(outside(usb_word(1, 0) + usb_word(4, 2 + 3 * 64 + 2048) + usb_word(2, 0xFF), kDvxplorer) == 8);  // row -8
  CHECK(outside(usb_word(1, 0) + usb_word(4, 2 + 3 * 64 + 2048) + usb_word(2, 0xFF), {}) == 8);
  CHECK(outside(usb_word(1, 0) + usb_word(4, 63 + 31 * 64) + usb_word(2, 0xFF), {}) == 0);
  CHECK(outside(usb_word(1, 0) + usb_word(4, 1) + usb_word(3, 0xFF), {10, 13}) == 3);
}

TEST_CASE("DVXplorer USB: events before the first time, column and groups are counted, not guessed") {
  const Bytes time = usb_time(0, 5), column = usb_word(1, 3), groups = usb_word(4, 0), pixels = usb_word(3, 7);
  for (const Bytes& bytes : {column + groups + pixels, time + groups + pixels, time + column + pixels}) {
    CHECK(decode_whole(DvxplorerUsbDecoder(kDvxplorer), bytes).stats.unplaced == 3);
  }
  CHECK(decode_whole(DvxplorerUsbDecoder(kDvxplorer), time + column + groups + pixels).events.size() == 3);
}

TEST_CASE("DVXplorer USB: axes may be exchanged") {
  const Bytes bytes = usb_time(0, 5) + usb_word(1, 100) + usb_word(4, 1) + usb_word(3, 0x81);
  const Decoded decoded = decode_whole(dvxplorer({SensorSize{480, 640}, true}), bytes);
  CHECK(decoded.events == std::vector<Event>{{5, 8, 100, 1}, {5, 15, 100, 1}});
}

TEST_CASE("DVXplorer USB: its IMU has other ranges, and x and y exchanged") {
  for (unsigned range = 0; range < 5; ++range) {
    const Bytes bytes = usb_imu(0xE0 + (range % 4) * 8 + range, {1000, 16384, 0, 512, 2000, 16384, -300});
    const Decoded decoded = decode_whole(dvxplorer({kDvxplorer, false, {false, true, false}}), bytes);
    REQUIRE(decoded.imu_samples.size() == 1);
    const ImuSample& sample = decoded.imu_samples[0];
    const double g = std::pow(2.0, range % 4 + 1) / 32768 * kGravity;
    const double rate = 2000 / std::pow(2.0, range) / 32768 * kRadPerDegree;
    CHECK(sample.accel_m_s2[0] == doctest::Approx(-16384 * g));
    CHECK(sample.accel_m_s2[1] == doctest::Approx(-1000 * g));
    CHECK(sample.gyro_rad_s[0] == doctest::Approx(-16384 * rate));
    CHECK(sample.gyro_rad_s[1] == doctest::Approx(-2000 * rate));
    CHECK(sample.gyro_rad_s[2] == doctest::Approx(300 * rate));
    CHECK(sample.temperature_c == doctest::Approx(24));
  }
  const Decoded undefined = decode_whole(DvxplorerUsbDecoder(kDvxplorer), usb_imu(0xE5, {1, 2, 3, 4, 5, 6, 7}));
  CHECK(undefined.imu_samples.empty());
  CHECK(undefined.stats.other_words == 17);
}

TEST_CASE("DVXplorer USB: what is encoded is decoded, wherever the bytes are cut and whichever bit is wrong") {
  Rng rng(12);
  const std::vector<Event> events = random_events(&rng, 120, 30'000, 9000, kDvxplorer.width, kDvxplorer.height);
  const Bytes bytes = encode_dvxplorer_usb(events);
  CHECK(decode_whole(DvxplorerUsbDecoder(kDvxplorer), bytes).events == events);
  check_every_split(DvxplorerUsbDecoder(kDvxplorer), bytes);
  check_bit_flips(bytes, events, kDvxplorer, false);
  const Bytes full = usb_time(0, 5) + usb_word(1, 3) + usb_word(4, 0) + usb_word(3, 0xFF) + usb_word(3, 0x1FF);
  check_every_split(DvxplorerUsbDecoder(kDvxplorer), full);
}

TEST_CASE("DAVIS and DVXplorer USB: random words say the same wherever they are cut") {
  Rng rng(13);
  Bytes bytes;
  for (int i = 0; i < 501; ++i) bytes.push_back(static_cast<std::uint8_t>(rng.next()));
  check_every_split(DavisUsbDecoder(kDavis), bytes);
  check_every_split(DvxplorerUsbDecoder(kDvxplorer), bytes);
}

}  // namespace lecalib::test
