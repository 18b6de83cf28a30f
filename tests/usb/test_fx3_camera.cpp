// SPDX-License-Identifier: MIT
#include "lecalib/usb/fx3_camera.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "lecalib/events/event_stream.hpp"
#include "lecalib/usb/stream_buffer.hpp"
#include "support/decode_pieces.hpp"
#include "support/fake_fx3.hpp"
#include "support/inivation_encoder.hpp"
#include "support/random_events.hpp"
#include "support/scripted_bus.hpp"

using namespace lecalib;
using namespace lecalib::usb;
using namespace lecalib::test;

namespace {

using Kind = FakeFx3::Kind;

/// A bus with one fake camera.
struct Bench {
  explicit Bench(Kind kind = Kind::davis346) : fake(bus.plug_in(std::make_shared<FakeFx3>(kind))) {
    REQUIRE(buffer.init({}) == Status::ok);
  }

  std::unique_ptr<usb::Camera> open() {
    auto opened = open_camera(&bus, "");
    REQUIRE_MESSAGE(opened.ok(), (opened.ok() ? "" : opened.error().message));
    return std::move(opened).value();
  }
  std::string why_not() {
    auto opened = open_camera(&bus, "");
    return opened.ok() ? "" : opened.error().message;
  }
  std::string why_no_start(const CameraSettings& settings = {}) {
    const auto error = open()->start(settings, &buffer);
    return error ? error->message : "";
  }
  /// Events of the recording that the camera makes until its stream ends or nothing comes for a while.
  Decoded record(usb::Camera* camera) {
    const std::string header = camera->file_header();
    Bytes all(header.begin(), header.end());
    BufferRing::Buffer part;
    while ((last_wait = buffer.read(std::chrono::milliseconds(100), &part)) == StreamBuffer::Wait::data) {
      all.insert(all.end(), part.bytes.begin(), part.bytes.end());
    }
    return decode_whole(EventStreamDecoder(), all, 1000);
  }
  [[nodiscard]] bool wrote(FakeFx3::Parameter parameter, std::uint32_t value) const {
    return std::find(fake.writes.begin(), fake.writes.end(), std::make_pair(parameter, value)) != fake.writes.end();
  }

  ScriptedBus bus;
  FakeFx3& fake;
  StreamBuffer buffer;
  StreamBuffer::Wait last_wait = StreamBuffer::Wait::nothing;
};

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::vector<Event> some_events(std::uint16_t width, std::uint16_t height, std::size_t count = 30'000) {
  Rng rng(31);
  return random_events(&rng, count, 70, 300, width, height);
}

}  // namespace

TEST_CASE("fx3_camera: it says who it is, and its header makes the stream a recording") {
  Bench bench;
  const auto camera = bench.open();
  CHECK(camera->info().name == "iniVation DAVIS346");
  CHECK(camera->info().serial == "00000104");
  CHECK(camera->info().firmware == "9, logic 18.4");
  CHECK(camera->sensor().width == 346);
  const std::string header = camera->file_header();
  CHECK(header.size() % 2 == 0);
  CHECK(has(header, "% format EVT3;height=260;width=346\n"));
  CHECK(has(header, "% sensor_name DAVIS346\n"));
  CHECK(bench.fake.writes.empty());  // nobody asked it to start

  Bench other(Kind::dvxplorer);
  other.fake.info.serial.clear();
  CHECK(other.open()->info().name == "iniVation DVXplorer");
  CHECK(other.open()->info().serial == "00000000");
  CHECK(other.open()->sensor().height == 480);
}

TEST_CASE("fx3_camera: the events that a DAVIS346 sends come out as EVT3, and stop ends it") {
  Bench bench;
  const std::vector<Event> events = some_events(346, 260);
  bench.fake.stream.recording = encode_davis_usb(events);
  bench.fake.stream.faults.max_transfer = 1000;
  bench.fake.stream.faults.odd_every = 3;
  const auto camera = bench.open();
  REQUIRE_FALSE(camera->start({}, &bench.buffer));
  CHECK(bench.fake.is_streaming());
  CHECK(bench.bus.waited_us > 300'000);
  CHECK(bench.record(camera.get()).events == events);
  CHECK(bench.buffer.odd_bytes() > 0);
  CHECK(bench.buffer.dropped() == 0);
  camera->stop();
  CHECK_FALSE(bench.fake.is_streaming());
  (void)bench.record(camera.get());
  CHECK(bench.last_wait == StreamBuffer::Wait::ended);
  CHECK(bench.buffer.why_ended() == UsbStatus::ok);
}

TEST_CASE("fx3_camera: the events that a DVXplorer sends come out as EVT3") {
  Bench bench(Kind::dvxplorer);
  const std::vector<Event> events = some_events(640, 480);
  bench.fake.stream.recording = encode_dvxplorer_usb(events);
  const auto camera = bench.open();
  REQUIRE_FALSE(camera->start({}, &bench.buffer));
  CHECK(bench.record(camera.get()).events == events);
  camera->stop();
  CHECK_FALSE(bench.fake.is_streaming());
  CHECK(bench.wrote({5, 0x3000}, 0));
}

TEST_CASE("fx3_camera: everything is off, set up and switched on, in this order; frames and the IMU stay off") {
  Bench bench;
  const auto camera = bench.open();
  REQUIRE_FALSE(camera->start({}, &bench.buffer));
  const auto index = [&](FakeFx3::Parameter parameter, std::uint32_t value) {
    const auto& writes = bench.fake.writes;
    const auto at = std::find(writes.begin(), writes.end(), std::make_pair(parameter, value));
    REQUIRE(at != writes.end());
    return at - writes.begin();
  };
  const std::vector<std::ptrdiff_t> order = {
      index({1, 3}, 0), index({0, 3}, 0), index({5, 8}, 0x5A4F), index({1, 31}, 0), index({5, 35}, 0x8410),
      index({0, 3}, 1), index({9, 0}, 1), index({0, 1}, 1),      index({0, 0}, 1),  index({1, 3}, 1)};
  CHECK(std::is_sorted(order.begin(), order.end()));
  CHECK(bench.fake.writes.back() == std::make_pair(FakeFx3::Parameter{1, 3}, 1U));
  CHECK(bench.wrote({9, 1}, 1000 * 84 * 990 / 1000));
  for (const FakeFx3::Parameter& run : {FakeFx3::Parameter{2, 4}, {3, 2}, {3, 3}, {3, 4}})
    CHECK_FALSE(bench.wrote(run, 1));
}

TEST_CASE("fx3_camera: exchanged axes turn sensor, events and region of interest") {
  Bench bench;
  bench.fake.swaps_axes = true;
  bench.fake.stream.recording = usb_time(0, 5) + usb_word(1, 7) + usb_word(3, 300);
  const auto camera = bench.open();
  CHECK(camera->sensor().width == 260);
  CHECK(camera->sensor().height == 346);
  CameraSettings settings;
  settings.roi = Roi{5, 200, 100, 146};
  REQUIRE_FALSE(camera->start(settings, &bench.buffer));
  CHECK(bench.record(camera.get()).events == std::vector<Event>{{5, 7, 300, 1}});
  CHECK(bench.wrote({1, 41}, 200));
  CHECK(bench.wrote({1, 42}, 5));
  CHECK(bench.wrote({1, 43}, 345));
  CHECK(bench.wrote({1, 44}, 104));
}

TEST_CASE("fx3_camera: firmware and logic that are too old, too new or of another sensor are refused") {
  {
    Bench bench;
    bench.fake.info.release = 0x0005;
    CHECK(has(bench.why_not(), "its firmware 5 is older than 6: update it with its maker's tool"));
  }
  {
    Bench bench(Kind::dvxplorer);
    bench.fake.info.release = 0x0007;
    CHECK(has(bench.why_not(), "its firmware 7 is older than 8"));
  }
  const auto why_not = [](std::uint32_t logic, std::uint32_t patch) {
    Bench bench;
    bench.fake.logic = logic;
    bench.fake.logic_patch = patch;
    return bench.why_not();
  };
  CHECK(has(why_not(17, 9), "its logic 17.9 is older than 18.1: update it"));
  CHECK(has(why_not(18, 0), "its logic 18.0 is older than 18.1: update it"));
  CHECK(has(why_not(19, 0), "its logic 19.0 is newer than what is known here, 18.1"));
  CHECK(why_not(18, 1).empty());
  Bench bench;
  (void)bench.open();
  bench.fake.parameters[{1, 0}] = 240;
  CHECK(has(bench.why_not(), "its sensor has 240x260 px, expected 346x260"));
}

TEST_CASE("fx3_camera: settings that it does not have are refused before it is touched") {
  const auto refusal = [](Kind kind, const CameraSettings& settings) {
    Bench bench(kind);
    const std::string why = bench.why_no_start(settings);
    CHECK(bench.fake.writes.empty());
    return why;
  };
  CameraSettings biases, rate, roi, far;
  biases.biases = {{"diff_on", 3}};
  rate.max_events_per_s = 1'000'000;
  roi.roi = Roi{0, 0, 10, 10};
  far.roi = Roi{300, 0, 47, 10};
  CHECK(has(refusal(Kind::davis346, biases), "biases of this camera cannot be changed"));
  CHECK(has(refusal(Kind::davis346, rate), "no limit of its own"));
  CHECK(has(refusal(Kind::dvxplorer, roi), "region of interest of this camera cannot be set"));
  CHECK(has(refusal(Kind::davis346, far), "leaves the sensor of 346x260 px"));
}

TEST_CASE("fx3_camera: a parameter that is refused or answered too short is named, and nothing runs on") {
  {
    Bench bench;
    bench.fake.refused = {5, 24};
    CHECK(has(bench.why_no_start(), "parameter 5.24: the camera refused"));
    CHECK_FALSE(bench.fake.is_streaming());
  }
  {
    Bench bench;
    bench.fake.refused = {1, 4};  // after the stream was begun
    CHECK(has(bench.why_no_start(), "parameter 1.4: the camera refused"));
    CHECK(bench.fake.parameters[{0, 0}] == 0);
  }
  {
    Bench bench;
    bench.fake.refused = {6, 0};
    CHECK(has(bench.why_not(), "parameter 6.0: the camera does not know it"));
  }
  Bench bench;
  bench.fake.short_answer = {6, 7};
  CHECK(has(bench.why_not(), "parameter 6.7: the camera's answer is too short"));
}

TEST_CASE("fx3_camera: a stream that stalls for good or is unplugged ends with why, and gives what came before") {
  const std::vector<Event> events = some_events(346, 260);
  const Bytes bytes = encode_davis_usb(events);
  for (const bool is_unplugged : {false, true}) {
    Bench bench;
    bench.fake.stream.recording = bytes;
    (is_unplugged ? bench.fake.stream.faults.unplug_at : bench.fake.stream.faults.stall_at) = 20'000;
    const auto camera = bench.open();
    REQUIRE_FALSE(camera->start({}, &bench.buffer));
    const Decoded before = bench.record(camera.get());
    CHECK(bench.last_wait == StreamBuffer::Wait::ended);
    CHECK(bench.buffer.why_ended() == (is_unplugged ? UsbStatus::no_device : UsbStatus::stall));
    CHECK(before.events.size() > 4000);
    CHECK(std::equal(before.events.begin(), before.events.end(), events.begin()));
    camera->stop();
    if (!is_unplugged) continue;
    CHECK(has(bench.why_not(), "no camera is plugged in"));
    bench.fake.replug();
    const auto again = bench.open();
    REQUIRE(bench.buffer.init({}) == Status::ok);
    REQUIRE_FALSE(again->start({}, &bench.buffer));
    CHECK(bench.record(again.get()).events.size() > 5000);
  }
}

TEST_CASE("fx3_camera: garbage from the camera makes no event off the sensor, and ends nothing") {
  Bench bench;
  Rng rng(32);
  for (int i = 0; i < 200'000; ++i) bench.fake.stream.recording.push_back(static_cast<std::uint8_t>(rng.next()));
  const auto camera = bench.open();
  REQUIRE_FALSE(camera->start({}, &bench.buffer));
  const Decoded decoded = bench.record(camera.get());
  CHECK(decoded.status == Status::ok);
  CHECK(decoded.stats.outside == 0);
  CHECK(bench.last_wait == StreamBuffer::Wait::nothing);
}

TEST_CASE("fx3_camera: two cameras of different makers are told apart by their serial numbers") {
  Bench bench;
  FakeFx3& other = bench.bus.plug_in(std::make_shared<FakeFx3>(Kind::dvxplorer));
  other.info.address = 9;
  other.info.serial = "DXA00042";
  const auto opened = open_camera(&bench.bus, "dxa00042");
  REQUIRE(opened.ok());
  CHECK(opened.value()->info().name == "iniVation DVXplorer");
  const auto none = open_camera(&bench.bus, "");
  REQUIRE_FALSE(none.ok());
  CHECK(has(none.error().message, "00000104, DXA00042"));
}
