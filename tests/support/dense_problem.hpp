// SPDX-License-Identifier: MIT
/// The oracle for everything that eliminates poses: the normal equations of a whole calibration at once, from finite
/// differences of all residuals.
#pragma once

#include <doctest/doctest.h>

#include <vector>

#include "lecalib/math/eigen.hpp"
#include "lecalib/solve/covariance.hpp"
#include "lecalib/solve/parameter_policy.hpp"
#include "lecalib/solve/refine.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib::test {

struct DenseState {
  Camera camera;
  std::vector<Pose> poses;
};

/// Views of lines in space; the same scene seed gives the same scene.
inline SyntheticViews spatial_views(std::uint64_t scene_seed, int count, double noise_px, double sigma_px,
                                    std::uint64_t noise_seed) {
  Rng scene_rng(scene_seed);
  Rng noise_rng(noise_seed);
  SyntheticViews s;
  s.camera = make_camera(400.0, 410.0, 322.0, 236.0, -0.15, 0.05);
  s.model = random_lines(scene_rng, 10, 1.2, 0.9, 0.6);
  for (int v = 0; v < count; ++v) s.add_view(looking_pose(scene_rng, 3.0, 0.5), 3, noise_px, sigma_px, noise_rng);
  return s;
}

/// p2 and k3 held, and a prior on cx: one of everything that a policy can say.
inline ParameterPolicy mixed_policy() {
  ParameterPolicy policy;
  policy.free[6] = policy.free[7] = false;
  policy.prior_mean[2] = 320.0;
  policy.prior_sd[2] = 2.0;
  return policy;
}

/// A calibration refined from the truth to its minimum, and the covariance of its intrinsics.
struct RefinedProblem {
  std::vector<RefineView> views;
  std::vector<float> scratch;
  std::vector<LineResponse> responses;
  Refiner refiner;
  CovarianceOptions options;
  CalibrationResult result;
  IntrinsicSpread spread;

  RefinedProblem(const SyntheticViews& truth, const CalibrationData& data, const ParameterPolicy& policy,
                 const LineErrorSizes& errors)
      : scratch(data.points.size()), responses(kLineErrors * data.model.size()) {
    for (const Pose& pose : truth.poses) {
      views.push_back({});
      views.back().pose = pose;
      views.back().used = true;
    }
    refiner.init(data, policy, {}, truth.camera, views, scratch);
    Status status = Status::in_progress;
    while (status == Status::in_progress) status = refiner.step();
    REQUIRE(status == Status::ok);
    options.line_errors = errors;
    REQUIRE(compute_covariance(refiner, policy, options, views.size(), responses, &result, &spread) == Status::ok);
    REQUIRE(result.chi2_per_dof < 1.0);  // so that nothing is widened
  }
  RefinedProblem(const RefinedProblem&) = delete;
  RefinedProblem& operator=(const RefinedProblem&) = delete;

  [[nodiscard]] DenseState state() const {
    DenseState at{refiner.camera(), {}};
    for (const RefineView& view : views) at.poses.push_back(view.pose);
    return at;
  }
  ViewResult pose_covariance(std::size_t view) {
    ViewResult out;
    out.T_cam_world = views[view].pose;
    compute_pose_covariance(refiner, options, spread, responses, view, &out);
    return out;
  }
};

/// All residuals over their sigmas, points first, then three for each known turn; `x` moves the nine intrinsics and six
/// increments (w, v) of each pose.
Eigen::VectorXd dense_residuals(const CalibrationData& data, const DenseState& at, const Eigen::VectorXd& x);

/// The covariance of (intrinsics, w_0, t_0, w_1, t_1, ...), held intrinsics without any. Beside the residuals' own
/// errors: those of the model's lines, and what the known turns have in common.
Eigen::MatrixXd dense_covariance(const CalibrationData& data, const DenseState& at, const ParameterPolicy& policy,
                                 const LineErrorSizes& errors);

}  // namespace lecalib::test
