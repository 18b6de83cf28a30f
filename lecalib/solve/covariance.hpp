// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/solve/calibration_result.hpp"
#include "lecalib/solve/edge_offsets.hpp"
#include "lecalib/solve/refine.hpp"

namespace lecalib {

struct CovarianceOptions {
  /// true: the given sigmas are true, and only worse residuals than they explain widen the covariance (factor
  /// max(1, chi2/dof)). false: only their ratios are, and the residuals set the scale (factor chi2/(dof - 2), from 10
  /// degrees of freedom on).
  bool trust_sigma = true;
  /// What all points of a model line share in all views, besides their own errors: the events of an edge lie towards
  /// its dark side by a few tenths of a pixel, more at one end than at the other where its contrast changes along it,
  /// and more views don't average that out. Points measured in images have none of it.
  LineErrorSizes line_errors;
  /// Views of edges whose errors count as independent, > 0. What an edge is off goes with its motion's direction and
  /// speed, which views share that follow each other: of n more views variances grow by n / independent_views.
  double independent_views = 36;
  /// A parameter whose sigma is above this share of its prior's is listed as assumed. (0, 1]
  double assumed_share = 0.5;
};

/// What the poses' covariances need of the intrinsics'.
struct IntrinsicSpread {
  double inverse[kNumIntrinsics * kNumIntrinsics];  ///< of the reduced matrix; 0 where held
  double scale = 0;                                 ///< of variances; 0: there is no covariance
};

/// Fills sigma, covariance, assumed, chi2_per_dof and condition from a converged refinement: the inverse of the Schur
/// complement of the poses, priors included, plus the covariance of the lines' errors, which are not estimated (a
/// consider covariance: S cov(errors) S' with S the solution's answer to each of them).
/// @param responses kLineErrors per model line; their gradients and shifts are filled where lines have errors
/// @param offsets   of the points' edges, estimated in that refinement: what they leave uncertain is added; may be null
/// @param spread    for compute_pose_covariance(), may be null
/// @return ok | degenerate_geometry (a view's pose or an intrinsic without prior is not determined at all; *result has
/// `parameter` set where it is an intrinsic, and is otherwise unchanged)
Status compute_covariance(const Refiner& refiner, const ParameterPolicy& policy, const CovarianceOptions& options,
                          std::size_t num_views_used, Span<LineResponse> responses, CalibrationResult* result,
                          IntrinsicSpread* spread = nullptr, EdgeOffsets* offsets = nullptr);

/// Fills sigma, covariance and assumed from the intrinsics' covariance, 0 where held.
void take_covariance(const Mat9& covariance, const ParameterPolicy& policy, const CovarianceOptions& options,
                     CalibrationResult* result);

/// The covariance of a view's pose, intrinsics and errors of the lines marginalised. 0 where there is none.
/// @param spread, responses as compute_covariance() left them for the refiner's current state
void compute_pose_covariance(const Refiner& refiner, const CovarianceOptions& options, const IntrinsicSpread& spread,
                             Span<LineResponse> responses, std::size_t view, ViewResult* result);

}  // namespace lecalib
