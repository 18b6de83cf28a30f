// SPDX-License-Identifier: MIT
#include "lecalib/match/window_motion.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// A motion is not extended over more than this many times the interval in which it was seen.
constexpr double kMaxExtrapolation = 4.0;
/// Windows between neighbours that a scatter needs, and its least values: rad, share of distance.
constexpr std::size_t kMinScatterWindows = 4;
constexpr double kMinRotationRad = 0.003;
constexpr double kMinDistanceShare = 0.002;
/// Sigma of a prior over the median scatter.
constexpr double kPriorWidth = 1.5;
constexpr std::size_t kNoWindow = static_cast<std::size_t>(-1);

/// Microseconds since the first window's begin.
double middle_us(const WindowMotion& motion, std::size_t window) {
  const auto origin_us = static_cast<double>(motion.times[0].begin_us);
  const WindowTimes& times = motion.times[window];
  return 0.5 * ((static_cast<double>(times.begin_us) - origin_us) + (static_cast<double>(times.end_us) - origin_us));
}

/// The nearest matched windows on both sides.
struct Neighbours {
  std::size_t before = kNoWindow;
  std::size_t after = kNoWindow;
  [[nodiscard]] bool both() const { return before != kNoWindow && after != kNoWindow; }
};

Neighbours neighbours_of(const WindowMotion& motion, std::size_t window) {
  Neighbours found;
  for (std::size_t w = 0; w < motion.windows.size(); ++w) {
    if (!motion.windows[w].matched || w == window) continue;
    if (w < window) found.before = w;
    if (w > window && found.after == kNoWindow) found.after = w;
  }
  return found;
}

/// The pose after `share` times the motion from one pose to another, starting at `start`.
Pose extend(const Pose& from, const Pose& to, double share, const Pose& start) {
  const Mat3 dR = rotation_of(to) * rotation_of(from).transpose();
  const Vec3 v = translation_of(to) - dR * translation_of(from);
  const Mat3 step = so3_exp(share * so3_log(dR));
  return make_pose(step * rotation_of(start), step * translation_of(start) + share * v);
}

/// The pose at the middle of a window between two matched ones.
Pose between(const WindowMotion& motion, const Neighbours& ends, std::size_t window) {
  const double t0 = middle_us(motion, ends.before);
  const double t1 = middle_us(motion, ends.after);
  const Pose& before = motion.windows[ends.before].pose[1];
  const double share = t1 > t0 ? (middle_us(motion, window) - t0) / (t1 - t0) : 0.5;
  return extend(before, motion.windows[ends.after].pose[1], share, before);
}

/// Difference of a pose from the expected one, seen at the model's centre.
struct PoseDifference {
  double rotation_rad, lateral, depth;
};

PoseDifference difference(const double (&centre_m)[3], const Pose& pose, const Pose& expected) {
  const Vec3 centre = Eigen::Map<const Vec3>(centre_m);
  const Vec3 at = rotation_of(expected) * centre + translation_of(expected);
  const Vec3 d = rotation_of(pose) * centre + translation_of(pose) - at;
  const double distance = std::max(at.norm(), 1e-9);
  const double depth = d.dot(at) / distance;
  const double lateral2 = std::max(0.0, d.squaredNorm() - depth * depth);
  return {so3_log(rotation_of(pose) * rotation_of(expected).transpose()).norm(), std::sqrt(lateral2) / distance,
          std::abs(depth) / distance};
}

}  // namespace

std::size_t predict_poses(const WindowMotion& motion, std::size_t window, Pose out[kMaxPredictions]) {
  const Neighbours neighbours = neighbours_of(motion, window);
  std::size_t count = 0;
  if (neighbours.both()) out[count++] = between(motion, neighbours, window);
  for (const std::size_t w : {neighbours.before, neighbours.after}) {
    if (w == kNoWindow) continue;
    const WindowTrack& near = motion.windows[w];
    const double span_us = static_cast<double>(motion.times[w].end_us - motion.times[w].begin_us);
    const double share = span_us > 0.0 ? (middle_us(motion, window) - middle_us(motion, w)) / span_us : 0.0;
    const double limited = std::min(kMaxExtrapolation, std::max(-kMaxExtrapolation, share));
    out[count++] = extend(near.pose[0], near.pose[2], limited, near.pose[1]);
    out[count++] = near.pose[1];
  }
  return count;
}

MotionScatter measure_scatter(const WindowMotion& motion, const double (&centre_m)[3], Span<double> scratch) {
  MotionScatter scatter{kMinRotationRad, kMinDistanceShare, kMinDistanceShare, false};
  double PoseDifference::*const parts[] = {&PoseDifference::rotation_rad, &PoseDifference::lateral,
                                           &PoseDifference::depth};
  double MotionScatter::*const medians[] = {&MotionScatter::rotation_rad, &MotionScatter::lateral,
                                            &MotionScatter::depth};
  for (int part = 0; part < 3; ++part) {
    std::size_t count = 0;
    for (std::size_t w = 0; w < motion.windows.size(); ++w) {
      const Neighbours neighbours = neighbours_of(motion, w);
      if (!motion.windows[w].matched || !neighbours.both()) continue;
      const Pose expected = between(motion, neighbours, w);
      scratch[count++] = difference(centre_m, motion.windows[w].pose[1], expected).*parts[part];
    }
    if (count < kMinScatterWindows) return scatter;
    double* const median = scratch.begin() + count / 2;
    std::nth_element(scratch.begin(), median, scratch.begin() + count);
    scatter.*medians[part] = std::max(scatter.*medians[part], *median);
  }
  scatter.known = true;
  return scatter;
}

bool neighbour_prior(const WindowMotion& motion, const MotionScatter& scatter, const double (&centre_m)[3],
                     std::size_t window, PosePrior* out) {
  const Neighbours neighbours = neighbours_of(motion, window);
  if (!scatter.known || !neighbours.both()) return false;
  const Pose mean = between(motion, neighbours, window);
  const double distance = (rotation_of(mean) * Eigen::Map<const Vec3>(centre_m) + translation_of(mean)).norm();
  if (!(distance > 0.0)) return false;
  out->mean = mean;
  std::copy(centre_m, centre_m + 3, out->centre_m);
  out->sigma_rad = kPriorWidth * scatter.rotation_rad;
  out->sigma_lateral_m = kPriorWidth * scatter.lateral * distance;
  out->sigma_depth_m = kPriorWidth * scatter.depth * distance;
  return true;
}

}  // namespace lecalib
