// SPDX-License-Identifier: MIT
/// Numbers as text, without printf.
#pragma once

#include <cstddef>
#include <cstdint>

/// One line of text; what does not fit is cut off.
class Text {
 public:
  Text& add(const char* text);
  Text& add(std::uint64_t value);
  /// With four decimals; |value| below 1e14.
  Text& add_decimal(double value);
  /// The 16 hexadecimal digits of its bits.
  Text& add_bits(double value);
  [[nodiscard]] const char* c_str() const { return text_; }

 private:
  void add(char letter);

  char text_[160] = {};
  std::size_t size_ = 0;
};
