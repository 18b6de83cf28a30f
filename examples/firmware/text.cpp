// SPDX-License-Identifier: MIT
#include "text.hpp"

#include <cstring>

void Text::add(char letter) {
  if (size_ + 1 < sizeof text_) text_[size_++] = letter;
}

Text& Text::add(const char* text) {
  for (; *text != 0; ++text) add(*text);
  return *this;
}

Text& Text::add(std::uint64_t value) {
  std::uint64_t unit = 1;
  while (value / unit >= 10) unit *= 10;
  for (; unit > 0; unit /= 10) add(static_cast<char>('0' + value / unit % 10));
  return *this;
}

Text& Text::add_decimal(double value) {
  if (value < 0) add('-');
  const auto units = static_cast<std::uint64_t>((value < 0 ? -value : value) * 1e4 + 0.5);
  add(units / 10000).add(".");
  for (std::uint64_t unit = 1000; unit > 0; unit /= 10) add(static_cast<char>('0' + units / unit % 10));
  return *this;
}

Text& Text::add_bits(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  for (int shift = 60; shift >= 0; shift -= 4) add("0123456789abcdef"[(bits >> shift) & 15]);
  return *this;
}
