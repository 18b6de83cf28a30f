// SPDX-License-Identifier: MIT
#include "lecalib/match/match_hints.hpp"

#include <cmath>

namespace lecalib {
namespace {

/// R'R of a rotation that was written down with few digits is the identity to about this.
constexpr double kMaxSkew = 1e-2;

}  // namespace

bool MatchHints::valid() const {
  if (!(focal_px >= 0.0) || !std::isfinite(focal_px) || !(focal_share > 0.0 && focal_share < 1.0)) return false;
  if (!(turn_rad > 0.0) || !(shift_share > 0.0 && shift_share < 1.0)) return false;
  if (!has_pose) return true;
  const Mat3 R = rotation_of(T_cam_world);
  return R.allFinite() && translation_of(T_cam_world).allFinite() && R.determinant() > 0.0 &&
         (R.transpose() * R - Mat3::Identity()).norm() < kMaxSkew;
}

bool MatchHints::agrees_with_focal(double f_px) const {
  return !(focal_px > 0.0) || std::abs(f_px - focal_px) <= focal_share * focal_px;
}

bool MatchHints::agrees_with_pose(const Pose& pose, const double (&centre_m)[3]) const {
  if (!has_pose) return true;
  const Mat3 R = rotation_of(T_cam_world);
  const Vec3 centre = Eigen::Map<const Vec3>(centre_m);
  const Vec3 expected = R * centre + translation_of(T_cam_world);
  const Vec3 found = rotation_of(pose) * centre + translation_of(pose);
  return so3_log(rotation_of(pose) * R.transpose()).norm() <= turn_rad &&
         (found - expected).norm() <= shift_share * expected.norm();
}

}  // namespace lecalib
