// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "lecalib/core/span.hpp"

namespace lecalib {

/// A vector that appends into storage somebody else owns and counts what did not fit.
template <class T>
class FixedVector {
 public:
  constexpr FixedVector() noexcept = default;
  constexpr explicit FixedVector(Span<T> storage) noexcept : storage_(storage) {}

  /// @return false when full; the element is then counted in dropped().
  constexpr bool try_push(const T& value) noexcept {
    if (size_ == storage_.size()) {
      ++dropped_;
      return false;
    }
    storage_[size_++] = value;
    return true;
  }
  constexpr void pop_back() noexcept {
    LECALIB_ASSERT(size_ > 0);
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
  [[nodiscard]] constexpr T& back() const noexcept { return (*this)[size_ - 1]; }
  [[nodiscard]] constexpr T* begin() const noexcept { return storage_.data(); }
  [[nodiscard]] constexpr T* end() const noexcept { return storage_.data() + size_; }
  [[nodiscard]] constexpr std::size_t size() const noexcept { return size_; }
  [[nodiscard]] constexpr std::size_t capacity() const noexcept { return storage_.size(); }
  [[nodiscard]] constexpr bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] constexpr std::size_t dropped() const noexcept { return dropped_; }
  [[nodiscard]] constexpr Span<T> view() const noexcept { return storage_.first(size_); }

 private:
  Span<T> storage_;
  std::size_t size_ = 0;
  std::size_t dropped_ = 0;
};

}  // namespace lecalib
