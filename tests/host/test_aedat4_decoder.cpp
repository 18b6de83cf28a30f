// SPDX-License-Identifier: MIT
#include "lecalib/host/aedat4_decoder.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "lecalib/host/recording_decoder.hpp"
#include "support/aedat4_encoder.hpp"
#include "support/decode_pieces.hpp"
#include "support/random_events.hpp"
#include "support/shared_data.hpp"

using namespace lecalib;
using namespace lecalib::host;
using namespace lecalib::test;

namespace {

const std::string kXml = aedat4_xml(346, 260);
const std::vector<Event> kEvents = {{1'700'000'000'000'000, 345, 259, 1}, {1'700'000'000'000'007, 0, 0, 0}};

bool has(Compression compression) {
  std::vector<std::uint8_t> out;
  const Bytes frame = compression == Compression::lz4 ? lz4_frame({1}) : zstd_frame({1});
  return decompress(compression, frame, 100, &out) == nullptr;
}

TEST_CASE("AEDAT 4: events come from packets of the first event stream, the others are counted") {
  Bytes bytes = aedat4_header(0, kXml) + aedat4_packet(0, aedat4_events(kEvents));
  bytes = bytes + aedat4_packet(2, aedat4_content("IMUS", 3, Bytes(12))) + aedat4_packet(1, Bytes(50));
  bytes =
      bytes + aedat4_packet(3, aedat4_content("TRIG", 2, Bytes(8))) + aedat4_packet(7, aedat4_events({{1, 2, 3, 1}}));
  bytes = bytes + aedat4_packet(0, aedat4_events({})) + aedat4_packet(0, aedat4_events({{5, 346, 0, 1}, {6, 1, 1, 1}}));
  const Decoded decoded = decode_whole(RecordingDecoder(), bytes);
  CHECK(decoded.status == Status::ok);
  CHECK(decoded.events == std::vector<Event>{kEvents[0], kEvents[1], {6, 1, 1, 1}});
  CHECK(decoded.stats.imu_samples == 3);
  CHECK(decoded.stats.triggers == 2);
  CHECK(decoded.stats.other_words == 2);  // a frame, and the events of stream 7
  CHECK(decoded.stats.outside == 1);
  CHECK(decoded.stats.time_steps_back == 1);
  check_every_split(RecordingDecoder(), bytes);
}

TEST_CASE("AEDAT 4: IMU samples come beside events in SI units and the camera's axes, triggers with their kind") {
  const Bytes bytes = aedat4_header(0, kXml) +
                      aedat4_packet(2, aedat4_imu({{5, {27.5F, 0.5F, -1, 0.25F, 90, 45, -180}}, {1005, {}}})) +
                      aedat4_packet(0, aedat4_events(kEvents)) + aedat4_packet(3, aedat4_triggers(9, {1, 2, 3, 7}));
  const Decoded decoded = decode_whole(RecordingDecoder(), bytes);
  REQUIRE(decoded.imu_samples.size() == 2);
  const ImuSample& sample = decoded.imu_samples[0];
  CHECK(sample.t_us == 5);
  CHECK(decoded.imu_samples[1].t_us == 1005);
  CHECK(sample.temperature_c == 27.5F);
  CHECK(sample.accel_m_s2[0] == doctest::Approx(-0.5 * 9.80665));
  CHECK(sample.accel_m_s2[1] == doctest::Approx(-9.80665));
  CHECK(sample.accel_m_s2[2] == doctest::Approx(-0.25 * 9.80665));
  constexpr double kPi = 3.14159265358979;
  CHECK(sample.gyro_rad_s[0] == doctest::Approx(-kPi / 2));
  CHECK(sample.gyro_rad_s[1] == doctest::Approx(kPi / 4));
  CHECK(sample.gyro_rad_s[2] == doctest::Approx(kPi));
  const std::vector<TriggerEvent> triggers = {{9, 1, TriggerKind::rising},
                                              {9, 2, TriggerKind::falling},
                                              {9, 3, TriggerKind::pulse},
                                              {9, 7, TriggerKind::other}};
  CHECK(decoded.triggers == triggers);
  check_every_split(RecordingDecoder(), bytes);
}

TEST_CASE("AEDAT 4: IMU samples and triggers that contradict themselves are counted and cost no events") {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const Bytes nan = aedat4_imu({{5, {kNan, 0, 0, 0, 0, 0, 0}}, {6, {0, 0, 0, 0, 0, 0, kNan}}, {7, {}}});
  const Bytes far = aedat4_content("TRIG", 2, little_endian(1000, 4) + little_endian(4, 4));
  const Bytes bytes =
      aedat4_header(0, kXml) + aedat4_packet(2, nan) + aedat4_packet(3, far) + aedat4_packet(0, aedat4_events(kEvents));
  const Decoded decoded = decode_whole(RecordingDecoder(), bytes);
  CHECK(decoded.status == Status::ok);
  CHECK(decoded.events == kEvents);
  CHECK(decoded.stats.imu_samples == 1);
  CHECK(decoded.stats.triggers == 0);
  CHECK(decoded.stats.undefined_words == 4);
}

TEST_CASE("AEDAT 4: the header states the size, and what it does not state the packets do") {
  Aedat4Decoder decoder({100, 100});
  const Bytes header = aedat4_header(0, kXml);
  Span<const std::uint8_t> input(header);
  std::vector<Event> out(10);
  std::size_t count = 0;
  CHECK(decoder.decode(&input, out, &count) == Status::ok);
  CHECK(decoder.size().width == 346);
  CHECK(decoder.size().height == 260);
  const Bytes bare = aedat4_header(0, "") + aedat4_packet(4, aedat4_events({{1, 120, 2, 1}, {2, 99, 2, 1}}));
  const Decoded decoded = decode_whole(Aedat4Decoder({100, 100}), bare);
  CHECK(decoded.events == std::vector<Event>{{2, 99, 2, 1}});
  CHECK(decode_whole(Aedat4Decoder(), bare).events.size() == 2);
}

TEST_CASE("AEDAT 4: packets are compressed in the way that the header states") {
  Rng rng(8);
  const std::vector<Event> events = random_events(&rng, 20'000, 1'000'000'000'000, 10, 346, 260);
  const Bytes content = aedat4_events(events);
  for (const int compression : {1, 2, 3, 4}) {
    const bool is_lz4 = compression < 3;
    if (!has(is_lz4 ? Compression::lz4 : Compression::zstd)) {
      MESSAGE("skipped: built without ", is_lz4 ? "LZ4" : "Zstandard");
      continue;
    }
    const Bytes frame = is_lz4 ? lz4_frame(content) : zstd_frame(content);
    const Decoded decoded =
        decode_whole(RecordingDecoder(), aedat4_header(compression, kXml) + aedat4_packet(0, frame));
    CHECK(decoded.status == Status::ok);
    CHECK(decoded.events == events);
    const Bytes cut(frame.begin(), frame.end() - 5);
    const Decoded broken = decode_whole(RecordingDecoder(), aedat4_header(compression, kXml) + aedat4_packet(0, cut));
    CHECK(broken.status == Status::malformed_input);
    CHECK(broken.expected == "a whole compressed frame");
  }
  const Decoded unknown = decode_whole(RecordingDecoder(), aedat4_header(9, kXml) + aedat4_packet(0, content));
  CHECK(unknown.expected == "compression by LZ4, Zstandard or none");
}

TEST_CASE("AEDAT 4: content that unpacks beyond the limit is refused") {
  std::vector<std::uint8_t> out;
  CHECK(decompress(Compression::none, Bytes(11), 10, &out) != nullptr);
  if (!has(Compression::lz4) || !has(Compression::zstd)) return;
  CHECK(decompress(Compression::lz4, lz4_frame(Bytes(100'000)), 99'999, &out) != nullptr);
  CHECK(out.size() <= 99'999);
  out.clear();
  CHECK(decompress(Compression::zstd, zstd_frame(Bytes(100'000)), 99'999, &out) != nullptr);
  out.clear();
  CHECK(decompress(Compression::zstd, zstd_frame(Bytes(100'000)), 100'000, &out) == nullptr);
  CHECK(out.size() == 100'000);
}

TEST_CASE("AEDAT 4: what lies behind the last packet is passed over") {
  const Bytes packet = aedat4_packet(0, aedat4_events(kEvents));
  const std::size_t begin = aedat4_header(0, kXml).size();
  const Bytes header = aedat4_header(0, kXml, static_cast<std::int64_t>(begin + packet.size()));
  const Decoded decoded = decode_whole(RecordingDecoder(), header + packet + Bytes(100, 0xFF));
  CHECK(decoded.status == Status::ok);
  CHECK(decoded.events == kEvents);
}

TEST_CASE("AEDAT 4: a file that was cut gives its whole packets and the place") {
  const Bytes header = aedat4_header(0, kXml);
  const Bytes packet = aedat4_packet(0, aedat4_events(kEvents));
  const Bytes bytes = header + packet + packet;
  for (std::size_t size = 10; size < bytes.size(); ++size) {
    const Decoded decoded =
        decode_whole(RecordingDecoder(), Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)));
    const std::size_t packets = size < header.size() ? 0 : (size - header.size()) / packet.size();
    const bool is_whole = size >= header.size() && (size - header.size()) % packet.size() == 0;
    REQUIRE(decoded.events.size() == 2 * packets);
    REQUIRE(is_error(decoded.status) == !is_whole);
    if (!is_whole && size >= header.size()) REQUIRE(decoded.error_offset >= header.size() + packets * packet.size());
  }
}

TEST_CASE("AEDAT 4: a wrong byte anywhere is an error or another event, never more") {
  const Bytes bytes = aedat4_header(0, aedat4_xml(20, 20)) + aedat4_packet(0, aedat4_events({{1, 2, 3, 1}})) +
                      aedat4_packet(2, aedat4_content("IMUS", 1, Bytes(4)));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (const int bit : {0, 3, 7}) {
      Bytes broken = bytes;
      broken[i] = static_cast<std::uint8_t>(broken[i] ^ 1U << static_cast<unsigned>(bit));
      const Decoded decoded = decode_whole(RecordingDecoder(), broken);
      REQUIRE(decoded.events.size() <= 1);
    }
  }
}

TEST_CASE("AEDAT 4: XML that is none, or nested without end, gives no streams") {
  CHECK(read_aedat4_streams("").empty());
  CHECK(read_aedat4_streams("<node name=\"outInfo\"").empty());
  CHECK(read_aedat4_streams("</node></node><attr key=\"typeIdentifier\">EVTS</attr>").empty());
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += "<node name=\"outInfo\">";
  CHECK(read_aedat4_streams(deep).empty());
  const auto streams = read_aedat4_streams(
      "<node name=\"outInfo\"><node name=\"3\"/><node name=\"5\">"
      "<attr key=\"typeIdentifier\">EVTS</attr></node></node>");
  REQUIRE(streams.size() == 1);
  CHECK(streams.at(5).type == "EVTS");
  CHECK_FALSE(is_known(streams.at(5).size));
}

TEST_CASE("AEDAT 4: a real recording of a DAVIS346") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  if (!has(Compression::lz4)) {
    MESSAGE("skipped: built without LZ4");
    return;
  }
  const Decoded decoded =
      decode_whole(RecordingDecoder(), read_bytes(*data / "real" / "davis346_lab_aedat4" / "davis.aedat4"));
  CHECK(decoded.status == Status::ok);
  CHECK(decoded.events.size() == 117'667);  // the README beside it
  CHECK(decoded.stats.outside == 0);
  CHECK(decoded.stats.time_steps_back == 0);
  REQUIRE(decoded.imu_samples.size() == 130);
  for (std::size_t i = 0; i < decoded.imu_samples.size(); ++i) {
    const ImuSample& sample = decoded.imu_samples[i];
    const float* a = sample.accel_m_s2;
    // The camera stands upright and nearly still: what holds it points up, which is -y.
    REQUIRE(std::abs(std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) - 9.8F) < 0.3F);
    REQUIRE(a[1] < -9.5F);
    for (const float rate : sample.gyro_rad_s) REQUIRE(std::abs(rate) < 0.2F);
    REQUIRE(std::abs(sample.temperature_c - 28) < 2);
    if (i > 0) REQUIRE((sample.t_us - decoded.imu_samples[i - 1].t_us + 1) / 1000 == 1);
  }
  CHECK(decoded.triggers.size() == 15);
  const std::int64_t duration_us = decoded.events.back().t_us - decoded.events.front().t_us;
  CHECK((duration_us + 5'000) / 10'000 == 13);
}

}  // namespace
