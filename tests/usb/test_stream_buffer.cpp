// SPDX-License-Identifier: MIT
#include "lecalib/usb/stream_buffer.hpp"

#include <doctest/doctest.h>

#include <thread>
#include <vector>

using namespace lecalib;
using namespace lecalib::usb;
using std::chrono::milliseconds;

TEST_CASE("stream_buffer: a reader gets what was sent, is told when nothing comes, and at the end why") {
  StreamBuffer buffer;
  REQUIRE(buffer.init({4, 16, DropPolicy::newest, 2}) == Status::ok);
  BufferRing::Buffer out;
  CHECK(buffer.read(milliseconds(1), &out) == StreamBuffer::Wait::nothing);
  const std::vector<std::uint8_t> bytes = {1, 2, 3, 4};
  buffer.take(bytes);
  buffer.end(UsbStatus::no_device);
  REQUIRE(buffer.read(milliseconds(1), &out) == StreamBuffer::Wait::data);
  CHECK(out.bytes.size() == 4);
  CHECK(out.bytes[3] == 4);
  CHECK(buffer.read(milliseconds(1), &out) == StreamBuffer::Wait::ended);
  CHECK(buffer.why_ended() == UsbStatus::no_device);
}

TEST_CASE("stream_buffer: bytes beyond whole words are left out and counted") {
  StreamBuffer buffer;
  REQUIRE(buffer.init({4, 16, DropPolicy::newest, 2}) == Status::ok);
  const std::vector<std::uint8_t> bytes = {1, 2, 3};
  buffer.take(bytes);
  buffer.take(Span<const std::uint8_t>(bytes.data(), 1));
  BufferRing::Buffer out;
  REQUIRE(buffer.read(milliseconds(1), &out) == StreamBuffer::Wait::data);
  CHECK(out.bytes.size() == 2);
  CHECK(buffer.odd_bytes() == 2);
  CHECK(buffer.init({4, 15, DropPolicy::newest, 2}) == Status::invalid_argument);
  CHECK(buffer.init({4, 16, DropPolicy::newest, 0}) == Status::invalid_argument);
}

TEST_CASE("stream_buffer: a sleeping reader is woken by data and by the end, and misses neither") {
  for (int round = 0; round < 200; ++round) {
    StreamBuffer buffer;
    REQUIRE(buffer.init({16, 16, DropPolicy::newest, 2}) == Status::ok);
    std::thread writer([&] {
      const std::vector<std::uint8_t> bytes(6, 1);
      for (int i = 0; i < 10; ++i) buffer.take(bytes);
      buffer.end(UsbStatus::ok);
    });
    std::size_t count = 0;
    BufferRing::Buffer out;
    StreamBuffer::Wait wait = StreamBuffer::Wait::data;
    while ((wait = buffer.read(milliseconds(5000), &out)) == StreamBuffer::Wait::data) count += out.bytes.size();
    writer.join();
    REQUIRE(wait == StreamBuffer::Wait::ended);
    REQUIRE(count == 60);
  }
}
