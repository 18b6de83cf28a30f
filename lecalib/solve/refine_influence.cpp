// SPDX-License-Identifier: MIT
/// How much single points and lines decide of a refined solution: the rest of Refiner.
#include <algorithm>
#include <cmath>

#include "lecalib/math/cholesky.hpp"
#include "lecalib/math/so3.hpp"
#include "lecalib/solve/refine.hpp"

namespace lecalib {
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;

/// Least share of a point's variance that a fit is taken to leave: below, the point alone decides something.
constexpr double kMinLeft = 1e-3;

}  // namespace

/// Adds what the points [first, last), all of one line in one view, contribute.
/// @param eliminated inv(C) E of the view
void Refiner::add_line_response(std::size_t first, std::size_t last, const CameraLine& line, double knee,
                                const Mat69& eliminated, LineResponse* response) const {
  Eigen::Map<Vec9> gradient(response->gradient);
  IdealLine ideal;
  if (!straightened_line(line, knee, &ideal)) return;
  for (std::size_t i = first; i < last; ++i) {
    if (is_left_out(data_, i)) continue;
    const LinePoint& point = data_.points[i];
    LineResidual residual;
    float foot = kNoFoot;
    if (!line_residual(camera_, line, ideal, Vec2(point.u_px, point.v_px), &foot, &residual)) continue;
    const double inverse_sigma = 1.0 / point.sigma_px;
    const double r = residual.value_px * inverse_sigma;
    const double weight =
        evaluate_loss(options_.loss, options_.loss_width, r * r).weight * inverse_sigma * inverse_sigma;
    gradient += weight * (residual.d_intrinsics - residual.d_pose * eliminated).transpose();
  }
}

void Refiner::line_responses(Span<LineResponse> responses) const {
  for (LineResponse& response : responses) response = {};
  const double knee = radius_of_slope(camera_, kKneeSlope);
  Cholesky<6> factor;
  for (std::size_t v = 0; v < views_.size(); ++v) {
    const RefineView& view = views_[v];
    if (!view.used || !factor.factor(pose_block_of(view), kMinPosePivot)) continue;
    const Mat69 eliminated = factor.solve(cross_block_of(view));
    const Mat3 R = rotation_of(view.pose);
    const Vec3 t = translation_of(view.pose);
    const std::size_t end = data_.views[v].first + data_.views[v].count;
    for (std::size_t first = data_.views[v].first, last = first; first < end; first = last) {
      const std::uint16_t line = data_.points[first].line;
      while (last < end && data_.points[last].line == line) ++last;
      add_line_response(first, last, line_in_camera(R, t, data_.model[line]), knee, eliminated, &responses[line]);
    }
  }
}

bool Refiner::standardised_residuals(Span<float> out) const {
  ReducedSystem system;
  Cholesky<9> factor;
  if (!reduce(0.0, &system) || !factor.factor(system.matrix)) return false;
  Eigen::Matrix<double, 9, 9> covariance =
      factor.solve(Eigen::Matrix<double, 9, 9>(Eigen::Matrix<double, 9, 9>::Identity()));
  for (Eigen::Index i = 0; i < 9; ++i) {
    if (!policy_.free[i]) covariance(i, i) = 0.0;
  }
  for (float& value : out) value = 0.0F;
  for (std::size_t v = 0; v < views_.size(); ++v) {
    if (views_[v].used) standardise_view(v, covariance, out);
  }
  return true;
}

void Refiner::standardise_view(std::size_t index, const Eigen::Matrix<double, 9, 9>& covariance,
                               Span<float> out) const {
  const View& span = data_.views[index];
  Cholesky<6> factor;
  if (!factor.factor(pose_block_of(views_[index]), kMinPosePivot)) return;
  const Mat69 eliminated = factor.solve(cross_block_of(views_[index]));
  const Mat6 pose_covariance = factor.solve(Mat6(Mat6::Identity()));
  const Mat3 R = rotation_of(views_[index].pose);
  const Vec3 t = translation_of(views_[index].pose);
  const double knee = radius_of_slope(camera_, kKneeSlope);
  for (std::size_t i = span.first; i < span.first + span.count; ++i) {
    const LinePoint& point = data_.points[i];
    const CameraLine line = line_in_camera(R, t, data_.model[point.line]);
    IdealLine ideal;
    LineResidual residual;
    float foot = kNoFoot;
    out[i] = residuals_[i];
    if (!straightened_line(line, knee, &ideal) ||
        !line_residual(camera_, line, ideal, Vec2(point.u_px, point.v_px), &foot, &residual))
      continue;
    const double inverse_sigma = 1.0 / point.sigma_px;
    const double r = residual.value_px * inverse_sigma;
    const double weight = evaluate_loss(options_.loss, options_.loss_width, r * r).weight;
    const Vec9 a = inverse_sigma * (residual.d_intrinsics - residual.d_pose * eliminated).transpose();
    const Vec6 p = inverse_sigma * residual.d_pose.transpose();
    const double variance = a.dot(covariance.lazyProduct(a)) + p.dot(pose_covariance.lazyProduct(p));
    const double left = is_left_out(data_, i) ? 1.0 : std::max(1.0 - weight * variance, kMinLeft);
    out[i] = static_cast<float>(r / std::sqrt(left));
  }
}

}  // namespace lecalib
