// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "lecalib/core/records.hpp"

namespace lecalib {

/// How the window's length follows the motion: edges should travel several pixels in a window, not tens.
struct WindowLengthOptions {
  std::int64_t first_us = 10'000;  ///< of the first window; > 0
  std::int64_t min_us = 300;       ///< > 0; shorter windows hold too few events of an edge
  std::int64_t max_us = 60'000;    ///< >= min_us; in longer ones the noise of a sensor begins to form lines
  float travel_px = 6;  ///< wanted travel of the faster lines across themselves; 0: the length stays at first_us
};

/// Length of the next window, from the lines of the last: the length-weighted upper quartile of their travel is brought
/// to travel_px, by at most a factor of 0.6 to 1.3 at a time. Without lines the window grows.
/// @param scratch at least lines.size() elements
std::int64_t next_window_length(const WindowLengthOptions& options, std::int64_t length_us, Span<const EventLine> lines,
                                Span<float> scratch);

}  // namespace lecalib
