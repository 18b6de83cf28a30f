// SPDX-License-Identifier: MIT
#include "lecalib/solve/stereo_refiner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lecalib/math/cholesky.hpp"
#include "lecalib/math/packed_cholesky.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

constexpr double kFirstDamping = 1e-4;
constexpr double kLargestDamping = 1e8;
constexpr double kDampingFactor = 10;
/// Below it a step is nearly Gauss and Newton's, and a small predicted decrease means convergence.
constexpr double kNoCaution = 1e-2;
/// At the iteration limit: near enough where the cost would fall by no more than that.
constexpr double kNearEnough = 0.01;

constexpr std::size_t kTail = StereoSolution::kParameters;

}  // namespace

Status StereoRefiner::init(const StereoCamera& left, const StereoCamera& right, Span<const StereoPair> pairs,
                           const Pose& T_right_left, const StereoRefineOptions& options,
                           const StereoRefinerWorkspace& workspace) {
  cameras_[0] = left;
  cameras_[1] = right;
  pairs_ = pairs;
  options_ = options;
  workspace_ = workspace;
  solution_ = StereoSolution();
  solution_.T_right_left = T_right_left;
  iterations_ = 0;
  damping_ = kFirstDamping;
  if ((left.offsets == nullptr) != (right.offsets == nullptr)) return Status::invalid_argument;
  for (std::size_t side = 0; side < kSides; ++side) {
    const StereoCamera& camera = cameras_[side];
    if (camera.refiner->num_turns() > 0) return Status::invalid_argument;
    num_offsets_[side] = is_estimated() ? camera.offsets->size() : camera.responses.size();
    if (camera.refiner->views().size() > workspace.partner[side].size()) return Status::capacity_exceeded;
    for (std::uint32_t& partner : workspace_.partner[side]) partner = kNoView;
  }
  if (!has_room()) return Status::capacity_exceeded;
  if (const Status status = tie_views(); status != Status::ok) return status;
  if (tied_ == 0) return Status::too_few_lines;
  if (!linearise()) return Status::numerical_failure;
  cost_alone_ = cost_;
  place_right_views();
  return linearise() ? Status::ok : Status::numerical_failure;
}

/// Whether the workspace holds the equations.
bool StereoRefiner::has_room() const {
  const StereoRefinerWorkspace& w = workspace_;
  const std::size_t n = size();
  return n - 1 <= std::numeric_limits<std::uint16_t>::max() && w.matrix.size() >= triangle_index(n, 0) &&
         w.tail.size() >= triangle_index(kTail, 0) && w.gradient.size() >= n && w.step.size() >= n &&
         w.columns.size() >= 6 * n && w.active.size() >= n && w.kept_offsets.size() >= n - kTail;
}

/// Ties the pairs of which both views are in use.
Status StereoRefiner::tie_views() {
  tied_ = 0;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const std::uint32_t index[kSides] = {pairs_[i].left, pairs_[i].right};
    bool both_used = true;
    for (std::size_t side = 0; side < kSides; ++side) {
      const Span<RefineView> views = cameras_[side].refiner->views();
      if (index[side] >= views.size() || workspace_.partner[side][index[side]] != kNoView) {
        return Status::invalid_argument;
      }
      both_used = both_used && views[index[side]].used;
    }
    if (!both_used) continue;
    for (std::size_t side = 0; side < kSides; ++side) {
      workspace_.partner[side][index[side]] = static_cast<std::uint32_t>(i);
    }
    ++tied_;
  }
  return Status::ok;
}

const StereoPair* StereoRefiner::pair_of(std::size_t side, std::size_t view) const {
  const std::uint32_t pair = workspace_.partner[side][view];
  return pair == kNoView ? nullptr : &pairs_[pair];
}

void StereoRefiner::place_right_views() {
  const Span<RefineView> left = cameras_[0].refiner->views();
  const Span<RefineView> right = cameras_[1].refiner->views();
  for (std::size_t v = 0; v < right.size(); ++v) {
    const StereoPair* const pair = pair_of(1, v);
    if (pair != nullptr) {
      right[v].pose = product(solution_.T_right_left, product(left[pair->left].pose, pair->symmetry));
    }
  }
}

bool StereoRefiner::linearise() {
  cost_ = offset_cost();
  for (const StereoCamera& camera : cameras_) {
    if (is_estimated()) camera.offsets->correct(camera.corrected);
    if (!camera.refiner->renew_equations()) return false;
    cost_ += camera.refiner->cost();
  }
  return std::isfinite(cost_);
}

double StereoRefiner::offset_cost() const {
  double cost = 0;
  if (!is_estimated()) return cost;
  for (const StereoCamera& camera : cameras_) {
    const EdgeOffsetWorkspace& offsets = camera.offsets->workspace();
    for (std::size_t i = 0; i < camera.offsets->size(); ++i) {
      const double sigmas = (offsets.value[i] - camera.offsets->mean(i)) / offsets.sigma[i];
      cost += camera.refiner->prior_weight() * sigmas * sigmas;
    }
  }
  return cost;
}

/// Moves the poses that were eliminated, at the state that was linearised.
bool StereoRefiner::move_views(double damping) {
  Cholesky<6> factor;
  for (std::size_t side = 0; side < kSides; ++side) {
    const Span<RefineView> views = cameras_[side].refiner->views();
    for (std::size_t v = 0; v < views.size(); ++v) {
      Mat6 block;
      Vec6 gradient;
      std::size_t active = 0;
      if (!gather(side, v, damping, &block, &gradient, &active)) continue;
      if (!factor.factor(block, kMinPosePivot)) return false;
      for (std::size_t a = 0; a < active; ++a) {
        gradient -= workspace_.step[workspace_.active[a]] * Eigen::Map<const Vec6>(&workspace_.columns[6 * a]);
      }
      views[v].pose = moved(views[v].previous, factor.solve(gradient));
    }
  }
  return true;
}

void StereoRefiner::move_shared() {
  for (std::size_t side = 0; side < kSides; ++side) {
    const StereoCamera& camera = cameras_[side];
    Camera intrinsics = camera.refiner->camera();
    for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
      intrinsics.*kIntrinsics[i] += workspace_.step[first_intrinsic(side) + i];
    }
    camera.refiner->set_camera(intrinsics);
    if (!is_estimated()) continue;
    for (std::size_t i = 0; i < num_offsets_[side]; ++i) {
      camera.offsets->workspace().value[i] += workspace_.step[first_offset(side) + i];
    }
  }
  solution_.T_right_left = moved(solution_.T_right_left, Eigen::Map<const Vec6>(&workspace_.step[first_between()]));
}

void StereoRefiner::keep_state() {
  kept_between_ = solution_.T_right_left;
  for (std::size_t side = 0; side < kSides; ++side) {
    const StereoCamera& camera = cameras_[side];
    kept_cameras_[side] = camera.refiner->camera();
    for (RefineView& view : camera.refiner->views()) view.previous = view.pose;
    for (std::size_t i = 0; is_estimated() && i < num_offsets_[side]; ++i) {
      workspace_.kept_offsets[first_offset(side) + i] = camera.offsets->workspace().value[i];
    }
  }
}

void StereoRefiner::restore_state() {
  solution_.T_right_left = kept_between_;
  for (std::size_t side = 0; side < kSides; ++side) {
    const StereoCamera& camera = cameras_[side];
    camera.refiner->set_camera(kept_cameras_[side]);
    for (RefineView& view : camera.refiner->views()) view.pose = view.previous;
    for (std::size_t i = 0; is_estimated() && i < num_offsets_[side]; ++i) {
      camera.offsets->workspace().value[i] = workspace_.kept_offsets[first_offset(side) + i];
    }
  }
}

Status StereoRefiner::step() {
  double decrease = 0;
  if (!build(damping_, &decrease)) return Status::degenerate_geometry;
  if (!factor_equations()) {
    damping_ = std::max(kDampingFactor * damping_, kFirstDamping);
    return damping_ > kLargestDamping ? Status::degenerate_geometry : Status::in_progress;
  }
  for (std::size_t i = 0; i < size(); ++i) workspace_.step[i] = workspace_.gradient[i];
  solve_for_step();
  for (std::size_t i = 0; i < size(); ++i) decrease += workspace_.step[i] * workspace_.gradient[i];
  if (damping_ <= kNoCaution && decrease <= options_.decrease_tolerance * cost_) return finish();
  if (iterations_ >= options_.max_iterations) return decrease <= kNearEnough ? finish() : Status::not_converged;
  ++iterations_;
  keep_state();
  const double cost_before = cost_;
  if (!move_views(damping_)) return Status::degenerate_geometry;
  move_shared();
  place_right_views();
  if (linearise() && cost_ <= cost_before) {
    damping_ /= kDampingFactor;
    return Status::in_progress;
  }
  restore_state();
  if (!linearise()) return Status::numerical_failure;
  damping_ *= kDampingFactor;
  return damping_ > kLargestDamping ? finish() : Status::in_progress;
}

Status StereoRefiner::finish() {
  std::size_t instants = 0;
  double points = 0;
  double data_cost = 0;
  double unknowns = 6;
  for (std::size_t side = 0; side < kSides; ++side) {
    const Refiner& refiner = *cameras_[side].refiner;
    points += static_cast<double>(refiner.points_used());
    data_cost += refiner.data_cost();
    for (std::size_t i = 0; i < kNumIntrinsics; ++i) unknowns += refiner.is_free(i) ? 1 : 0;
    for (std::size_t v = 0; v < refiner.views().size(); ++v) {
      if (refiner.views()[v].used && (side == 0 || pair_of(1, v) == nullptr)) ++instants;
    }
  }
  unknowns += 6 * static_cast<double>(instants);
  solution_.chi2_per_dof = data_cost / std::max(1.0, points - unknowns);
  solution_.scale = std::max(1.0, solution_.chi2_per_dof);
  if (is_estimated() && options_.independent_views > 0) {
    solution_.scale *= std::max(1.0, static_cast<double>(instants) / options_.independent_views);
  }
  // The first pair pays for T_right_left.
  const double ties = 6 * (static_cast<double>(tied_) - 1);
  solution_.tie_chi2_per_dof = ties > 0 ? std::max(0.0, cost_ - cost_alone_) / ties : 0;
  if (!compute_covariance()) return Status::degenerate_geometry;
  const double most = options_.max_tie_chi2_per_dof;
  return most <= 0 || solution_.tie_chi2_per_dof <= most ? Status::ok : Status::implausible_result;
}

/// Of all but the offsets: the inverse's last block, and where offsets are not estimated what each of them does to the
/// solution.
bool StereoRefiner::compute_covariance() {
  const std::size_t first = first_intrinsic(0);
  double ignored = 0;
  if (!build(0, &ignored) || !factor_equations()) return false;
  double* const covariance = solution_.covariance;
  const Span<double> step = workspace_.step.first(size());
  for (std::size_t column = 0; column < kTail; ++column) {
    for (double& value : step) value = 0;
    step[first + column] = 1;
    solve_for_step();
    for (std::size_t row = 0; row < kTail; ++row) {
      covariance[kTail * row + column] = solution_.scale * step[first + row];
    }
  }
  for (std::size_t offset = 0; !is_estimated() && offset < first; ++offset) {
    for (std::size_t i = 0; i < kTail; ++i) step[first + i] = workspace_.matrix[triangle_index(first + i, offset)];
    solve_for_step();
    const double size = options_.line_errors.of(offset);
    const double variance = size * size;
    for (std::size_t row = 0; row < kTail; ++row) {
      for (std::size_t column = 0; column < kTail; ++column) {
        covariance[kTail * row + column] += variance * step[first + row] * step[first + column];
      }
    }
  }
  for (std::size_t side = 0; side < kSides; ++side) {
    for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
      if (cameras_[side].refiner->is_free(i)) continue;
      const std::size_t held = first_intrinsic(side) - first + i;
      for (std::size_t k = 0; k < kTail; ++k) covariance[kTail * held + k] = covariance[kTail * k + held] = 0;
    }
  }
  return true;
}

}  // namespace lecalib
