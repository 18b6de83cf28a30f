// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/view_points.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

/// The points of one line at one end of its window.
void add_line(const ViewPointOptions& options, const EventLine& line, bool at_end, std::uint16_t model_line,
              LinePoint* out) {
  const float of_line = at_end ? line.sigma_end_px : line.sigma_begin_px;
  const auto sigma_px = static_cast<double>(std::max(of_line, options.least_sigma_px));
  const std::uint32_t n = options.points_per_line;
  const double point_sigma = sigma_px * std::sqrt(0.5 * n);
  for (std::uint32_t i = 0; i < n; ++i) {
    LinePoint& point = out[i];
    point_on_line(line, at_end, static_cast<double>(i) / (n - 1), &point.u_px, &point.v_px);
    point.sigma_px = point_sigma;
    point.line = model_line;
  }
}

}  // namespace

void point_on_line(const EventLine& line, bool at_end, double fraction, double* u_px, double* v_px) {
  const Segment& segment = at_end ? line.end : line.begin;
  const double dx = static_cast<double>(segment.x2) - static_cast<double>(segment.x1);
  const double dy = static_cast<double>(segment.y2) - static_cast<double>(segment.y1);
  const double length = std::sqrt(dx * dx + dy * dy);
  const double g = 2 * fraction - 1;
  const double half_change = (at_end ? 0.5 : -0.5) * static_cast<double>(line.bend_change_px);
  const double bow = static_cast<double>(line.bend_px) + half_change +
                     g * (static_cast<double>(line.skew_px) + g * static_cast<double>(line.peak_px));
  const double rise = length > 0 ? 4 * fraction * (1 - fraction) * bow / length : 0;
  *u_px = static_cast<double>(segment.x1) + fraction * dx - rise * dy;
  *v_px = static_cast<double>(segment.y1) + fraction * dy + rise * dx;
}

Status make_view_points(const ViewPointOptions& options, Span<const LineWindow> windows, Span<const LineMatch> matches,
                        Span<LinePoint> points, Span<View> views, ViewsMade* made) {
  const std::uint32_t n = options.points_per_line;
  if (!valid(options)) return Status::invalid_argument;
  if (points.size() < 2 * matches.size() * n) return Status::capacity_exceeded;
  ViewsMade now;
  for (std::size_t first = 0, last = 0; first < matches.size(); first = last) {
    const std::uint16_t window = matches[first].window;
    if (window >= windows.size() || (first > 0 && matches[first - 1].window > window)) return Status::invalid_argument;
    while (last < matches.size() && matches[last].window == window) ++last;
    if (now.views + 2 > views.size()) return Status::capacity_exceeded;
    for (const bool at_end : {false, true}) {
      const std::size_t start = now.points;
      for (std::size_t m = first; m < last; ++m, now.points += n) {
        if (matches[m].line >= windows[window].lines.size()) return Status::invalid_argument;
        const EventLine& line = windows[window].lines[matches[m].line];
        add_line(options, line, at_end, matches[m].model_line, &points[now.points]);
      }
      views[now.views++] = {at_end ? windows[window].end_us : windows[window].begin_us,
                            static_cast<std::uint32_t>(start), static_cast<std::uint32_t>(now.points - start)};
    }
  }
  *made = now;
  return Status::ok;
}

}  // namespace lecalib
