// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "lecalib/core/span.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/events/event_ring.hpp"

namespace lecalib::usb {

/// Hands buffers of bytes from one thread to another without locks and without either ever waiting.
///
/// A place of the ring holds the number of a buffer; the writer and the reader each hold one more. To push or to take
/// is to swap one's own buffer for that of a place, in one atomic step: nobody ever sees a buffer that another one
/// writes to, also when the writer takes back the oldest one that was not read.
class BufferRing {
 public:
  /// What the reader holds until its next pop().
  struct Buffer {
    Span<const std::uint8_t> bytes;
    std::uint64_t lost_before = 0;  ///< buffers lost between the last one and this
  };

  /// Before both sides start. Allocates; memory of places that are never used is never touched.
  /// @param places a power of two, 2 to 2^14  @param buffer_bytes > 0, of the largest buffer
  /// @return ok | invalid_argument
  Status init(std::size_t places, std::size_t buffer_bytes, DropPolicy policy);

  /// The writer's: copies bytes into the ring. What is longer than a buffer takes several.
  /// @return false: some were dropped (DropPolicy::newest)
  bool push(Span<const std::uint8_t> bytes) noexcept;

  /// The reader's: the oldest buffer. @return false: there is none
  bool pop(Buffer* out) noexcept;

  /// The reader's: buffers that wait to be read; more may have come by now.
  [[nodiscard]] std::size_t waiting() const noexcept;

  /// Buffers lost so far.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  bool push_one(Span<const std::uint8_t> bytes) noexcept;

  // Who holds a buffer's number has the buffer. `position` counts all pushes, dropped ones as well.
  struct Slot {
    std::size_t size = 0;
    std::uint64_t position = 0;
  };
  /// A place's word: round of the ring in which it was filled, number of the buffer, whether it waits to be read.
  static constexpr std::uint64_t kFull = 1;
  static constexpr std::uint64_t kIndexBits = 15;
  static constexpr std::uint64_t word_of(std::uint64_t count, std::uint64_t index, bool full) {
    return count << (kIndexBits + 1) | index << 1 | (full ? kFull : 0);
  }
  static constexpr std::uint64_t index_of(std::uint64_t word) {
    return word >> 1 & ((std::uint64_t{1} << kIndexBits) - 1);
  }
  static constexpr std::uint64_t count_of(std::uint64_t word) { return word >> (kIndexBits + 1); }
  [[nodiscard]] std::uint8_t* memory_of(std::uint64_t index) const { return memory_.get() + index * buffer_bytes_; }

  std::unique_ptr<std::uint8_t[]> memory_;
  std::unique_ptr<std::atomic<std::uint64_t>[]> places_;
  std::unique_ptr<Slot[]> slots_;
  std::size_t num_places_ = 0;
  std::size_t buffer_bytes_ = 0;
  DropPolicy policy_ = DropPolicy::newest;
  std::atomic<std::uint64_t> head_{0};     ///< buffers that entered the ring; the writer's
  std::atomic<std::uint64_t> dropped_{0};  ///< the writer's
  std::uint64_t pushed_ = 0;               ///< buffers that wanted to enter; the writer's
  std::uint64_t writers_ = 0;              ///< number of the buffer that the writer holds
  std::uint64_t readers_ = 0;
  std::uint64_t tail_ = 0;           ///< the next buffer to be read, counted like head_; the reader's
  std::uint64_t next_position_ = 0;  ///< position of the next buffer if nothing is lost; the reader's
};

}  // namespace lecalib::usb
