// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lecalib/core/span.hpp"

namespace lecalib::host {

/// How the packets of an AEDAT 4 file are compressed, by the number in its header.
enum class Compression : std::int32_t { none = 0, lz4 = 1, lz4_high = 2, zstd = 3, zstd_high = 4 };

/// Appends the content of one or more LZ4 or Zstandard frames to *out, up to `max_bytes` in all.
/// @return nullptr, or what was expected instead: a whole frame, less content, a build that knows the compression
const char* decompress(Compression compression, Span<const std::uint8_t> input, std::size_t max_bytes,
                       std::vector<std::uint8_t>* out);

}  // namespace lecalib::host
