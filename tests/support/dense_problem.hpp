// SPDX-License-Identifier: MIT
/// The oracle for everything that eliminates poses: the normal equations of a whole calibration at once, from finite
/// differences of all residuals.
#pragma once

#include <doctest/doctest.h>

#include <vector>

#include "lecalib/math/line_projection.hpp"
#include "lecalib/solve/covariance.hpp"
#include "lecalib/solve/parameter_policy.hpp"
#include "lecalib/solve/refine.hpp"
#include "support/dense_algebra.hpp"
#include "support/place_along.hpp"
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
inline Eigen::VectorXd dense_residuals(const CalibrationData& data, const DenseState& at, const Eigen::VectorXd& x) {
  Camera camera = at.camera;
  for (std::size_t k = 0; k < kNumIntrinsics; ++k) camera.*kIntrinsics[k] += x(static_cast<Eigen::Index>(k));
  Eigen::VectorXd r(static_cast<Eigen::Index>(data.points.size() + 3 * data.relative.size()));
  std::vector<Mat3> rotations;
  for (std::size_t v = 0; v < data.views.size(); ++v) {
    const Vec3 w = x.segment<3>(static_cast<Eigen::Index>(9 + 6 * v));
    const Vec3 move = x.segment<3>(static_cast<Eigen::Index>(12 + 6 * v));
    const Mat3 R = so3_exp(w) * rotation_of(at.poses[v]);
    const Vec3 t = so3_exp(w) * translation_of(at.poses[v]) + move;
    rotations.push_back(R);
    for (std::size_t i = data.views[v].first; i < data.views[v].first + data.views[v].count; ++i) {
      LineResidual residual;
      REQUIRE(line_residual(camera, valid_radius(camera), line_in_camera(R, t, data.model[data.points[i].line]),
                            Vec2(data.points[i].u_px, data.points[i].v_px), &residual));
      r(static_cast<Eigen::Index>(i)) = residual.value_px() / data.points[i].sigma_px;
    }
  }
  for (std::size_t i = 0; i < data.relative.size(); ++i) {
    const RelativePrior& turn = data.relative[i];
    const Mat3 known = Eigen::Map<const RowMat3>(turn.R_b_a);
    r.segment<3>(static_cast<Eigen::Index>(data.points.size() + 3 * i)) =
        so3_log(rotations[turn.view_b] * rotations[turn.view_a].transpose() * known.transpose()) / turn.sigma_rad;
  }
  return r;
}

/// The covariance of (intrinsics, w_0, t_0, w_1, t_1, ...), held intrinsics without any. Beside the residuals' own
/// errors: those of the model's lines, and what the known turns have in common.
inline Eigen::MatrixXd dense_covariance(const CalibrationData& data, const DenseState& at,
                                        const ParameterPolicy& policy, const LineErrorSizes& errors) {
  const auto n = static_cast<Eigen::Index>(9 + 6 * data.views.size());
  const auto num_points = static_cast<Eigen::Index>(data.points.size());
  Eigen::MatrixXd J(num_points + static_cast<Eigen::Index>(3 * data.relative.size()), n);
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
    step(k) = k < 4 ? 1e-3 : 1e-5;
    J.col(k) = (dense_residuals(data, at, step) - dense_residuals(data, at, -step)) / (2.0 * step(k));
  }
  Eigen::MatrixXd N = J.transpose() * J;
  for (Eigen::Index k = 0; k < 9; ++k) {
    const double sd = policy.prior_sd[k];
    if (sd > 0.0) N(k, k) += 1.0 / (sd * sd);
    if (policy.free[k]) continue;
    N.row(k).setZero();
    N.col(k).setZero();
    N(k, k) = 1e30;
    J.col(k).setZero();
  }
  const Eigen::MatrixXd inverse = dense_inverse(N);
  Eigen::MatrixXd covariance = inverse;
  for (std::size_t line = 0; line < data.model.size(); ++line) {
    Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(J.rows(), 3);
    for (std::size_t v = 0; v < data.views.size(); ++v) {
      for (std::size_t i = data.views[v].first; i < data.views[v].first + data.views[v].count; ++i) {
        const LinePoint& point = data.points[i];
        if (point.line != line) continue;
        const double along = place_along(at.camera, at.poses[v], data.model[line], Vec2(point.u_px, point.v_px));
        moved.row(static_cast<Eigen::Index>(i)) =
            Vec3(errors.offset_px, errors.tilt_px * along, errors.bend_px * (6 * along * along - 0.5)) / point.sigma_px;
      }
    }
    const Eigen::MatrixXd shifts = inverse * (J.transpose() * moved);
    covariance += shifts * shifts.transpose();
  }
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(n);
    for (std::size_t i = 0; i < data.relative.size(); ++i) {
      const Eigen::Index row = num_points + static_cast<Eigen::Index>(3 * i) + axis;
      const double share = data.relative[i].shared_rad / data.relative[i].sigma_rad;
      const Eigen::VectorXd shift = inverse * J.row(row).transpose() * share;
      covariance -= shift * shift.transpose();
      sum += shift;
    }
    covariance += sum * sum.transpose();
  }
  Eigen::MatrixXd to_translation = Eigen::MatrixXd::Identity(n, n);  // t = exp(w) t + v
  for (std::size_t v = 0; v < data.views.size(); ++v) {
    to_translation.block<3, 3>(static_cast<Eigen::Index>(12 + 6 * v), static_cast<Eigen::Index>(9 + 6 * v)) =
        -hat(translation_of(at.poses[v]));
  }
  return to_translation * covariance * to_translation.transpose();
}

}  // namespace lecalib::test
