// SPDX-License-Identifier: MIT
/// Known turns between two views in the refinement: a part of Refiner.
#include "lecalib/math/cholesky.hpp"
#include "lecalib/solve/refine.hpp"

namespace lecalib {
namespace {

Eigen::Matrix<double, 6, 1> gradient_of(const RefineView& view) {
  return Eigen::Map<const Eigen::Matrix<double, 6, 1>>(view.pose_gradient);
}

/// The residual's derivative by both poses' increments, in the order of PoseGroup<12> gathered for `view`.
Eigen::Matrix<double, 3, 12> turn_jacobian(const RelativePrior& turn, std::size_t view, const TurnResidual& residual) {
  Eigen::Matrix<double, 3, 12> J = Eigen::Matrix<double, 3, 12>::Zero();
  J.middleCols<3>(turn.view_a == view ? 0 : 6) = residual.by_a;
  J.middleCols<3>(turn.view_a == view ? 6 : 0) = residual.by_b;
  return J;
}

}  // namespace

/// A turn counts where both of its views are used.
void Refiner::pair_views() {
  for (RefineView& view : views_) view.partner = kNoView;
  for (std::size_t i = 0; i < data_.relative.size(); ++i) {
    const RelativePrior& turn = data_.relative[i];
    RefineView& a = views_[turn.view_a];
    RefineView& b = views_[turn.view_b];
    if (!a.used || !b.used) continue;
    a.partner = turn.view_b;
    b.partner = turn.view_a;
    a.turn = b.turn = static_cast<std::uint32_t>(i);
  }
}

double Refiner::turn_precision(std::size_t turn) const {
  const double sigma = data_.relative[turn].sigma_rad;
  return prior_weight_ / (sigma * sigma);
}

void Refiner::gather(std::size_t view, PoseGroup<6>* out) const {
  out->block = pose_block_of(views_[view]);
  out->cross = cross_block_of(views_[view]);
  out->gradient = gradient_of(views_[view]);
}

/// The view's parameters come first, its partner's behind.
void Refiner::gather(std::size_t view, PoseGroup<12>* out) const {
  const RefineView& first = views_[view];
  const RefineView& second = views_[first.partner];
  out->block.topLeftCorner<6, 6>() = pose_block_of(first);
  out->block.bottomRightCorner<6, 6>() = pose_block_of(second);
  out->block.topRightCorner<6, 6>().setZero();
  out->block.bottomLeftCorner<6, 6>().setZero();
  out->cross.topRows<6>() = cross_block_of(first);
  out->cross.bottomRows<6>() = cross_block_of(second);
  out->gradient.head<6>() = gradient_of(first);
  out->gradient.tail<6>() = gradient_of(second);
  const RelativePrior& turn = data_.relative[first.turn];
  const TurnResidual residual = turn_residual(turn, views_[turn.view_a].pose, views_[turn.view_b].pose);
  const double precision = turn_precision(first.turn);
  const Eigen::Index a = turn.view_a == view ? 0 : 6;
  const Eigen::Index b = 6 - a;
  out->block.block<3, 3>(a, a) += precision * residual.by_a.transpose() * residual.by_a;
  out->block.block<3, 3>(b, b) += precision * residual.by_b.transpose() * residual.by_b;
  out->block.block<3, 3>(a, b) += precision * residual.by_a.transpose() * residual.by_b;
  out->block.block<3, 3>(b, a) += precision * residual.by_b.transpose() * residual.by_a;
  out->gradient.segment<3>(a) -= precision * residual.by_a.transpose() * residual.value;
  out->gradient.segment<3>(b) -= precision * residual.by_b.transpose() * residual.value;
}

Eigen::Matrix<double, 9, 3> Refiner::turn_response(std::size_t index) const {
  const RelativePrior& turn = data_.relative[index];
  Eigen::Matrix<double, 9, 3> response = Eigen::Matrix<double, 9, 3>::Zero();
  if (views_[turn.view_a].partner != turn.view_b) return response;
  PoseGroup<12> group;
  gather(turn.view_a, &group);
  Cholesky<12> factor;
  if (!factor.factor(group.block, kMinPosePivot)) return response;
  const auto J =
      turn_jacobian(turn, turn.view_a, turn_residual(turn, views_[turn.view_a].pose, views_[turn.view_b].pose));
  const Eigen::Matrix<double, 12, 3> gradient = turn_precision(index) * turn.shared_rad * J.transpose();
  response = -factor.solve(group.cross).transpose().lazyProduct(gradient);
  return response;
}

double Refiner::parameters_from_turns(const Eigen::Matrix<double, 9, 9>& inverse) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < data_.relative.size(); ++i) {
    const RelativePrior& turn = data_.relative[i];
    PoseGroup<12> group;
    Cholesky<12> factor;
    if (views_[turn.view_a].partner != turn.view_b) continue;
    gather(turn.view_a, &group);
    if (!factor.factor(group.block, kMinPosePivot)) continue;
    const auto J =
        turn_jacobian(turn, turn.view_a, turn_residual(turn, views_[turn.view_a].pose, views_[turn.view_b].pose));
    const Eigen::Matrix<double, 12, 3> answer = factor.solve(Eigen::Matrix<double, 12, 3>(J.transpose()));
    const Eigen::Matrix<double, 9, 3> seen = group.cross.transpose().lazyProduct(answer);
    const Mat3 covariance = Mat3(J.lazyProduct(answer)) + Mat3(seen.transpose().lazyProduct(inverse.lazyProduct(seen)));
    sum += turn_precision(i) * covariance.trace();
  }
  return sum;
}

}  // namespace lecalib
