// SPDX-License-Identifier: MIT
/// Hands events from a sensor's interrupt, or another thread, to the one that calibrates. Neither side ever waits: when
/// the reader stalls, events are dropped by a policy and counted.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "lecalib/core/records.hpp"
#include "lecalib/core/status.hpp"

namespace lecalib {

enum class DropPolicy : std::uint8_t {
  newest,  ///< what comes while the ring is full is dropped: what was recorded first stays
  oldest,  ///< what comes replaces the oldest: the reader goes on with what happens at the moment
};

/// Room for one event, in words that every processor reads and writes whole.
struct EventSlot {
  std::uint32_t words[4];
};

/// For one writer and one reader, without locks. Holds storage.size() events, by DropPolicy::oldest one less.
class EventRing {
 public:
  /// Empties the ring; before the writer starts. @param storage must outlive the ring
  /// @return ok | invalid_argument (its size is no power of two, or below 2, or above 2^30)
  Status init(Span<EventSlot> storage, DropPolicy policy) noexcept;

  /// The writer's; a few dozen instructions. @return false: dropped (DropPolicy::newest)
  bool push(const Event& event) noexcept;

  /// The reader's: takes the oldest events. @return how many were written to the front of `out`; 0: there are none
  std::size_t pop(Span<Event> out) noexcept;

  /// The reader's: events that were pushed and are lost, as of the last pop(); one beyond 2^32 lost between two is not
  /// counted.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

 private:
  void write(std::uint32_t index, const Event& event) noexcept;
  [[nodiscard]] Event read(std::uint32_t index) const noexcept;
  std::uint32_t skip_lost(std::uint32_t begin) noexcept;

  Span<EventSlot> slots_;
  DropPolicy policy_ = DropPolicy::newest;
  // Positions count events from init() on, modulo 2^32.
  std::atomic<std::uint32_t> head_{0};     ///< the next event to be written; the writer's
  std::atomic<std::uint32_t> tail_{0};     ///< the next event to be read; the reader's
  std::atomic<std::uint32_t> refused_{0};  ///< events that found the ring full; the writer's
  std::uint32_t refused_seen_ = 0;         ///< of these, in dropped_
  std::uint64_t dropped_ = 0;
};

}  // namespace lecalib
