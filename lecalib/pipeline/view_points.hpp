// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/records.hpp"
#include "lecalib/core/status.hpp"

namespace lecalib {

struct ViewPointOptions {
  /// Points that stand for one line, spread evenly from end to end along its bend; 3 to kMaxPointsPerLine. Three carry
  /// all that the line knows (place, direction, bend); more cost time and bring nothing.
  std::uint32_t points_per_line = 3;
  /// One sigma of a line, px, at least: an edge's events are late together. Amid background activity a faint edge
  /// scatters as independent draws do, which the detector takes to have no such error.
  float least_sigma_px = 0.5F;
};
inline constexpr std::uint32_t kMaxPointsPerLine = 16;

constexpr bool valid(const ViewPointOptions& o) {
  return o.points_per_line >= 3 && o.points_per_line <= kMaxPointsPerLine;
}

/// The point at `fraction` (0 to 1) of a line's curve, at its window's begin or end.
void point_on_line(const EventLine& line, bool at_end, double fraction, double* u_px, double* v_px);

struct ViewsMade {
  std::size_t points = 0;
  std::size_t views = 0;
};

/// Turns the matched lines of windows into views: two for each matched window, at its begin and its end.
/// The points of a line share its one-sigma such that together they weigh as much as its two end points.
/// @param matches ordered by window
/// @param points  [2 x matches.size() x points_per_line] at least
/// @param views   [2 x matched windows] at least
/// @return ok | invalid_argument (options, an index out of range, matches not ordered) | capacity_exceeded; *made
///         unchanged unless ok
Status make_view_points(const ViewPointOptions& options, Span<const LineWindow> windows, Span<const LineMatch> matches,
                        Span<LinePoint> points, Span<View> views, ViewsMade* made);

}  // namespace lecalib
