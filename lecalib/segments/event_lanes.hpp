// SPDX-License-Identifier: MIT
/// Events side by side, as vector units compute them.
#pragma once

#include <cstddef>
#include <cstdint>

namespace lecalib::detail {

/// Whether there are such units. Without them events come one after the other, with what is computed in registers.
#if defined(__SSE__) || defined(__aarch64__)
inline constexpr bool kSideBySide = true;
#else
inline constexpr bool kSideBySide = false;
#endif

/// Events that are looked at in one go.
inline constexpr std::size_t kEventBlock = 16;

/// A bit for each of them. Read from a table, since each lane of a vector then takes its own without shifts.
inline constexpr std::uint32_t kEventBits[kEventBlock] = {0x1,   0x2,   0x4,   0x8,   0x10,   0x20,   0x40,   0x80,
                                                          0x100, 0x200, 0x400, 0x800, 0x1000, 0x2000, 0x4000, 0x8000};

}  // namespace lecalib::detail
