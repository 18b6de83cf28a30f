// SPDX-License-Identifier: MIT
#include "lecalib/usb/buffer_ring.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <deque>
#include <thread>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "support/alloc_counter.hpp"

using namespace lecalib;
using namespace lecalib::usb;
using lecalib::test::AllocScope;

namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes numbered(std::size_t number, std::size_t size) { return Bytes(size, static_cast<std::uint8_t>(number)); }

bool equal(Span<const std::uint8_t> bytes, const Bytes& expected) {
  return Bytes(bytes.begin(), bytes.end()) == expected;
}

}  // namespace

TEST_CASE("buffer_ring: sizes that it cannot have are refused") {
  BufferRing ring;
  for (const std::size_t places : {0U, 1U, 3U, 1000U, 1U << 15}) {
    CHECK(ring.init(places, 16, DropPolicy::newest) == Status::invalid_argument);
  }
  CHECK(ring.init(4, 0, DropPolicy::newest) == Status::invalid_argument);
  CHECK(ring.init(2, 1, DropPolicy::newest) == Status::ok);
  CHECK(ring.init(1U << 14, 1, DropPolicy::oldest) == Status::ok);
}

TEST_CASE("buffer_ring: buffers come out as they went in, any number of times around, and without allocating") {
  BufferRing ring;
  REQUIRE(ring.init(4, 8, DropPolicy::newest) == Status::ok);
  BufferRing::Buffer buffer;
  CHECK_FALSE(ring.pop(&buffer));
  std::size_t in = 0;
  std::size_t out = 0;
  bool same = true;
  for (int round = 0; round < 50; ++round) {
    for (int i = 0; i < 1 + round % 4; ++i, ++in) same = ring.push(numbered(in, 1 + in % 8)) && same;
    while (ring.pop(&buffer)) {
      same = same && equal(buffer.bytes, numbered(out, 1 + out % 8)) && buffer.lost_before == 0;
      ++out;
    }
  }
  CHECK(same);
  CHECK(out == in);
  CHECK(ring.dropped() == 0);
  const Bytes bytes(8, 1);
  const AllocScope heap;
  (void)ring.push(bytes);
  (void)ring.pop(&buffer);
  const std::size_t allocations = heap.allocations();
  CHECK(allocations == 0);
}

TEST_CASE("buffer_ring: a full ring keeps what came first, or what came last, and counts the rest") {
  for (const DropPolicy policy : {DropPolicy::newest, DropPolicy::oldest}) {
    BufferRing ring;
    REQUIRE(ring.init(4, 8, policy) == Status::ok);
    for (std::size_t i = 0; i < 4; ++i) CHECK(ring.push(numbered(i, 3)));
    CHECK(ring.dropped() == 0);
    CHECK(ring.push(numbered(4, 3)) == (policy == DropPolicy::oldest));
    CHECK(ring.push(numbered(5, 3)) == (policy == DropPolicy::oldest));
    CHECK(ring.dropped() == 2);
    CHECK(ring.waiting() == 4);
    BufferRing::Buffer buffer;
    const std::size_t first = policy == DropPolicy::newest ? 0 : 2;
    for (std::size_t i = first; i < first + 4; ++i) {
      REQUIRE(ring.pop(&buffer));
      CHECK(equal(buffer.bytes, numbered(i, 3)));
      CHECK(buffer.lost_before == (policy == DropPolicy::oldest && i == first ? 2 : 0));
      CHECK(ring.waiting() == first + 3 - i);
    }
    CHECK_FALSE(ring.pop(&buffer));
    CHECK(ring.push(numbered(9, 3)));
    REQUIRE(ring.pop(&buffer));
    CHECK(buffer.lost_before == (policy == DropPolicy::newest ? 2 : 0));
    CHECK(ring.dropped() == 2);
  }
}

TEST_CASE("buffer_ring: what is held stays as it is while the writer goes around") {
  BufferRing ring;
  REQUIRE(ring.init(2, 4, DropPolicy::oldest) == Status::ok);
  CHECK(ring.push(numbered(7, 4)));
  BufferRing::Buffer held;
  REQUIRE(ring.pop(&held));
  for (std::size_t i = 0; i < 20; ++i) CHECK(ring.push(numbered(100 + i, 4)));
  CHECK(equal(held.bytes, numbered(7, 4)));
}

TEST_CASE("buffer_ring: more bytes than a buffer holds take several") {
  BufferRing ring;
  REQUIRE(ring.init(4, 4, DropPolicy::newest) == Status::ok);
  const Bytes bytes = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  CHECK(ring.push(bytes));
  BufferRing::Buffer buffer;
  Bytes all;
  while (ring.pop(&buffer)) all.insert(all.end(), buffer.bytes.begin(), buffer.bytes.end());
  CHECK(all == bytes);
  CHECK(ring.push({}));
  CHECK_FALSE(ring.pop(&buffer));
}

TEST_CASE("buffer_ring: any order of pushing and taking does what a queue with a limit does") {
  for (const DropPolicy policy : {DropPolicy::newest, DropPolicy::oldest}) {
    BufferRing ring;
    REQUIRE(ring.init(8, 4, policy) == Status::ok);
    Rng rng(5);
    std::deque<std::size_t> queue;
    std::uint64_t dropped = 0;
    bool same = true;
    BufferRing::Buffer buffer;
    for (std::size_t i = 0; i < 20000; ++i) {
      if (rng.uniform() < 0.52) {
        (void)ring.push(numbered(i, 2));
        if (queue.size() < 8 || policy == DropPolicy::oldest) queue.push_back(i);
        if (queue.size() > 8) queue.pop_front();
      } else if (ring.pop(&buffer)) {
        same = same && !queue.empty() && equal(buffer.bytes, numbered(queue.front(), 2));
        if (!queue.empty()) queue.pop_front();
        dropped += buffer.lost_before;
      } else {
        same = same && queue.empty();
      }
    }
    CHECK(same);
    CHECK(dropped > 0);
    while (ring.pop(&buffer)) dropped += buffer.lost_before;
    (void)ring.push(numbered(0, 1));
    REQUIRE(ring.pop(&buffer));
    CHECK(dropped + buffer.lost_before == ring.dropped());
  }
}

TEST_CASE("buffer_ring: between two threads each buffer is whole, in order, and given or counted") {
  constexpr std::uint32_t kBuffers = 200000;
  for (const DropPolicy policy : {DropPolicy::newest, DropPolicy::oldest}) {
    BufferRing ring;
    REQUIRE(ring.init(8, 64, policy) == Status::ok);
    std::atomic<bool> done{false};
    std::thread writer([&] {
      for (std::uint32_t i = 0; i < kBuffers; ++i) (void)ring.push(numbered(i, 1 + i % 64));
      done = true;
    });
    std::uint64_t position = 0;
    std::uint64_t given = 0;
    std::uint64_t broken = 0;
    BufferRing::Buffer buffer;
    while (true) {
      const bool last = done;
      if (!ring.pop(&buffer)) {
        if (last) break;
        std::this_thread::yield();
        continue;
      }
      position += buffer.lost_before;
      if (!equal(buffer.bytes, numbered(position, 1 + position % 64))) ++broken;
      ++position;
      ++given;
    }
    writer.join();
    CHECK(broken == 0);
    CHECK(given + ring.dropped() == kBuffers);
    CHECK(given > 0);
  }
}
