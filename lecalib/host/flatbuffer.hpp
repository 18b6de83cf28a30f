// SPDX-License-Identifier: MIT
/// Reads FlatBuffers that anybody may have written: every access is checked against the buffer's end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "lecalib/core/span.hpp"

namespace lecalib::host {

/// Offsets count from the buffer's begin. Nothing is returned where the buffer contradicts itself or ends too early.
class FlatBuffer {
 public:
  explicit FlatBuffer(Span<const std::uint8_t> bytes) : bytes_(bytes) {}

  /// A little-endian integer of `Integer`'s size.
  template <class Integer>
  [[nodiscard]] std::optional<Integer> read(std::size_t at) const {
    if (at > bytes_.size() || bytes_.size() - at < sizeof(Integer)) return std::nullopt;
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(Integer); ++i) value |= static_cast<std::uint64_t>(bytes_[at + i]) << (8U * i);
    return static_cast<Integer>(value);
  }

  /// Where the offset at `at` leads to; offsets lead forward only.
  [[nodiscard]] std::optional<std::size_t> follow(std::size_t at) const {
    const std::optional<std::uint32_t> offset = read<std::uint32_t>(at);
    if (!offset || *offset > bytes_.size() - at) return std::nullopt;
    return at + *offset;
  }

  /// Whether the four letters stand there.
  [[nodiscard]] bool has_identifier(std::size_t at, const char* letters) const {
    for (std::size_t i = 0; i < 4; ++i) {
      if (read<std::uint8_t>(at + i) != static_cast<std::uint8_t>(letters[i])) return false;
    }
    return true;
  }

  /// Where field `index` of the table at `table` stands; 0 when the table does not have it.
  [[nodiscard]] std::optional<std::size_t> field(std::size_t table, std::size_t index) const {
    const std::optional<std::int32_t> back = read<std::int32_t>(table);
    if (!back) return std::nullopt;
    const std::int64_t at = static_cast<std::int64_t>(table) - *back;
    if (at < 0 || static_cast<std::uint64_t>(at) > bytes_.size()) return std::nullopt;
    const auto vtable = static_cast<std::size_t>(at);
    const std::optional<std::uint16_t> size = read<std::uint16_t>(vtable);
    if (!size) return std::nullopt;
    const std::size_t entry = 4 + 2 * index;
    if (entry + 2 > *size) return std::size_t{0};
    const std::optional<std::uint16_t> offset = read<std::uint16_t>(vtable + entry);
    if (!offset) return std::nullopt;
    return *offset == 0 ? std::size_t{0} : table + *offset;
  }

  /// The bytes of the vector (or string) that the offset at `at` leads to.
  [[nodiscard]] std::optional<Span<const std::uint8_t>> vector(std::size_t at, std::size_t element_size) const {
    const std::optional<std::size_t> begin = follow(at);
    if (!begin) return std::nullopt;
    const std::optional<std::uint32_t> count = read<std::uint32_t>(*begin);
    if (!count || *count > (bytes_.size() - *begin - sizeof(std::uint32_t)) / element_size) return std::nullopt;
    return bytes_.subspan(*begin + sizeof(std::uint32_t), *count * element_size);
  }

 private:
  Span<const std::uint8_t> bytes_;
};

}  // namespace lecalib::host
