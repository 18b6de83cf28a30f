// SPDX-License-Identifier: MIT
#include "support/scripted_bus.hpp"

#include <doctest/doctest.h>

#include <memory>
#include <vector>

#include "lecalib/usb/stream_buffer.hpp"
#include "support/fake_evk4.hpp"

using namespace lecalib;
using namespace lecalib::usb;
using namespace lecalib::test;

namespace {

/// Register writes that make the camera send, as raw frames.
void let_run(Transport* transport) {
  const auto set = [&](std::uint32_t address, std::uint32_t value) {
    std::vector<std::uint8_t> bytes = {2, 1, 1, 0x40, 12, 0, 0, 0, 0, 0, 0, 0};
    for (const std::uint32_t word : {address, value}) {
      for (unsigned i = 0; i < 4; ++i) bytes.push_back(static_cast<std::uint8_t>(word >> (8 * i)));
    }
    REQUIRE(transport->write(0x02, bytes) == UsbStatus::ok);
  };
  set(0xB000, 0x2F9);
  set(0x9028, 0);
  set(0x9008, 0x645);
  set(0x0004, 0xF0005442);
}

}  // namespace

TEST_CASE("scripted_bus: a fake camera sends its recording once its registers say so, and is gone when unplugged") {
  ScriptedBus bus;
  FakeEvk4& camera = bus.plug_in(std::make_shared<FakeEvk4>());
  camera.stream.recording.assign(1000, 7);
  camera.stream.faults.max_transfer = 64;
  camera.stream.faults.unplug_at = 600;
  std::vector<DeviceInfo> devices;
  REQUIRE(bus.list(&devices) == UsbStatus::ok);
  REQUIRE(devices.size() == 1);
  std::unique_ptr<Transport> transport;
  REQUIRE(bus.open(devices[0], &transport) == UsbStatus::ok);

  StreamBuffer buffer;
  REQUIRE(buffer.init({}) == Status::ok);
  REQUIRE(transport->start_stream({}, &buffer) == UsbStatus::ok);
  BufferRing::Buffer out;
  CHECK(buffer.read(std::chrono::milliseconds(5), &out) == StreamBuffer::Wait::nothing);
  let_run(transport.get());
  std::size_t count = 0;
  StreamBuffer::Wait wait = StreamBuffer::Wait::data;
  while ((wait = buffer.read(std::chrono::seconds(5), &out)) == StreamBuffer::Wait::data) count += out.bytes.size();
  CHECK(wait == StreamBuffer::Wait::ended);
  CHECK(buffer.why_ended() == UsbStatus::no_device);
  CHECK(count == 600);
  REQUIRE(bus.list(&devices) == UsbStatus::ok);
  CHECK(devices.empty());
}
