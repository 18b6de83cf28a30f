// SPDX-License-Identifier: MIT
#include "lecalib/events/event_ring.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

using namespace lecalib;

namespace {

/// An event whose fields all follow from its number.
Event numbered(std::uint64_t n) {
  return {static_cast<std::int64_t>(n << 20 | (n & 0xFFFFF)), static_cast<std::uint16_t>(n * 7),
          static_cast<std::uint16_t>(n * 13), static_cast<std::uint8_t>(n & 1)};
}

bool is_numbered(const Event& event, std::uint64_t n) {
  const Event expected = numbered(n);
  return event.t_us == expected.t_us && event.x == expected.x && event.y == expected.y &&
         event.polarity == expected.polarity;
}

/// A writer that never waits against a reader that stalls now and then. Every event is whole, in order, and taken or
/// counted.
void race(DropPolicy policy, std::size_t slots, std::size_t piece) {
  constexpr std::uint64_t kEvents = 200000;
  std::vector<EventSlot> storage(slots);
  EventRing ring;
  REQUIRE(ring.init(storage, policy) == Status::ok);
  std::atomic<bool> done{false};
  std::uint64_t accepted = 0;
  std::thread writer([&] {
    for (std::uint64_t n = 0; n < kEvents; ++n) accepted += ring.push(numbered(n)) ? 1U : 0U;
    done = true;
  });
  std::vector<Event> out(piece);
  std::uint64_t taken = 0;
  std::uint64_t next = 0;
  bool is_whole = true;
  bool last_round = false;
  for (int turn = 0;; ++turn) {
    const std::size_t count = ring.pop(out);
    for (std::size_t i = 0; i < count; ++i) {
      const auto n = static_cast<std::uint64_t>(out[i].t_us) >> 20;
      is_whole = is_whole && n >= next && is_numbered(out[i], n);
      next = n + 1;
    }
    taken += count;
    if (count == 0 && last_round) break;
    if (count == 0) last_round = done;
    if (turn % 64 == 0) std::this_thread::yield();
  }
  writer.join();
  CHECK(is_whole);
  CHECK(taken + ring.dropped() == kEvents);
  CHECK(taken > 0);
  CHECK(accepted == (policy == DropPolicy::newest ? taken : kEvents));
}

}  // namespace

TEST_CASE("event ring: gives what was pushed, in order, across the storage's end") {
  for (const DropPolicy policy : {DropPolicy::newest, DropPolicy::oldest}) {
    EventSlot storage[8];
    EventRing ring;
    REQUIRE(ring.init(storage, policy) == Status::ok);
    Event out[5];
    CHECK(ring.pop(out) == 0);
    std::uint64_t pushed = 0;
    std::uint64_t next = 0;
    for (int round = 0; round < 40; ++round) {
      for (int i = 0; i < 1 + round % 5; ++i) CHECK(ring.push(numbered(pushed++)));
      const std::size_t count = ring.pop(out);
      REQUIRE(count == pushed - next);
      for (std::size_t i = 0; i < count; ++i) CHECK(is_numbered(out[i], next++));
    }
    CHECK(ring.dropped() == 0);
  }
}

TEST_CASE("event ring: with a reader that stalls the newest events are dropped, or the oldest, and counted") {
  EventSlot storage[8];
  EventRing ring;
  std::vector<Event> out(20);
  REQUIRE(ring.init(storage, DropPolicy::newest) == Status::ok);
  for (std::uint64_t n = 0; n < 20; ++n) CHECK(ring.push(numbered(n)) == (n < 8));
  CHECK(ring.pop(out) == 8);
  CHECK(is_numbered(out[0], 0));
  CHECK(is_numbered(out[7], 7));
  CHECK(ring.dropped() == 12);
  CHECK(ring.push(numbered(20)));
  CHECK(ring.pop(out) == 1);

  REQUIRE(ring.init(storage, DropPolicy::oldest) == Status::ok);
  CHECK(ring.dropped() == 0);
  for (std::uint64_t n = 0; n < 20; ++n) CHECK(ring.push(numbered(n)));
  CHECK(ring.pop(out) == 7);
  CHECK(is_numbered(out[0], 13));
  CHECK(is_numbered(out[6], 19));
  CHECK(ring.dropped() == 13);
}

TEST_CASE("event ring: storage must be a power of two") {
  std::vector<EventSlot> storage(9);
  EventRing ring;
  for (const std::size_t size : {0U, 1U, 3U, 6U, 9U}) {
    CHECK(ring.init({storage.data(), size}, DropPolicy::newest) == Status::invalid_argument);
  }
  for (const std::size_t size : {2U, 4U, 8U})
    CHECK(ring.init({storage.data(), size}, DropPolicy::oldest) == Status::ok);
}

TEST_CASE("event ring: events stay whole and are counted against a writer that never waits") {
  for (const std::size_t slots : {2U, 16U, 1024U}) {
    for (const std::size_t piece : {1U, 7U, 64U}) {
      race(DropPolicy::newest, slots, piece);
      race(DropPolicy::oldest, slots, piece);
    }
  }
}
