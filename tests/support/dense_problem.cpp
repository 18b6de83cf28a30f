// SPDX-License-Identifier: MIT
#include "support/dense_problem.hpp"

#include "lecalib/math/line_projection.hpp"
#include "support/dense_algebra.hpp"
#include "support/place_along.hpp"

namespace lecalib::test {

Eigen::VectorXd dense_residuals(const CalibrationData& data, const DenseState& at, const Eigen::VectorXd& x) {
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

Eigen::MatrixXd dense_covariance(const CalibrationData& data, const DenseState& at, const ParameterPolicy& policy,
                                 const LineErrorSizes& errors) {
  const auto n = static_cast<Eigen::Index>(9 + 6 * data.views.size());
  const auto num_points = static_cast<Eigen::Index>(data.points.size());
  Eigen::MatrixXd J(num_points + static_cast<Eigen::Index>(3 * data.relative.size()), n);
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
    step(k) = k < 4 ? 1e-3 : 1e-5;
    J.col(k) = (dense_residuals(data, at, step) - dense_residuals(data, at, -step)) / (2.0 * step(k));
  }
  Eigen::MatrixXd N = dense_product(J.transpose(), J);
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
    const Eigen::MatrixXd shifts = dense_product(inverse, dense_product(J.transpose(), moved));
    covariance += dense_product(shifts, shifts.transpose());
  }
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(n);
    for (std::size_t i = 0; i < data.relative.size(); ++i) {
      const Eigen::Index row = num_points + static_cast<Eigen::Index>(3 * i) + axis;
      const double share = data.relative[i].shared_rad / data.relative[i].sigma_rad;
      const Eigen::VectorXd shift = dense_product(inverse, J.row(row).transpose()) * share;
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
  return dense_product(dense_product(to_translation, covariance), to_translation.transpose());
}

}  // namespace lecalib::test
