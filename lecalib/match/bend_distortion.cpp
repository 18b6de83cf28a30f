// SPDX-License-Identifier: MIT
#include "lecalib/match/bend_distortion.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

constexpr double kFirst = -0.9;
constexpr double kStep = 0.025;
/// A bend this many sigmas off says "not a straight line of the world" and no more: Geman-McClure's loss.
constexpr double kOutlierSigmas = 3.0;
/// Lines shorter than this many units tell nothing.
constexpr double kMinLengthUnits = 40.0;
/// A lens without distortion is the most likely one; weight of the prior in lines, its sigma in grid units of value.
constexpr double kPriorSigma = 0.5;

}  // namespace

void BendVotes::init(std::uint16_t width, std::uint16_t height, double unit_px) {
  centre_.cx = 0.5 * (width - 1.0);
  centre_.cy = 0.5 * (height - 1.0);
  half_diagonal_px_ = 0.5 * std::sqrt(static_cast<double>(width) * width + static_cast<double>(height) * height);
  unit_px_ = unit_px;
  for (int i = 0; i < kNumValues; ++i) {
    const double value = kFirst + kStep * i;
    cost_[i] = value * value / (kPriorSigma * kPriorSigma);
  }
}

double BendVotes::lambda_of(int index) const {
  return (kFirst + kStep * index) / (half_diagonal_px_ * half_diagonal_px_);
}

void BendVotes::add(Span<const EventLine> lines) {
  for (const EventLine& line : lines) {
    Vec2 points[kLinePoints];
    line_points(line, Instant::middle, points);
    if ((points[2] - points[0]).norm() < kMinLengthUnits * unit_px_) continue;
    const double sigma_line = static_cast<double>(line.sigma_begin_px);
    const double sigma = std::sqrt(0.25 * unit_px_ * unit_px_ + 2.25 * sigma_line * sigma_line);
    for (int i = 0; i < kNumValues; ++i) {
      Lens lens = centre_;
      lens.lambda = lambda_of(i);
      Vec2 flat[kLinePoints];
      bool inside = true;
      for (std::size_t q = 0; q < kLinePoints; ++q) inside = flatten(lens, points[q], &flat[q]) && inside;
      if (!inside) {
        cost_[i] += 1.0;
        continue;
      }
      const Vec2 chord = flat[2] - flat[0];
      const Vec2 middle = flat[1] - 0.5 * (flat[0] + flat[2]);
      const double length = std::max(chord.norm(), 1e-9);
      // The bend that is left, back in distorted px: the middle of the line is magnified by flat / distorted length.
      const double magnified = length / (points[2] - points[0]).norm();
      const double bend =
          (chord.x() * middle.y() - chord.y() * middle.x()) / (length * magnified * sigma * kOutlierSigmas);
      cost_[i] += bend * bend / (1.0 + bend * bend);
    }
  }
}

double BendVotes::lambda() const {
  const double* best = std::min_element(cost_, cost_ + kNumValues);
  const int index = static_cast<int>(best - cost_);
  double shift = 0.0;
  if (index > 0 && index + 1 < kNumValues) {
    const double curvature = best[-1] - 2.0 * best[0] + best[1];
    if (curvature > 0.0) shift = 0.5 * (best[-1] - best[1]) / curvature;
  }
  return lambda_of(index) + shift * (lambda_of(1) - lambda_of(0));
}

}  // namespace lecalib
