// SPDX-License-Identifier: MIT
/// Drawn lines: those that are dark between two flanks, and whose middle is the model's.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/solve/calibration_data.hpp"

namespace lecalib {

/// What tells a drawn line from one that has another edge, a shadow's say, beside it.
struct DrawnLineOptions {
  /// So many views show both flanks, or half of all views where there are fewer ...
  std::uint32_t min_views = 6;
  /// ... and so large a share of the views that show the line. (0, 1]
  double min_share = 0.5;
  /// Its width, px, is the same in all views to this, one sigma: another edge beside it is nearer here, farther there.
  /// > 0
  double max_width_scatter_px = 0.5;
};

/// Whether a model line is seen as a drawn one. @param data with edges
bool is_drawn(const CalibrationData& data, const DrawnLineOptions& options, std::size_t line);

/// Marks the points of a line that is none: those on the rarer side, and other flanks found beside it.
void mark_strays(const CalibrationData& data, std::size_t line, Span<std::uint8_t> marks);

}  // namespace lecalib
