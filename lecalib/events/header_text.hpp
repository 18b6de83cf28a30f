// SPDX-License-Identifier: MIT
/// Small tools for text: that of headers, and events in words.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/span.hpp"

namespace lecalib::header_text {

using Text = Span<const char>;

/// What may stand between the words of a line.
constexpr bool is_blank(int character) noexcept { return character == ' ' || character == '\t' || character == '\r'; }

/// How many characters of `text` and the zero-terminated `other` are the same, from the front.
inline std::size_t common_length(Text text, const char* other) noexcept {
  std::size_t i = 0;
  while (i < text.size() && other[i] != '\0' && text[i] == other[i]) ++i;
  return i;
}

inline bool starts_with(Text text, const char* prefix) noexcept { return prefix[common_length(text, prefix)] == '\0'; }
inline bool is_front_of(Text text, const char* whole) noexcept { return common_length(text, whole) == text.size(); }
inline bool equals(Text text, const char* other) noexcept {
  return starts_with(text, other) && is_front_of(text, other);
}
inline bool contains(Text text, const char* part) noexcept {
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (starts_with(text.subspan(i), part)) return true;
  }
  return false;
}

/// Cuts the part before `separator`, or all of it, from the front of *text.
inline Text take_until(Text* text, char separator) noexcept {
  std::size_t size = 0;
  while (size < text->size() && (*text)[size] != separator) ++size;
  const Text part = text->first(size);
  *text = text->subspan(size + 1);
  return part;
}

/// @return 0 unless `digits` is an integer from 1 to 65535.
inline std::uint16_t parse_length(Text digits) noexcept {
  std::uint32_t value = 0;
  for (const char digit : digits) {
    if (digit < '0' || digit > '9') return 0;
    value = value * 10 + static_cast<std::uint32_t>(digit - '0');
    if (value > 0xFFFF) return 0;
  }
  return static_cast<std::uint16_t>(value);
}

}  // namespace lecalib::header_text
