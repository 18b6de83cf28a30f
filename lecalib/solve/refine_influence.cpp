// SPDX-License-Identifier: MIT
/// How much single points and lines decide of a refined solution: the rest of Refiner.
#include <algorithm>
#include <cmath>

#include "lecalib/math/cholesky.hpp"
#include "lecalib/math/so3.hpp"
#include "lecalib/solve/refine.hpp"

namespace lecalib {
namespace {

/// Least share of a point's variance that a fit is taken to leave: below, the point alone decides something.
constexpr double kMinLeft = 1e-3;

}  // namespace

/// Calls visit(point index, residual, its loss weight over sigma^2) for all points of a view whose line has an image,
/// also for those left out; or only for those of one line.
template <class Visit>
void Refiner::visit_points(std::size_t index, double knee, const Visit& visit, std::uint32_t only_line) const {
  const View& span = data_.views[index];
  const Mat3 R = rotation_of(views_[index].pose);
  const Vec3 t = translation_of(views_[index].pose);
  std::uint32_t held_line = 0xFFFFFFFFU;
  CameraLine line{};
  IdealLine ideal{};
  bool visible = false;
  for (std::size_t i = span.first; i < span.first + span.count; ++i) {
    const LinePoint& point = data_.points[i];
    if (only_line != kNoView && point.line != only_line) continue;
    if (point.line != held_line) {
      held_line = point.line;
      line = line_in_camera(R, t, data_.model[held_line]);
      visible = straightened_line(line, knee, &ideal);
    }
    LineResidual residual;
    if (!visible || !line_residual(camera_, line, ideal, Vec2(point.u_px, point.v_px), nullptr, &residual)) continue;
    const double precision = 1.0 / (point.sigma_px * point.sigma_px);
    const double r2 = residual.value_px() * residual.value_px() * precision;
    visit(i, residual, evaluate_loss(options_.loss, options_.loss_width, r2).weight * precision);
  }
}

/// A view's rows of inv(C) E, and its blocks of inv(C) with itself and with its partner (0 where it has none).
bool Refiner::pose_solution(std::size_t view, Mat69* eliminated, Mat6* own, Mat6* partner) const {
  if (views_[view].partner == kNoView) {
    Cholesky<6> factor;
    if (!factor.factor(pose_block_of(views_[view]), kMinPosePivot)) return false;
    *eliminated = factor.solve(cross_block_of(views_[view]));
    *own = factor.inverse();
    partner->setZero();
    return true;
  }
  PoseGroup<12> group;
  gather(view, &group);
  Cholesky<12> factor;
  if (!factor.factor(group.block, kMinPosePivot)) return false;
  *eliminated = factor.solve(group.cross).topRows<6>();
  const Eigen::Matrix<double, 12, 12> inverse = factor.inverse();
  *own = inverse.topLeftCorner<6, 6>();
  *partner = inverse.topRightCorner<6, 6>();
  return true;
}

/// How much the errors of its line move a point of a view.
void Refiner::factors_of_errors(std::size_t view, std::size_t point, double (&factors)[kLineErrors]) const {
  const LinePoint& at = data_.points[point];
  const ModelLine& line = data_.model[at.line];
  const Pose& pose = views_[view].pose;
  const Vec3 begin = rotation_of(pose) * Vec3(line.p[0], line.p[1], line.p[2]) + translation_of(pose);
  const CameraLine seen = line_in_camera(rotation_of(pose), translation_of(pose), line);
  const Vec2 pixel(at.u_px, at.v_px);
  Vec2 ideal = roughly_undistorted(camera_, pixel);
  static_cast<void>(unproject(camera_, pixel, &ideal));  // false beyond the fold, where roughly is near enough
  const Vec3 ray(ideal(0), ideal(1), 1.0);
  const Vec3 across = seen.direction.cross(ray);  // begin + f direction lies on the ray
  const double along = -begin.cross(ray).dot(across) / across.squaredNorm() - 0.5;
  factors[0] = 1;
  factors[1] = std::clamp(along, -0.5, 0.5);
  factors[2] = bend_at(factors[1]);
}

void Refiner::line_responses(Span<LineResponse> responses) const {
  for (LineResponse& response : responses) response = {};
  const double knee = radius_of_slope(camera_, kKneeSlope);
  for (std::size_t v = 0; v < views_.size(); ++v) {
    Mat69 eliminated;
    Mat6 own;
    Mat6 partner;
    if (!views_[v].used || !pose_solution(v, &eliminated, &own, &partner)) continue;
    visit_points(v, knee, [&](std::size_t i, const LineResidual& residual, double weight) {
      if (is_left_out(data_, i)) return;
      const Vec9 row = weight * (residual.d_intrinsics() - residual.d_pose() * eliminated).transpose();
      double factors[kLineErrors];
      factors_of_errors(v, i, factors);
      for (std::size_t k = 0; k < kLineErrors; ++k) {
        Eigen::Map<Vec9>(responses[kLineErrors * data_.points[i].line + k].gradient) += factors[k] * row;
      }
    });
  }
}

void Refiner::add_line_rows(std::size_t view, Span<LineResponse> responses) const {
  for (LineResponse& response : responses) Eigen::Map<Vec6>(response.pose).setZero();
  visit_points(view, radius_of_slope(camera_, kKneeSlope),
               [&](std::size_t i, const LineResidual& residual, double weight) {
                 if (is_left_out(data_, i)) return;
                 double factors[kLineErrors];
                 factors_of_errors(view, i, factors);
                 for (std::size_t k = 0; k < kLineErrors; ++k) {
                   LineResponse& response = responses[kLineErrors * data_.points[i].line + k];
                   Eigen::Map<Vec9>(response.gradient) += factors[k] * weight * residual.d_intrinsics().transpose();
                   Eigen::Map<Vec6>(response.pose) += factors[k] * weight * residual.d_pose().transpose();
                 }
               });
}

bool Refiner::pose_covariance(std::size_t view, const Mat9& inverse, double scale, const LineErrorSizes& errors,
                              Span<LineResponse> responses, Mat6* out) const {
  Mat69 eliminated;
  Mat6 own;
  Mat6 partner;
  if (!pose_solution(view, &eliminated, &own, &partner)) return false;
  const Mat69 spread = eliminated.lazyProduct(inverse);
  *out = scale * (own + Mat6(spread.lazyProduct(eliminated.transpose())));
  if (!errors.any()) return true;
  for (LineResponse& response : responses) Eigen::Map<Vec6>(response.pose).setZero();
  const double knee = radius_of_slope(camera_, kKneeSlope);
  const auto add_view = [&](std::size_t of, const Mat6& block) {
    visit_points(of, knee, [&](std::size_t i, const LineResidual& residual, double weight) {
      if (is_left_out(data_, i)) return;
      const Vec6 answer = weight * block.lazyProduct(residual.d_pose().transpose());
      double factors[kLineErrors];
      factors_of_errors(of, i, factors);
      for (std::size_t k = 0; k < kLineErrors; ++k) {
        Eigen::Map<Vec6>(responses[kLineErrors * data_.points[i].line + k].pose) += factors[k] * answer;
      }
    });
  };
  add_view(view, own);
  if (views_[view].partner != kNoView) add_view(views_[view].partner, partner);
  for (std::size_t i = 0; i < responses.size(); ++i) {
    const Vec6 shift = errors.of(i) * (Eigen::Map<const Vec6>(responses[i].pose) -
                                       Vec6(eliminated.lazyProduct(Eigen::Map<const Vec9>(responses[i].shift))));
    *out += shift * shift.transpose();
  }
  return true;
}

bool Refiner::standardised_residuals(Span<float> out) const {
  ReducedSystem system;
  Cholesky<9> factor;
  if (!reduce(0.0, &system) || !factor.factor(system.matrix)) return false;
  Mat9 covariance = factor.inverse();
  for (Eigen::Index i = 0; i < 9; ++i) {
    if (!policy_.free[i]) covariance(i, i) = 0.0;
  }
  for (float& value : out) value = 0.0F;
  for (std::size_t v = 0; v < views_.size(); ++v) {
    if (views_[v].used) standardise_view(v, covariance, out);
  }
  return true;
}

void Refiner::standardise_view(std::size_t index, const Mat9& covariance, Span<float> out) const {
  const View& span = data_.views[index];
  Mat69 eliminated;
  Mat6 pose_covariance;
  Mat6 partner;
  if (!pose_solution(index, &eliminated, &pose_covariance, &partner)) return;
  for (std::size_t i = span.first; i < span.first + span.count; ++i) out[i] = residuals_[i];
  visit_points(
      index, radius_of_slope(camera_, kKneeSlope), [&](std::size_t i, const LineResidual& residual, double weight) {
        const Vec9 a = (residual.d_intrinsics() - residual.d_pose() * eliminated).transpose();
        const Vec6 p = residual.d_pose().transpose();
        const double variance = a.dot(covariance.lazyProduct(a)) + p.dot(pose_covariance.lazyProduct(p));
        const double sigma = data_.points[i].sigma_px;
        const double left =
            is_left_out(data_, i) ? 1.0 + variance / (sigma * sigma) : std::max(1.0 - weight * variance, kMinLeft);
        out[i] = static_cast<float>(residual.value_px() / (sigma * std::sqrt(left)));
      });
}

/// With the rows B of the line's whitened derivatives (all parameters together have the covariance I), its weights W
/// and residuals r: without the line the parameters are off by y = inv(I - B'WB) B'Wr, its residuals r + B y, and their
/// covariance I + B inv(I - B'WB) B', whose inverse is I - B inv(I - B'WB + B'B) B'.
double Refiner::line_misfit(const ReducedSystem& system, std::size_t view, std::uint16_t line,
                            std::size_t* points) const {
  using Vec15 = Eigen::Matrix<double, 15, 1>;
  using Mat15 = Eigen::Matrix<double, 15, 15>;
  *points = 0;
  Mat69 eliminated;
  Mat6 own;
  Mat6 partner;
  Cholesky<9> intrinsics;
  Cholesky<6> pose;
  if (!intrinsics.factor(system.matrix) || !pose_solution(view, &eliminated, &own, &partner) || !pose.factor(own) ||
      !pose.factor(pose.inverse())) {
    return 0.0;
  }
  Mat15 all = Mat15::Zero();
  Mat15 without = Mat15::Identity();
  Vec15 seen = Vec15::Zero();
  Vec15 pull = Vec15::Zero();
  double squares = 0.0;
  bool any_used = false;
  const View& span = data_.views[view];
  for (std::size_t i = span.first; i < span.first + span.count; ++i) {
    any_used = any_used || (data_.points[i].line == line && !is_left_out(data_, i));
  }
  const auto add_point = [&](std::size_t i, const LineResidual& residual, double weight) {
    if (any_used && is_left_out(data_, i)) return;
    const double sigma = data_.points[i].sigma_px;
    Vec9 a = (residual.d_intrinsics() - residual.d_pose() * eliminated).transpose() / sigma;
    for (Eigen::Index k = 0; k < 9; ++k) a(k) = policy_.free[k] ? a(k) : 0.0;
    Vec15 row;
    row << intrinsics.whiten(a), pose.whiten(Vec6(residual.d_pose().transpose() / sigma));
    const double r = residual.value_px() / sigma;
    const double used = is_left_out(data_, i) ? 0.0 : weight * sigma * sigma;
    all += row * row.transpose();
    without -= used * row * row.transpose();
    seen += r * row;
    pull -= used * r * row;
    squares += r * r;
    ++*points;
  };
  visit_points(view, radius_of_slope(camera_, kKneeSlope), add_point, line);
  Cholesky<15> factor;
  if (!factor.factor(without, kMinLeft)) return 0.0;
  const Vec15 moved = -factor.solve(pull);
  squares += 2.0 * seen.dot(moved) + moved.dot(all.lazyProduct(moved));
  seen += all.lazyProduct(moved);
  if (!factor.factor(Mat15(without + all))) return 0.0;
  return squares - factor.whiten(seen).squaredNorm();
}

}  // namespace lecalib
