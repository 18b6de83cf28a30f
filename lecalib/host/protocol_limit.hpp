// SPDX-License-Identifier: MIT
/// The statistical limit (Cramer-Rao bound) of a trial: how well its points determine the camera, whoever looks at
/// them.
#pragma once

#include "lecalib/core/records.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/host/protocol.hpp"
#include "lecalib/math/eigen.hpp"

namespace lecalib::host {

/// fx fy cx cy k1 k2 and the pose's (w, v) of the update x_cam' = exp(w) x_cam + v.
inline constexpr int kTrialParameters = 12;
using TrialMatrix = Eigen::Matrix<double, kTrialParameters, kTrialParameters>;
using TrialVector = Eigen::Matrix<double, kTrialParameters, 1>;

struct TrialLimit {
  /// Inverse Fisher information at the truth for Gaussian noise of 1 px, all twelve parameters free: with J the
  /// derivatives of the end points' distances from their lines in the distorted image, inverse(J' J).
  TrialMatrix covariance;
  /// What an efficient unbiased estimator is off with the noise of this very trial, to first order:
  /// inverse(J' J) J' n with n the noise across the lines, less its mean. Over trials of one scene its covariance is
  /// sigma^2 inverse(J' J); having the noise in common with an estimator under test, it is compared with little
  /// scatter.
  TrialVector error;
};

/// @param model trial.planar or trial.spatial
/// @return false, *out unchanged, where the points leave a parameter undetermined
bool find_limit(const Trial& trial, Span<const ModelLine> model, TrialLimit* out);

/// The true camera and pose, off by `error`.
void displace(const Trial& trial, const TrialVector& error, Camera* camera, Pose* T_cam_world);

}  // namespace lecalib::host
