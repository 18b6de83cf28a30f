// SPDX-License-Identifier: MIT
/// Known turns between two views in the refinement: a part of Refiner.
#include "lecalib/math/cholesky.hpp"
#include "lecalib/solve/refine.hpp"

namespace lecalib {
namespace {

using TurnJacobian = Eigen::Matrix<double, 3, 12>;

Vec6 gradient_of(const RefineView& view) { return Eigen::Map<const Vec6>(view.pose_gradient); }

/// The residual's derivative by both poses' increments, in the order of PoseGroup<12> gathered for `view`.
TurnJacobian turn_jacobian(const RelativePrior& turn, std::size_t view, const TurnResidual& residual) {
  TurnJacobian J = TurnJacobian::Zero();
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
  const RefineView* const views[] = {&views_[view], &views_[views_[view].partner]};
  out->block.setZero();
  for (Eigen::Index k = 0; k < 2; ++k) {
    out->block.block<6, 6>(6 * k, 6 * k) = pose_block_of(*views[k]);
    out->cross.middleRows<6>(6 * k) = cross_block_of(*views[k]);
    out->gradient.segment<6>(6 * k) = gradient_of(*views[k]);
  }
  const RelativePrior& turn = data_.relative[views[0]->turn];
  const TurnResidual residual = turn_residual(turn, views_[turn.view_a].pose, views_[turn.view_b].pose);
  const TurnJacobian J = turn_jacobian(turn, view, residual);
  const TurnJacobian weighted = turn_precision(views[0]->turn) * J;
  out->block += weighted.transpose().lazyProduct(J);
  out->gradient -= weighted.transpose().lazyProduct(residual.value);
}

/// The two poses' answer to a change of the turn's residual, as far as it changes that residual, and the reduced
/// gradient.
/// @return false, outputs unchanged, where one of its views is not used or their poses are not determined
bool Refiner::answer_to_turn(std::size_t index, Mat3* residual, Eigen::Matrix<double, 9, 3>* gradient) const {
  const RelativePrior& turn = data_.relative[index];
  if (views_[turn.view_a].partner != turn.view_b) return false;
  PoseGroup<12> group;
  gather(turn.view_a, &group);
  Cholesky<12> factor;
  if (!factor.factor(group.block, kMinPosePivot)) return false;
  const TurnJacobian J =
      turn_jacobian(turn, turn.view_a, turn_residual(turn, views_[turn.view_a].pose, views_[turn.view_b].pose));
  const Eigen::Matrix<double, 12, 3> poses = factor.solve(Eigen::Matrix<double, 12, 3>(J.transpose()));
  *residual = J.lazyProduct(poses);
  *gradient = group.cross.transpose().lazyProduct(poses);
  return true;
}

Eigen::Matrix<double, 9, 3> Refiner::turn_response(std::size_t index) const {
  Mat3 residual;
  Eigen::Matrix<double, 9, 3> gradient;
  if (!answer_to_turn(index, &residual, &gradient)) return Eigen::Matrix<double, 9, 3>::Zero();
  return -turn_precision(index) * data_.relative[index].shared_rad * gradient;
}

double Refiner::parameters_from_turns(const Mat9& inverse) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < data_.relative.size(); ++i) {
    Mat3 residual;
    Eigen::Matrix<double, 9, 3> gradient;
    if (!answer_to_turn(i, &residual, &gradient)) continue;
    // The trace of the residual's covariance.
    sum += turn_precision(i) * (residual.trace() + gradient.cwiseProduct(inverse.lazyProduct(gradient)).sum());
  }
  return sum;
}

}  // namespace lecalib
