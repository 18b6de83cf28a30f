// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "lecalib/core/records.hpp"

namespace lecalib {

/// An hour.
inline constexpr std::int64_t kLongestWindowUs = 3'600'000'000;

/// How the window's length follows the motion: edges should travel several pixels in a window, not tens.
struct WindowLengthOptions {
  std::int64_t first_us = 10'000;  ///< of the first window; > 0, up to kLongestWindowUs
  std::int64_t min_us = 300;       ///< > 0; shorter windows hold too few events of an edge
  /// min_us to kLongestWindowUs; in longer ones than this the noise of a sensor begins to form lines.
  std::int64_t max_us = 60'000;
  float travel_px = 6;  ///< wanted travel of the faster lines across themselves; 0: the length stays at first_us
};

constexpr bool valid(const WindowLengthOptions& o) {
  return o.first_us > 0 && o.first_us <= kLongestWindowUs && o.min_us > 0 && o.min_us <= o.max_us &&
         o.max_us <= kLongestWindowUs && o.travel_px >= 0;
}

/// Length of the next window, from the lines of the last: the length-weighted upper quartile of their travel is brought
/// to travel_px, by at most a factor of 0.6 to 1.3 at a time. Without lines the window grows.
/// @param scratch at least lines.size() elements
std::int64_t next_window_length(const WindowLengthOptions& options, std::int64_t length_us, Span<const EventLine> lines,
                                Span<float> scratch);

}  // namespace lecalib
