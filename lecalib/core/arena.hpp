// SPDX-License-Identifier: MIT
/// Memory given by the caller, carved once into the arrays that the stages work on.
///
/// Each workspace has one function template that lists its arrays:
///
///     template <class Carver>
///     constexpr bool carve(Carver& carver, const FooCapacities& capacities, FooWorkspace* out);
///
/// With an ArenaMeter it computes the bytes at compile time (required_bytes), with an Arena it hands out the memory:
/// the two cannot disagree. Workspaces of stages that never run together are carved from the same mark, so they share
/// their bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "lecalib/core/span.hpp"

namespace lecalib {

/// Alignment that the memory given to an Arena must have.
inline constexpr std::size_t kArenaAlign = alignof(std::max_align_t);

namespace detail {
constexpr std::size_t align_up(std::size_t offset, std::size_t alignment) noexcept {
  return (offset + alignment - 1) / alignment * alignment;
}
template <class T>
inline constexpr bool is_arena_record = std::is_trivially_copyable_v<T>&& std::is_trivially_destructible_v<T> &&
                                        alignof(T) <= kArenaAlign;
}  // namespace detail

/// Counts what an Arena would need. carve() always succeeds and gives empty spans.
class ArenaMeter {
 public:
  template <class T>
  constexpr bool carve(std::size_t count, Span<T>* out) noexcept {
    static_assert(detail::is_arena_record<T>);
    used_ = detail::align_up(used_, alignof(T)) + count * sizeof(T);
    if (used_ > peak_) peak_ = used_;
    *out = {};
    return true;
  }
  [[nodiscard]] constexpr std::size_t mark() const noexcept { return used_; }
  constexpr void rewind(std::size_t mark) noexcept { used_ = mark; }
  [[nodiscard]] constexpr std::size_t peak() const noexcept { return peak_; }

 private:
  std::size_t used_ = 0;
  std::size_t peak_ = 0;
};

/// Carves spans from a block of caller's bytes. Never owns, never frees; contents are not initialised.
class Arena {
 public:
  constexpr Arena() noexcept = default;
  /// @param memory aligned to kArenaAlign; must outlive every span carved from it.
  explicit Arena(Span<std::byte> memory) noexcept : memory_(memory) {}

  /// @return false when the memory is too small or misaligned; *out is then empty.
  template <class T>
  bool carve(std::size_t count, Span<T>* out) noexcept {
    static_assert(detail::is_arena_record<T>);
    *out = {};
    const std::size_t offset = detail::align_up(used_, alignof(T));
    if (offset > memory_.size() || count > (memory_.size() - offset) / sizeof(T)) return false;
    if (reinterpret_cast<std::uintptr_t>(memory_.data()) % kArenaAlign != 0) return false;
    *out = {reinterpret_cast<T*>(memory_.data() + offset), count};
    used_ = offset + count * sizeof(T);
    if (used_ > peak_) peak_ = used_;
    return true;
  }
  [[nodiscard]] std::size_t mark() const noexcept { return used_; }
  /// Gives back everything carved since `mark`; spans carved later share those bytes.
  void rewind(std::size_t mark) noexcept {
    LECALIB_ASSERT(mark <= used_);
    used_ = mark;
  }
  [[nodiscard]] std::size_t peak() const noexcept { return peak_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return memory_.size(); }

 private:
  Span<std::byte> memory_;
  std::size_t used_ = 0;
  std::size_t peak_ = 0;
};

}  // namespace lecalib
