// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "lecalib/core/records.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/solve/refine.hpp"

namespace lecalib {

/// How the points of one model line lie in one view.
struct ViewLineResult {
  std::uint32_t points;   ///< in use; of a line left out, all
  float mean_px, rms_px;  ///< of the distances, positive on the left of the way from p to q as seen in the image
  std::uint16_t line;     ///< index into the model
  bool left_out;          ///< found to be wrong
};

/// One view of a result.
struct ViewResult {
  Pose T_cam_world;
  double rms_px = 0;        ///< of the point distances, unweighted
  std::uint32_t lines = 0;  ///< distinct model lines with a measured point in use
  std::uint32_t points = 0;
  bool used = false;  ///< false: left out, the pose means nothing
  /// 6 x 6 of (w, t), rad and metres: w turns about the camera's axes, R = exp(w) R_true, and t is t_cam_world.
  double covariance[36] = {};
  Span<const ViewLineResult> residuals;  ///< by line, in the order of the model
};

/// Index that names no intrinsic.
inline constexpr std::uint8_t kNoParameter = 0xFF;

/// A calibration and how sure it is. `status` says whether the camera may be used; the rest is filled as far as it was
/// computed, so that a refusal can be explained.
struct CalibrationResult {
  Status status = Status::in_progress;
  std::uint8_t parameter = kNoParameter;  ///< the intrinsic that `undetermined` or `implausible_result` is about
  Camera camera;
  double sigma[kNumIntrinsics] = {};                        ///< one sigma; 0 for a held parameter
  double covariance[kNumIntrinsics * kNumIntrinsics] = {};  ///< of the intrinsics, poses marginalised
  bool assumed[kNumIntrinsics] = {};  ///< held, or known no better than from the prior; not what the model has not
  double rms_px = 0.0;                ///< of the point distances, unweighted, over all views used
  double chi2_per_dof = 0.0;          ///< weighted squares over degrees of freedom; 1 where the given sigmas are true
  double condition = 0.0;             ///< of the unit-diagonal information matrix of the free intrinsics
  int iterations = 0;
  StopReason reason = StopReason::none;
  std::uint32_t points = 0;       ///< of the views used
  std::uint32_t points_lost = 0;  ///< with no image of their line inside the distortion's valid radius
  std::uint32_t views_left_out = 0;
  std::uint32_t lines_left_out = 0;  ///< of all views together: found to be wrong, without weight
  Span<const ViewResult> views;      ///< one per view given; lives in the solver's memory
};

}  // namespace lecalib
