// SPDX-License-Identifier: MIT
#include "lecalib/match/track_comparison.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

/// Share of the smaller hypothesis's matches that both must have in common, and of pairs that must keep their distance.
constexpr double kMinCommon = 0.6;
constexpr double kMinKept = 0.95;
/// Distances are equal within this share of the model's size.
constexpr double kTolerance = 0.02;

double length_of(const ModelLine& line) {
  return (Eigen::Map<const Vec3>(line.q) - Eigen::Map<const Vec3>(line.p)).norm();
}

/// Distance of two lines' middles.
double distance_of(const ModelLine& a, const ModelLine& b) {
  const Vec3 sum_a = Eigen::Map<const Vec3>(a.p) + Eigen::Map<const Vec3>(a.q);
  const Vec3 sum_b = Eigen::Map<const Vec3>(b.p) + Eigen::Map<const Vec3>(b.q);
  return 0.5 * (sum_a - sum_b).norm();
}

/// The model line that a hypothesis gives to a detected line, or the number of model lines.
std::size_t label_of(const LineTrack& track, std::size_t window, std::uint16_t line, std::size_t none) {
  if (!track.windows[window].matched) return none;
  for (const LineMatch& match : track.matches_of(window)) {
    if (match.line == line) return match.model_line;
  }
  return none;
}

std::size_t count_matches(const LineTrack& track) {
  std::size_t count = 0;
  for (const WindowTrack& window : track.windows) count += window.matched ? window.num_matches : 0U;
  return count;
}

}  // namespace

bool is_same_matching(const MatchScene& scene, const LineTrack& a, const LineTrack& b) {
  const Span<const ModelLine> model = scene.model.lines;
  const double tolerance_m = kTolerance * scene.model.extent_m;
  const auto equal = [tolerance_m](double x, double y) { return std::abs(x - y) <= tolerance_m; };
  std::size_t common = 0;
  std::size_t pairs = 0;
  std::size_t kept = 0;
  for (std::size_t w = 0; w < a.windows.size(); ++w) {
    if (!a.windows[w].matched || !b.windows[w].matched) continue;
    const Span<const LineMatch> matches = a.matches_of(w);
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const std::size_t first = label_of(b, w, matches[i].line, model.size());
      if (first == model.size()) continue;
      ++common;
      for (std::size_t j = 0; j < i; ++j) {
        const std::size_t second = label_of(b, w, matches[j].line, model.size());
        if (second == model.size()) continue;
        ++pairs;
        const ModelLine& p = model[matches[i].model_line];
        const ModelLine& q = model[matches[j].model_line];
        if (equal(length_of(p), length_of(model[first])) && equal(length_of(q), length_of(model[second])) &&
            equal(distance_of(p, q), distance_of(model[first], model[second]))) {
          ++kept;
        }
      }
    }
  }
  const std::size_t fewer = std::min(count_matches(a), count_matches(b));
  return static_cast<double>(common) >= kMinCommon * static_cast<double>(fewer) &&
         static_cast<double>(kept) >= kMinKept * static_cast<double>(pairs);
}

}  // namespace lecalib
