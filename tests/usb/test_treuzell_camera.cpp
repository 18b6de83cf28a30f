// SPDX-License-Identifier: MIT
#include "lecalib/usb/treuzell_camera.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "lecalib/usb/stream_buffer.hpp"
#include "support/fake_evk4.hpp"
#include "support/scripted_bus.hpp"

using namespace lecalib;
using namespace lecalib::usb;
using namespace lecalib::test;

namespace {

using Writes = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// A bus with one fake EVK4.
struct Bench {
  ScriptedBus bus;
  FakeEvk4& fake = bus.plug_in(std::make_shared<FakeEvk4>());

  /// Bytes that the camera has sent by now.
  std::uint64_t fake_sent() {
    const std::lock_guard<std::mutex> lock(*bus.devices[0].mutex);
    return fake.stream.sent();
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
};

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::vector<std::uint8_t> numbered_words(std::size_t count) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < count; ++i) {
    bytes.push_back(static_cast<std::uint8_t>(i));
    bytes.push_back(static_cast<std::uint8_t>(i >> 8));
  }
  return bytes;
}

/// All that comes until the stream ends or nothing comes for a while.
std::vector<std::uint8_t> read_all(StreamBuffer* buffer) {
  std::vector<std::uint8_t> all;
  BufferRing::Buffer part;
  while (buffer->read(std::chrono::milliseconds(100), &part) == StreamBuffer::Wait::data) {
    all.insert(all.end(), part.bytes.begin(), part.bytes.end());
  }
  return all;
}

std::size_t index_of(const Writes& writes, std::uint32_t address, std::uint32_t value) {
  const auto at = std::find(writes.begin(), writes.end(), std::make_pair(address, value));
  REQUIRE(at != writes.end());
  return static_cast<std::size_t>(at - writes.begin());
}

}  // namespace

TEST_CASE("treuzell_camera: it says who it is, and its header makes the stream a recording") {
  Bench bench;
  const auto camera = bench.open();
  CHECK(camera->info().name == "Prophesee EVK4");
  CHECK(camera->info().serial == "00050423");
  CHECK(camera->info().firmware == "3.9.0");
  CHECK(camera->sensor().width == 1280);
  const std::string header = camera->file_header();
  CHECK(header.size() % 2 == 0);
  CHECK(has(header, "% format EVT3;height=720;width=1280\n"));
  CHECK(has(header, "% serial_number 00050423\n"));
  CHECK(header.substr(header.size() - 6) == "% end\n");
  CHECK(bench.fake.writes.empty());  // nobody asked it to start
}

TEST_CASE("treuzell_camera: what the sensor sends comes out whole, and stop ends it") {
  Bench bench;
  bench.fake.stream.recording = numbered_words(100000);
  bench.fake.stream.faults.max_transfer = 1000;
  bench.fake.stream.faults.odd_every = 3;
  const auto camera = bench.open();
  StreamBuffer buffer;
  REQUIRE(buffer.init({}) == Status::ok);
  REQUIRE_FALSE(camera->start({}, &buffer));
  CHECK(bench.fake.is_streaming());
  CHECK(bench.bus.waited_us > 2'500'000);
  CHECK(bench.bus.waited_us < 2'600'000);
  CHECK(read_all(&buffer) == bench.fake.stream.recording);
  CHECK(buffer.odd_bytes() > 0);
  CHECK(buffer.dropped() == 0);
  camera->stop();
  CHECK_FALSE(bench.fake.is_streaming());
  BufferRing::Buffer part;
  CHECK(buffer.read(std::chrono::milliseconds(1), &part) == StreamBuffer::Wait::ended);
  CHECK(buffer.why_ended() == UsbStatus::ok);
}

TEST_CASE("treuzell_camera: the sensor is stopped, destroyed, set up and started, in this order") {
  Bench bench;
  StreamBuffer buffer;
  REQUIRE(buffer.init({}) == Status::ok);
  const auto camera = bench.open();
  REQUIRE_FALSE(camera->start({}, &buffer));
  const Writes writes = bench.fake.writes;
  const std::vector<std::size_t> order = {
      index_of(writes, 0x002C, 0x0022C324), index_of(writes, 0x0070, 0x00400008), index_of(writes, 0x001C, 1),
      index_of(writes, 0x400004, 1),        index_of(writes, 0x400004, 0),        index_of(writes, 0x9000, 0x200),
      index_of(writes, 0x6000, 0x00155401), index_of(writes, 0x0004, 0xF0005062), index_of(writes, 0x002C, 0x0022C724)};
  CHECK(std::is_sorted(order.begin(), order.end()));
  CHECK(writes.back() == std::make_pair(0x0004U, 0xF0005462U));  // only its bit 10 changed
  camera->stop();
  CHECK(index_of(bench.fake.writes, 0x9028, 2) < bench.fake.writes.size());
  CHECK(bench.fake.writes.back() == std::make_pair(0xB07CU, 0U));  // the end of destroy
}

TEST_CASE("treuzell_camera: biases are offsets from what the chip has, and go back when it stops") {
  Bench bench;
  StreamBuffer buffer;
  REQUIRE(buffer.init({}) == Status::ok);
  const auto camera = bench.open();
  CameraSettings settings;
  settings.biases = {{"diff_on", 20}, {"fo", -30}};
  REQUIRE_FALSE(camera->start(settings, &buffer));
  CHECK(bench.fake.registers.at(0x1010) == 0x11A10000 + 0x66 + 20);
  CHECK(bench.fake.registers.at(0x1004) == 0x11A10000 + 0x53 - 30);
  CHECK(bench.fake.registers.at(0x1018) == 0x11A10049);
  camera->stop();
  CHECK(bench.fake.registers.at(0x1010) == 0x11A10066);
  CHECK(bench.fake.registers.at(0x1004) == 0x11A10053);
}

TEST_CASE("treuzell_camera: settings it cannot have are refused before the sensor is touched") {
  Bench bench;
  StreamBuffer buffer;
  REQUIRE(buffer.init({}) == Status::ok);
  const auto camera = bench.open();
  const auto refusal = [&](const CameraSettings& settings) {
    const auto error = camera->start(settings, &buffer);
    REQUIRE(error.has_value());
    return error->message;
  };
  CHECK(has(refusal({{{"diff_up", 1}}, {}, 0}), "diff_on"));
  CHECK(has(refusal({{{"hpf", -1}}, {}, 0}), "0 to 255"));
  CHECK(has(refusal({{{"refr", -51}}, {}, 0}), "-50"));
  CHECK(has(refusal({{}, Roi{1200, 0, 100, 10}, 0}), "1280x720"));
  CHECK(has(refusal({{}, Roi{0, 0, 0, 10}, 0}), "1280x720"));
  CHECK(has(refusal({{}, {}, 4999}), "5000"));
  CHECK(bench.fake.writes.empty());
  // The chip's own value decides as well: 0x66 + 200 does not fit into a byte.
  CHECK(has(refusal({{{"diff_on", 200}}, {}, 0}), "-102 to 153"));
}

TEST_CASE("treuzell_camera: a region of interest switches off the columns and rows outside of it") {
  Bench bench;
  StreamBuffer buffer;
  REQUIRE(buffer.init({}) == Status::ok);
  const auto camera = bench.open();
  REQUIRE_FALSE(camera->start({{}, Roi{100, 40, 64, 33}, 0}, &buffer));
  const auto is_off = [&](std::uint32_t base, std::uint32_t at) {
    return (bench.fake.registers.at(base + at / 32 * 4) >> (at % 32) & 1) != 0;
  };
  bool right = true;
  for (std::uint32_t x = 0; x < 1280; ++x) right = right && is_off(0x2000, x) == (x < 100 || x >= 164);
  for (std::uint32_t y = 0; y < 720; ++y) right = right && is_off(0x4000, y) == (y < 40 || y >= 73);
  CHECK(right);
  REQUIRE_FALSE(camera->start({}, &buffer));
  for (std::uint32_t x = 0; x < 1280; ++x) right = right && !is_off(0x2000, x);
  for (std::uint32_t y = 0; y < 720; ++y) right = right && !is_off(0x4000, y);
  CHECK(right);
}

TEST_CASE("treuzell_camera: the rate limit is events per period, and off without one") {
  Bench bench;
  StreamBuffer buffer;
  REQUIRE(buffer.init({}) == Status::ok);
  const auto camera = bench.open();
  REQUIRE_FALSE(camera->start({{}, {}, 20'000'000}, &buffer));
  const auto& registers = bench.fake.registers;
  CHECK(registers.at(0x6004) == 1);
  CHECK(registers.at(0x600C) * (1'000'000 / registers.at(0x6008)) == 20'000'000);
  CHECK(registers.at(0x6028) == 3);
  CHECK(registers.at(0x6050) == 1);
  CHECK(registers.at(0x6000) == 0x00155401);
  CHECK(registers.at(0x6800 + 4 * 229) == 0x08080808);
  CHECK(registers.at(0x6400 + 4 * 255) == ((511U << 16) | 510U));
  REQUIRE_FALSE(camera->start({}, &buffer));
  CHECK(registers.at(0x6004) == 0);
  CHECK(registers.at(0x6028) == 2);
  CHECK(registers.at(0x6050) == 0);
}

TEST_CASE("treuzell_camera: what cannot be used is refused, and the message says what to do") {
  {
    Bench bench;
    bench.fake.firmware = 0x03070A;
    CHECK(has(bench.why_not(), "firmware 3.7.10 is older than 3.8.0"));
  }
  {
    Bench bench;
    bench.fake.registers[0x0014] = 0x30501C01;
    CHECK(has(bench.why_not(), "expected an IMX636"));
  }
  {
    Bench bench;
    bench.fake.system_id = 0x30;
    CHECK(has(bench.why_not(), "Gen4.1"));
  }
  {
    Bench bench;
    bench.fake.open_status = UsbStatus::access_denied;
    CHECK(has(bench.why_not(), "70-lecalib.rules"));
  }
  {
    Bench bench;
    bench.fake.open_status = UsbStatus::busy;
    CHECK(has(bench.why_not(), "another program"));
  }
  {
    Bench bench;
    bench.fake.info.product = 0x00F3;
    CHECK(has(bench.why_not(), "no firmware"));
  }
  {
    Bench bench;
    bench.fake.plugged_in = false;
    CHECK(has(bench.why_not(), "no camera is plugged in"));
  }
}

TEST_CASE("treuzell_camera: a command that is refused or not answered ends the start with its name") {
  Bench bench;
  StreamBuffer buffer;
  REQUIRE(buffer.init({}) == Status::ok);
  {
    const auto camera = bench.open();
    bench.fake.refused_register = 0xB064;
    auto error = camera->start({}, &buffer);
    REQUIRE(error.has_value());
    CHECK(has(error->message, "register 0xB064: the camera refused (error 5)"));
    bench.fake.refused_register = 0x9028;  // also among the stop, which must not end in a stream without end
    error = camera->start({}, &buffer);
    REQUIRE(error.has_value());
    CHECK(has(error->message, "0x9028"));
    bench.fake.refused_register = 0xFFFFFFFF;
    REQUIRE_FALSE(camera->start({}, &buffer));
    bench.fake.mute_property = 0x40010102;
    error = camera->start({}, &buffer);
    REQUIRE(error.has_value());
    CHECK(has(error->message, "did not answer in time"));
  }
  bench.fake.mute_property = 0x72;
  CHECK(has(bench.why_not(), "property 0x0072: the camera did not answer in time"));
}

TEST_CASE("treuzell_camera: answers to requests that were given up are not taken for others") {
  Bench bench;
  bench.fake.answers_twice = true;
  StreamBuffer buffer;
  REQUIRE(buffer.init({}) == Status::ok);
  const auto camera = bench.open();
  CHECK(camera->info().serial == "00050423");
  CameraSettings settings;
  settings.biases = {{"diff_off", 5}};
  REQUIRE_FALSE(camera->start(settings, &buffer));
  CHECK(bench.fake.registers.at(0x1018) == 0x11A10049 + 5);
}

TEST_CASE("treuzell_camera: a reader that is too slow loses buffers, which are counted, and nothing else") {
  for (const DropPolicy policy : {DropPolicy::newest, DropPolicy::oldest}) {
    Bench bench;
    bench.fake.stream.recording = numbered_words(100000);
    bench.fake.stream.faults.max_transfer = 1000;
    StreamBuffer buffer;
    REQUIRE(buffer.init({16, 1000, policy, 2}) == Status::ok);
    const auto camera = bench.open();
    REQUIRE_FALSE(camera->start({}, &buffer));
    while (bench.fake_sent() < bench.fake.stream.recording.size()) std::this_thread::yield();
    camera->stop();
    const std::vector<std::uint8_t>& all = bench.fake.stream.recording;
    const auto kept = std::ptrdiff_t{16 * 1000};
    const bool oldest = policy == DropPolicy::oldest;
    const std::vector<std::uint8_t> expected(oldest ? all.end() - kept : all.begin(),
                                             oldest ? all.end() : all.begin() + kept);
    CHECK(read_all(&buffer) == expected);
    CHECK(buffer.dropped() == all.size() / 1000 - 16);
  }
}

TEST_CASE("treuzell_camera: unplugged while it starts it says so, and nothing is left running") {
  Bench bench;
  bench.fake.unplugging_register = 0x7008;
  StreamBuffer buffer;
  REQUIRE(buffer.init({}) == Status::ok);
  const auto camera = bench.open();
  const auto error = camera->start({}, &buffer);
  REQUIRE(error.has_value());
  CHECK(error->message == "register 0x7008: the camera was unplugged");
  camera->stop();
}

TEST_CASE("treuzell_camera: unplugged and plugged in again it starts anew") {
  Bench bench;
  bench.fake.stream.recording = numbered_words(5000);
  bench.fake.stream.faults.unplug_at = 4000;
  StreamBuffer buffer;
  REQUIRE(buffer.init({}) == Status::ok);
  std::vector<std::uint8_t> all;
  {
    const auto camera = bench.open();
    REQUIRE_FALSE(camera->start({}, &buffer));
    all = read_all(&buffer);
    CHECK(buffer.why_ended() == UsbStatus::no_device);
    CHECK(has(bench.why_not(), "no camera is plugged in"));
    camera->stop();
  }
  bench.fake.replug();
  const auto camera = bench.open();
  REQUIRE(buffer.init({}) == Status::ok);
  REQUIRE_FALSE(camera->start({}, &buffer));
  const std::vector<std::uint8_t> rest = read_all(&buffer);
  all.insert(all.end(), rest.begin(), rest.end());
  CHECK(all == bench.fake.stream.recording);
}

TEST_CASE("camera: of two, one is chosen by its serial number") {
  ScriptedBus bus;
  bus.plug_in(std::make_shared<FakeEvk4>());
  FakeEvk4& second = bus.plug_in(std::make_shared<FakeEvk4>());
  second.info.address = 3;
  second.serial = 0xABCD;
  const auto unclear = open_camera(&bus, "");
  REQUIRE_FALSE(unclear.ok());
  CHECK(has(unclear.error().message, "--serial: there are 00050423, 0000abcd"));
  const auto chosen = open_camera(&bus, "0000ABCD");
  REQUIRE(chosen.ok());
  CHECK(chosen.value()->info().device.address == 3);
  const auto unknown = open_camera(&bus, "1");
  REQUIRE_FALSE(unknown.ok());
  CHECK(has(unknown.error().message, "no camera has the serial number 1"));

  second.open_status = UsbStatus::access_denied;
  const auto listed = list_cameras(&bus);
  REQUIRE(listed.ok());
  REQUIRE(listed.value().size() == 2);
  CHECK(listed.value()[0].problem == "");
  CHECK(listed.value()[0].firmware == "3.9.0");
  CHECK(listed.value()[1].serial == "");
  CHECK(has(listed.value()[1].problem, "no permission"));
}

TEST_CASE("camera: devices that are no cameras are left alone") {
  ScriptedBus bus;
  FakeEvk4& other = bus.plug_in(std::make_shared<FakeEvk4>());
  other.info.vendor = 0x1234;
  const auto listed = list_cameras(&bus);
  REQUIRE(listed.ok());
  CHECK(listed.value().empty());
}
