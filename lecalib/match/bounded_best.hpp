// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "lecalib/core/span.hpp"

namespace lecalib {

/// Keeps the best elements of a stream, best first, in storage somebody else owns; counts what it let go. Equal
/// elements stay in the order in which they came.
template <class T>
class BoundedBest {
 public:
  constexpr BoundedBest() noexcept = default;
  constexpr explicit BoundedBest(Span<T> storage) noexcept : storage_(storage) {}

  /// @param better strict order: better(a, b) when a ranks before b
  template <class Better>
  constexpr void offer(const T& value, const Better& better) noexcept {
    if (size_ == storage_.size()) {
      ++dropped_;
      if (size_ == 0 || !better(value, storage_[size_ - 1])) return;
    } else {
      ++size_;
    }
    std::size_t i = size_ - 1;
    for (; i > 0 && better(value, storage_[i - 1]); --i) storage_[i] = storage_[i - 1];
    storage_[i] = value;
  }
  constexpr void erase(std::size_t index) noexcept {
    LECALIB_ASSERT(index < size_);
    for (std::size_t i = index; i + 1 < size_; ++i) storage_[i] = storage_[i + 1];
    --size_;
  }
  constexpr void clear() noexcept {
    size_ = 0;
    dropped_ = 0;
  }
  [[nodiscard]] constexpr T& operator[](std::size_t i) const noexcept {
    LECALIB_ASSERT(i < size_);
    return storage_[i];
  }
  [[nodiscard]] constexpr std::size_t size() const noexcept { return size_; }
  [[nodiscard]] constexpr std::uint32_t dropped() const noexcept { return dropped_; }
  [[nodiscard]] constexpr Span<T> view() const noexcept { return storage_.first(size_); }

 private:
  Span<T> storage_;
  std::size_t size_ = 0;
  std::uint32_t dropped_ = 0;
};

}  // namespace lecalib
