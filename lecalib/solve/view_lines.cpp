// SPDX-License-Identifier: MIT
#include "lecalib/solve/view_lines.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/eigen.hpp"

namespace lecalib {
namespace {

/// Two points closer than this do not make a line.
constexpr double kMinLengthPx = 1.0;

/// Straightened position relative to the centre.
Vec2 straighten(const Straightening& s, const LinePoint& point) {
  const Vec2 x(point.u_px - s.centre_x, point.v_px - s.centre_y);
  const double rho2 = x.squaredNorm() / (s.half_diagonal * s.half_diagonal);
  return x / std::max(1.0 - s.mu * rho2, 0.05);
}

void fit_direction(LineMoments* m) {
  const double n = static_cast<double>(m->count);
  // The eigenvector of the larger eigenvalue of [xx xy; xy yy], in the form that does not cancel.
  const double xy = m->xy - m->x * m->y / n;
  const double half_difference = 0.5 * ((m->xx - m->x * m->x / n) - (m->yy - m->y * m->y / n));
  const double root = std::sqrt(half_difference * half_difference + xy * xy);
  const Vec2 along = half_difference >= 0.0 ? Vec2(half_difference + root, xy) : Vec2(xy, root - half_difference);
  const double length = along.norm();
  m->direction[0] = length > 0.0 ? along(0) / length : 1.0;
  m->direction[1] = length > 0.0 ? along(1) / length : 0.0;
  m->x /= n;
  m->y /= n;
}

}  // namespace

void fit_view_lines(const CalibrationData& data, const View& view, const Straightening& straightening,
                    Span<LineSums> sums, Span<ViewLine> lines, std::size_t* count) {
  LECALIB_ASSERT(sums.size() >= data.model.size() && lines.size() >= data.model.size());
  const std::size_t end = view.first + view.count;
  for (LineSums& sum : sums) sum.moments = {};
  for (std::size_t i = view.first; i < end; ++i) {
    if (is_left_out(data, i)) continue;
    const LinePoint& point = data.points[i];
    const Vec2 x = straighten(straightening, point);
    LineMoments& m = sums[point.line].moments;
    ++m.count;
    m.x += x(0);
    m.y += x(1);
    m.xx += x(0) * x(0);
    m.xy += x(0) * x(1);
    m.yy += x(1) * x(1);
  }
  for (LineSums& sum : sums) {
    if (sum.moments.count >= 2) fit_direction(&sum.moments);
  }
  for (std::size_t i = view.first; i < end; ++i) {
    if (is_left_out(data, i)) continue;
    const LinePoint& point = data.points[i];
    LineMoments& m = sums[point.line].moments;
    const Vec2 x = straighten(straightening, point);
    const double along = (x(0) - m.x) * m.direction[0] + (x(1) - m.y) * m.direction[1];
    m.low = std::min(m.low, along);
    m.high = std::max(m.high, along);
  }
  *count = 0;
  for (std::size_t i = 0; i < data.model.size(); ++i) {
    const LineMoments& m = sums[i].moments;
    if (m.count < 2 || !(m.high - m.low > kMinLengthPx)) continue;
    const double x = straightening.centre_x + m.x;
    const double y = straightening.centre_y + m.y;
    lines[(*count)++] = {{x + m.low * m.direction[0], y + m.low * m.direction[1]},
                         {x + m.high * m.direction[0], y + m.high * m.direction[1]},
                         static_cast<std::uint16_t>(i)};
  }
}

std::size_t count_lines(const CalibrationData& data, const View& view, Span<LineSums> sums) {
  for (LineSums& sum : sums) sum.judgement = {};
  std::size_t lines = 0;
  for (std::size_t i = view.first; i < view.first + view.count; ++i) {
    if (!is_left_out(data, i) && sums[data.points[i].line].judgement.count++ == 0) ++lines;
  }
  return lines;
}

}  // namespace lecalib
