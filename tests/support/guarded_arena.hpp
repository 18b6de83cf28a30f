// SPDX-License-Identifier: MIT
#pragma once

#include <doctest/doctest.h>

#include <cstddef>
#include <cstring>
#include <memory>

#include "lecalib/core/arena.hpp"

namespace lecalib::test {

/// Exactly `bytes` bytes for an Arena, between two red zones. Everything is filled with 0xA5, so that code which relies
/// on zeroed memory shows; a write beyond either end fails the test when the GuardedArena goes.
class GuardedArena {
 public:
  explicit GuardedArena(std::size_t bytes)
      : bytes_(bytes), block_(new Chunk[(2 * kZone + bytes) / sizeof(Chunk) + 1]), arena_(memory()) {
    std::memset(block_.get(), kFill, 2 * kZone + bytes);
  }
  ~GuardedArena() { CHECK_MESSAGE(intact(), "a write beyond the arena's ends"); }
  GuardedArena(const GuardedArena&) = delete;
  GuardedArena& operator=(const GuardedArena&) = delete;

  [[nodiscard]] Span<std::byte> memory() const { return {raw() + kZone, bytes_}; }
  /// An arena over memory(); it lives as long as this object.
  [[nodiscard]] Arena& arena() { return arena_; }

  [[nodiscard]] bool intact() const {
    for (std::size_t i = 0; i < kZone; ++i) {
      if (raw()[i] != std::byte{kFill} || raw()[kZone + bytes_ + i] != std::byte{kFill}) return false;
    }
    return true;
  }

 private:
  static constexpr unsigned char kFill = 0xA5;
  static constexpr std::size_t kZone = 16 * kArenaAlign;
  struct alignas(kArenaAlign) Chunk {
    std::byte bytes[kArenaAlign];
  };

  [[nodiscard]] std::byte* raw() const { return reinterpret_cast<std::byte*>(block_.get()); }

  std::size_t bytes_;
  std::unique_ptr<Chunk[]> block_;
  Arena arena_;
};

}  // namespace lecalib::test
