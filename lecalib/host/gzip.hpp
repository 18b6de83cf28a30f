// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "lecalib/core/span.hpp"

namespace lecalib::host {

/// Unpacks a gzip file piece by piece, in bounded memory.
class GzipReader {
 public:
  /// Whether a file with these first bytes is one.
  static bool is_gzip(Span<const std::uint8_t> bytes) {
    return bytes.size() >= 2 && bytes[0] == 0x1F && bytes[1] == 0x8B;
  }
  /// Whether this build can unpack one (zlib was there).
  static bool is_available();

  GzipReader();
  GzipReader(GzipReader&&) noexcept;
  GzipReader& operator=(GzipReader&&) noexcept;
  ~GzipReader();

  /// Takes bytes from the front of *input and writes content to out[0, *count), as long as there is input and room.
  /// @return false where the file is broken
  bool read(Span<const std::uint8_t>* input, Span<std::uint8_t> out, std::size_t* count);
  /// Whether the file may end here.
  [[nodiscard]] bool is_between_members() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lecalib::host
