// SPDX-License-Identifier: MIT
/// The poses that are eliminated together: one view's, or those of two views between which a turn is known.
#pragma once

#include "lecalib/core/records.hpp"
#include "lecalib/math/eigen.hpp"
#include "lecalib/math/so3.hpp"
#include "lecalib/solve/calibration_data.hpp"

namespace lecalib {

/// Part of the normal equations of N = 6 or 12 pose parameters: C, E and h of refine.cpp. C's lower triangle is valid.
template <int N>
struct PoseGroup {
  Eigen::Matrix<double, N, N> block;
  Eigen::Matrix<double, N, 9> cross;
  Eigen::Matrix<double, N, 1> gradient;
};

/// The residual e = log(R_b R_a' R_b_a') of a known turn, about the axes of view b, and its derivatives by the
/// increments w of both poses, R' = exp(w) R. To third order in e, which is small where the turn fits.
struct TurnResidual {
  Vec3 value;
  Mat3 by_a;
  Mat3 by_b;
};

inline TurnResidual turn_residual(const RelativePrior& prior, const Pose& a, const Pose& b) {
  const Mat3 turn = rotation_of(b) * rotation_of(a).transpose();
  TurnResidual out;
  out.value = so3_log(turn * Eigen::Map<const RowMat3>(prior.R_b_a).transpose());
  const Mat3 e = hat(out.value);
  out.by_b = Mat3::Identity() - 0.5 * e + (1.0 / 12.0) * e * e;
  out.by_a = -out.by_b * turn;
  return out;
}

}  // namespace lecalib
