// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <type_traits>
#include <utility>

#include "lecalib/core/config.hpp"

namespace lecalib {

/// A view of `size` consecutive T that someone else owns (C++20's std::span, as far as it is needed here).
template <class T>
class Span {
 public:
  constexpr Span() noexcept = default;
  constexpr Span(T* data, std::size_t size) noexcept : data_(data), size_(size) {}
  template <std::size_t N>
  constexpr Span(T (&array)[N]) noexcept : data_(array), size_(N) {}  // NOLINT(google-explicit-constructor)
  /// From anything with data() and size(): std::vector, std::array, Span<T> to Span<const T>.
  template <class Container, class = std::enable_if_t<std::is_convertible_v<
                                 std::remove_pointer_t<decltype(std::declval<Container&>().data())> (*)[], T (*)[]>>>
  constexpr Span(Container& container) noexcept  // NOLINT(google-explicit-constructor)
      : data_(container.data()), size_(container.size()) {}
  template <class Container,
            class = std::enable_if_t<std::is_convertible_v<
                std::remove_pointer_t<decltype(std::declval<const Container&>().data())> (*)[], T (*)[]>>,
            class = void>
  constexpr Span(const Container& container) noexcept  // NOLINT(google-explicit-constructor)
      : data_(container.data()), size_(container.size()) {}

  [[nodiscard]] constexpr T* data() const noexcept { return data_; }
  [[nodiscard]] constexpr std::size_t size() const noexcept { return size_; }
  [[nodiscard]] constexpr bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] constexpr T* begin() const noexcept { return data_; }
  [[nodiscard]] constexpr T* end() const noexcept { return data_ + size_; }

  constexpr T& operator[](std::size_t i) const noexcept {
    LECALIB_ASSERT(i < size_);
    return data_[i];
  }

  /// Elements [offset, offset + count), both clamped to what is there.
  [[nodiscard]] constexpr Span subspan(std::size_t offset,
                                       std::size_t count = static_cast<std::size_t>(-1)) const noexcept {
    const std::size_t first = offset < size_ ? offset : size_;
    const std::size_t left = size_ - first;
    return {data_ + first, count < left ? count : left};
  }
  [[nodiscard]] constexpr Span first(std::size_t count) const noexcept { return subspan(0, count); }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace lecalib
