// SPDX-License-Identifier: MIT
#include "lecalib/match/track_comparison.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// Share of the smaller hypothesis's matches that both must have in common, and of pairs that must keep their distance.
constexpr double kMinCommon = 0.6;
constexpr double kMinKeptPairs = 0.95;
/// Distances are equal within this share of the model's size.
constexpr double kTolerance = 0.02;
/// Lengths that a symmetry maps to each other are equal within this share of it: a side that is off by a percent makes
/// another camera.
constexpr double kEqualShare = 1e-3;
/// Poses are the same within this share of the model's distance.
constexpr double kSameShift = 0.2;

double length_of(const ModelLine& line) {
  return (Eigen::Map<const Vec3>(line.q) - Eigen::Map<const Vec3>(line.p)).norm();
}

/// Distance of two lines' middles.
double distance_of(const ModelLine& a, const ModelLine& b) {
  const Vec3 sum_a = Eigen::Map<const Vec3>(a.p) + Eigen::Map<const Vec3>(a.q);
  const Vec3 sum_b = Eigen::Map<const Vec3>(b.p) + Eigen::Map<const Vec3>(b.q);
  return 0.5 * (sum_a - sum_b).norm();
}

/// How far a line's ends lie from two points, the worse one.
double gap_between(const ModelLine& line, const Vec3& p, const Vec3& q) {
  return std::sqrt(
      std::max((Eigen::Map<const Vec3>(line.p) - p).squaredNorm(), (Eigen::Map<const Vec3>(line.q) - q).squaredNorm()));
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
         static_cast<double>(kept) >= kMinKeptPairs * static_cast<double>(pairs);
}

bool is_same_placement(const ModelGraph& model, const Pose& a, const Pose& b, double turn_rad, bool up_to_symmetry) {
  const Vec3 centre = Eigen::Map<const Vec3>(model.centre_m);
  const Mat3 R = rotation_of(a).transpose() * rotation_of(b);
  const Vec3 at_a = rotation_of(a) * centre + translation_of(a);
  const Vec3 at_b = rotation_of(b) * centre + translation_of(b);
  if ((at_a - at_b).norm() > kSameShift * at_a.norm()) return false;
  const double reach_m = 0.5 * turn_rad * model.extent_m;
  for (std::size_t i = 0; i < model.lines.size(); ++i) {
    const ModelLine& line = model.lines[i];
    bool lies_there = false;
    for (std::size_t j = up_to_symmetry ? 0 : i; j < (up_to_symmetry ? model.lines.size() : i + 1) && !lies_there;
         ++j) {
      const ModelLine& other = model.lines[j];
      if (std::abs(length_of(line) - length_of(other)) > kEqualShare * model.extent_m) continue;
      const Vec3 p = centre + R * (Eigen::Map<const Vec3>(other.p) - centre);
      const Vec3 q = centre + R * (Eigen::Map<const Vec3>(other.q) - centre);
      lies_there = gap_between(line, p, q) <= reach_m || (up_to_symmetry && gap_between(line, q, p) <= reach_m);
    }
    if (!lies_there) return false;
  }
  return true;
}

}  // namespace lecalib
