// SPDX-License-Identifier: MIT
/// Rotations: exponential and logarithm, and the rotation nearest to a matrix.
#pragma once

#include "lecalib/core/records.hpp"
#include "lecalib/math/eigen.hpp"

namespace lecalib {

/// hat(a) b = a x b.
Mat3 hat(const Vec3& a);

/// The rotation by |w| rad about w (Rodrigues). Orthonormal to a few eps.
Mat3 so3_exp(const Vec3& w);

/// The rotation vector of R, |w| <= pi; so3_exp(so3_log(R)) = R to 1e-14. R must be a rotation to rounding.
Vec3 so3_log(const Mat3& R);

/// The proper rotation R that minimises |R - A| (Horn 1987: the largest eigenvector of a 4 x 4 matrix). Defined for any
/// A of rank 2 or more, also with det A < 0.
Mat3 nearest_rotation(const Mat3& A);

inline Mat3 rotation_of(const Pose& pose) { return Eigen::Map<const RowMat3>(pose.R); }
inline Vec3 translation_of(const Pose& pose) { return Eigen::Map<const Vec3>(pose.t); }
inline Pose make_pose(const Mat3& R, const Vec3& t) {
  Pose pose;
  Eigen::Map<RowMat3>(pose.R) = R;
  Eigen::Map<Vec3>(pose.t) = t;
  return pose;
}

/// The pose after an increment (w, v): x' = exp(w) x + v of what it maps to.
inline Pose moved(const Pose& pose, const Vec6& increment) {
  const Mat3 turn = so3_exp(increment.head<3>());
  return make_pose(turn * rotation_of(pose), turn * translation_of(pose) + increment.tail<3>());
}
/// First a, then b: x' = b(a(x)).
inline Pose product(const Pose& b, const Pose& a) {
  return make_pose(rotation_of(b) * rotation_of(a), rotation_of(b) * translation_of(a) + translation_of(b));
}
inline Pose inverse_of(const Pose& pose) {
  const Mat3 R = rotation_of(pose).transpose();
  return make_pose(R, -R * translation_of(pose));
}

}  // namespace lecalib
