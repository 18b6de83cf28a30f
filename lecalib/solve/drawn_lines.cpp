// SPDX-License-Identifier: MIT
#include "lecalib/solve/drawn_lines.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

/// A line's points in one view: none, one flank's or both's.
struct Flanks {
  std::size_t points[2] = {};  ///< by the side that is dark
  double width_px = 0;         ///< with both

  Flanks(const CalibrationData& data, const View& view, std::size_t line) {
    std::size_t first = view.count, last = 0;  // of the one side's points
    for (std::size_t k = 0; k < view.count; ++k) {
      if (data.points[view.first + k].line != line) continue;
      const bool positive = data.edges[view.first + k].model_side > 0;
      ++points[positive ? 1 : 0];
      if (!positive) continue;
      first = std::min(first, k);
      last = k;
    }
    if (first >= last || points[0] == 0) return;
    const LinePoint& a = data.points[view.first + first];
    const LinePoint& b = data.points[view.first + last];
    const double dx = b.u_px - a.u_px, dy = b.v_px - a.v_px;
    double distance = 0;
    for (std::size_t i = view.first; i < view.first + view.count; ++i) {
      const LinePoint& point = data.points[i];
      if (point.line != line || data.edges[i].model_side > 0) continue;
      distance += (point.v_px - a.v_px) * dx - (point.u_px - a.u_px) * dy;
    }
    const double length = std::sqrt(dx * dx + dy * dy);
    if (length > 0) width_px = std::abs(distance) / (static_cast<double>(points[0]) * length);
  }

  [[nodiscard]] bool any() const { return points[0] + points[1] > 0; }
  [[nodiscard]] bool both() const { return width_px > 0; }
};

}  // namespace

bool is_drawn(const CalibrationData& data, const DrawnLineOptions& options, std::size_t line) {
  double all = 0, any = 0, both = 0, sum = 0, squares = 0;
  for (const View& view : data.views) {
    const Flanks flanks(data, view, line);
    all += view.count > 0 ? 1 : 0;
    any += flanks.any() ? 1 : 0;
    if (!flanks.both()) continue;
    both += 1;
    sum += flanks.width_px;
    squares += flanks.width_px * flanks.width_px;
  }
  if (both < 2 || both < options.min_share * any) return false;
  if (both < std::min(static_cast<double>(options.min_views), 0.5 * all)) return false;
  return squares - sum * sum / both <= (both - 1) * options.max_width_scatter_px * options.max_width_scatter_px;
}

void mark_strays(const CalibrationData& data, std::size_t line, Span<std::uint8_t> marks) {
  int balance = 0;
  for (std::size_t i = 0; i < data.points.size(); ++i) {
    if (data.points[i].line == line && !data.edges[i].other_flank) balance += data.edges[i].model_side;
  }
  for (std::size_t i = 0; i < data.points.size(); ++i) {
    if (data.points[i].line != line) continue;
    if (data.edges[i].other_flank || data.edges[i].model_side * balance < 0) marks[i] = 1;
  }
}

}  // namespace lecalib
