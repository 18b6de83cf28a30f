// SPDX-License-Identifier: MIT
#include "bench/quality.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib::bench {
namespace {

constexpr double kMaxDistance = 2;  // px
constexpr double kMinCover = 0.5;
constexpr int kPoints = 9;

/// Points along a detected line at one end of the window.
Curve curve_of(const Segment& segment, float bend_px) {
  const double dx = double{segment.x2} - double{segment.x1};
  const double dy = double{segment.y2} - double{segment.y1};
  const double length = std::hypot(dx, dy);
  Curve curve;
  for (int i = 0; i < kPoints; ++i) {
    const double s = i / (kPoints - 1.0);
    const double out = length > 0 ? 4 * s * (1 - s) * double{bend_px} / length : 0;
    curve.push_back({double{segment.x1} + s * dx - out * dy, double{segment.y1} + s * dy + out * dx});
  }
  return curve;
}

/// Distance of `p` from the curve, which goes on straight beyond its ends; *along is 0 at its begin and 1 at its end.
double distance_to(const Curve& curve, const Pixel& p, double* along) {
  double best = 1e9;
  const std::size_t pieces = curve.size() - 1;
  for (std::size_t i = 0; i < pieces; ++i) {
    const double dx = curve[i + 1].x - curve[i].x;
    const double dy = curve[i + 1].y - curve[i].y;
    const double foot = ((p.x - curve[i].x) * dx + (p.y - curve[i].y) * dy) / (dx * dx + dy * dy);
    const double s = std::clamp(foot, i == 0 ? -1e9 : 0.0, i + 1 == pieces ? 1e9 : 1.0);
    const double distance = std::hypot(p.x - curve[i].x - s * dx, p.y - curve[i].y - s * dy);
    if (distance >= best) continue;
    best = distance;
    *along = (static_cast<double>(i) + s) / static_cast<double>(pieces);
  }
  return best;
}

struct Comparison {
  bool lies_on;        ///< near enough, most of it between the true line's ends
  double distance_px;  ///< mean over the detected line's points
  double cover;        ///< share of the true line
};

Comparison compare(const Curve& detected, const Curve& truth) {
  double sum_px = 0;
  double low = 1;
  double high = 0;
  int between = 0;
  for (const Pixel& p : detected) {
    double along = 0;
    sum_px += distance_to(truth, p, &along);
    low = std::min(low, std::max(along, 0.0));
    high = std::max(high, std::min(along, 1.0));
    if (along >= 0 && along <= 1) ++between;
  }
  const double mean_px = sum_px / static_cast<double>(detected.size());
  return {mean_px < kMaxDistance && 2 * between > static_cast<int>(detected.size()), mean_px, high - low};
}

}  // namespace

void Quality::add(const Scene& scene, Span<const EventLine> lines) {
  for (Segment EventLine::*const end : {&EventLine::begin, &EventLine::end}) {
    std::vector<const Curve*> truth;
    for (const TrueLine& line : scene.lines) truth.push_back(end == &EventLine::begin ? &line.begin : &line.end);
    std::vector<Curve> detected;
    for (const EventLine& line : lines) detected.push_back(curve_of(line.*end, line.bend_px));
    add_end(truth, detected);
  }
}

void Quality::add_end(const std::vector<const Curve*>& truth, const std::vector<Curve>& detected) {
  std::vector<bool> is_right(detected.size(), false);
  for (const Curve* const line : truth) {
    double nearest = kMaxDistance;
    for (std::size_t i = 0; i < detected.size(); ++i) {
      const Comparison comparison = compare(detected[i], *line);
      if (!comparison.lies_on) continue;
      is_right[i] = true;
      if (comparison.cover > kMinCover) nearest = std::min(nearest, comparison.distance_px);
    }
    if (nearest >= kMaxDistance) continue;
    ++found_;
    distances_px_.push_back(nearest);
  }
  asked_ += truth.size();
  detected_ += detected.size();
  right_ += static_cast<std::size_t>(std::count(is_right.begin(), is_right.end(), true));
}

double Quality::median_px() const {
  if (distances_px_.empty()) return 0;
  std::vector<double> sorted = distances_px_;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

}  // namespace lecalib::bench
