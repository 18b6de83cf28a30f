// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace lecalib {

/// later - earlier, microseconds. Right for any two times, later >= earlier, where the signed difference may overflow:
/// stamps of recordings can be anything.
constexpr std::uint64_t distance_us(std::int64_t earlier, std::int64_t later) noexcept {
  return static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(earlier);
}

}  // namespace lecalib
