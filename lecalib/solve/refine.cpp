// SPDX-License-Identifier: MIT
/// Normal equations of residuals r_i with intrinsics a (9) and the pose p_v (6) of view v:
///
///     [ B    E_1'  E_2' ... ] [ da   ]   [ g   ]         B = sum J_a' w J_a      E_v = sum J_p' w J_a
///     [ E_1  C_1            ] [ dp_1 ] = [ h_1 ]       C_v = sum J_p' w J_p
///     [ E_2       C_2       ] [ dp_2 ]   [ h_2 ]         g = -sum J_a' w r       h_v = -sum J_p' w r
///
/// Each C_v is 6 x 6 and eliminated by itself: S = B - sum E_v' inv(C_v) E_v. Where a turn between two views is known,
/// C_v is 12 x 12 and that of both. Damping follows Marquardt (lambda times the diagonal) with Nielsen's update of
/// lambda.
#include "lecalib/solve/refine.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "lecalib/math/cholesky.hpp"
#include "lecalib/math/gram.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

constexpr double kInitialDamping = 1e-4;
constexpr double kMaxDamping = 1e10;
/// Below it a step is nearly Gauss-Newton's, so that a small predicted decrease means convergence and not mere caution.
constexpr double kTrustedDamping = 1e-2;
constexpr double kMinDamping = 1e-15;
/// Of the damping after a rejected step; and before any step is accepted, when nothing tells yet where between the
/// weakest direction's share of 1e-10 and 1 it has to be.
constexpr double kDampingGrowth = 2.0;
constexpr double kFirstDampingGrowth = 10.0;

/// Where the iteration limit comes, a minimum that the undamped step would reach within so many sigmas is near enough:
/// steps along a valley that bends stay small however near the goal is.
constexpr double kSettledSigmas = 0.1;

}  // namespace

const char* to_string(StopReason reason) noexcept {
  switch (reason) {
    case StopReason::none: return "none";
    case StopReason::small_decrease: return "small_decrease";
    case StopReason::small_step: return "small_step";
    case StopReason::no_descent: return "no_descent";
    case StopReason::iteration_limit: return "iteration_limit";
    case StopReason::numerical_failure: return "numerical_failure";
    case StopReason::settled: return "settled";
  }
  return "unknown";
}

void Refiner::init(const CalibrationData& data, const ParameterPolicy& policy, const RefineOptions& options,
                   const Camera& camera, Span<RefineView> views, Span<float> residuals, Span<float> feet) {
  LECALIB_ASSERT(views.size() == data.views.size() && residuals.size() >= data.points.size());
  LECALIB_ASSERT(feet.empty() || feet.size() >= data.points.size());
  data_ = data;
  policy_ = policy;
  options_ = options;
  views_ = views;
  residuals_ = residuals;
  feet_ = feet;
  for (float& foot : feet_) foot = kNoFoot;
  camera_ = camera;
  iterations_ = 0;
  num_free_ = 0;
  damping_ = kInitialDamping;
  linearised_ = false;
  for (int i = 0; i < static_cast<int>(kNumIntrinsics); ++i) {
    if (policy.free[i]) free_[num_free_++] = i;
  }
  pair_views();
  set_loss(options.loss, options.loss_width, 1.0);
  damping_growth_ = kFirstDampingGrowth;
}

void Refiner::set_loss(Loss loss, double width, double sigma_scale) {
  // Where neither loss tells any residual from its square, the equations of the data stay as they are.
  const bool same = linearised_ && all_within(options_.loss, options_.loss_width) && all_within(loss, width);
  options_.loss = loss;
  options_.loss_width = width;
  prior_weight_ = sigma_scale * sigma_scale;
  damping_ = std::min(damping_, kInitialDamping);
  damping_growth_ = kDampingGrowth;
  linearised_ = same;
  if (same) add_priors();
  reason_ = StopReason::none;
}

bool Refiner::all_within(Loss loss, double width) const {
  if (loss == Loss::squared) return true;
  if (loss != Loss::huber) return false;
  for (std::size_t v = 0; v < views_.size(); ++v) {
    if (!views_[v].used) continue;
    const View& span = data_.views[v];
    for (std::size_t i = span.first; i < span.first + span.count; ++i) {
      if (!is_left_out(data_, i) && !(std::abs(static_cast<double>(residuals_[i])) < width)) return false;
    }
  }
  return true;
}

/// Normal equations and residuals of one view.
/// @return false where the cost has passed `most_cost`: nobody wants the rest then
bool Refiner::linearise_view(std::size_t index, double knee, double most_cost) {
  constexpr int kPose = LineResidual::kPose;
  constexpr int kCamera = LineResidual::kIntrinsics;
  constexpr int kFew = 6;  // intrinsics that are free at most, where only the first ones are
  const int free_end = num_free_ == 0 ? 0 : free_[num_free_ - 1] + 1;
  const View& span = data_.views[index];
  RefineView& view = views_[index];
  const Mat3 R = rotation_of(view.pose);
  const Vec3 t = translation_of(view.pose);
  Gram<kCamera + 9> sum;
  std::uint32_t held_line = 0xFFFFFFFFU;
  CameraLine line{};
  IdealLine ideal{};
  bool visible = false;
  for (std::size_t i = span.first; i < span.first + span.count; ++i) {
    const LinePoint& point = data_.points[i];
    if (point.line != held_line) {
      held_line = point.line;
      line = line_in_camera(R, t, data_.model[held_line]);
      visible = straightened_line(line, knee, &ideal);
    }
    LineResidual residual;
    const bool counts = !is_left_out(data_, i);
    if (counts) ++points_used_;
    float* const foot = feet_.empty() ? nullptr : &feet_[i];
    if (!visible || !line_residual(camera_, line, ideal, Vec2(point.u_px, point.v_px), foot, &residual)) {
      residuals_[i] = static_cast<float>(kLostSigmas);
      if (!counts) continue;
      ++points_lost_;
      data_cost_ += evaluate_loss(options_.loss, options_.loss_width, kLostSigmas * kLostSigmas).rho;
      continue;
    }
    const double inverse_sigma = 1.0 / point.sigma_px;
    const double r = residual.value_px() * inverse_sigma;
    const LossValue loss = evaluate_loss(options_.loss, options_.loss_width, r * r);
    residuals_[i] = static_cast<float>(r);
    if (!counts) continue;
    data_cost_ += loss.rho;
    if (data_cost_ > most_cost) return false;
    const double gain = loss.weight == 1.0 ? inverse_sigma : std::sqrt(loss.weight) * inverse_sigma;
    if (free_end <= kFew) {
      sum.add<kCamera + kFew>(gain, residual.row);
    } else {
      sum.add<kCamera + 9>(gain, residual.row);
    }
  }
  for (int j = 0; j < 6; ++j) {
    view.pose_gradient[j] = -sum(0, kPose + j);
    for (int i = 0; i < 6; ++i) view.pose_block[6 * j + i] = sum(kPose + i, kPose + j);
  }
  for (double& entry : view.cross_block) entry = 0.0;
  for (int j = 0; j < free_end; ++j) {
    data_gradient_(j) -= sum(0, kCamera + j);
    for (int i = j; i < free_end; ++i) data_block_(i, j) += sum(kCamera + j, kCamera + i);
    if (!policy_.free[static_cast<std::size_t>(j)]) continue;
    for (int i = 0; i < 6; ++i) view.cross_block[6 * j + i] = sum(kPose + i, kCamera + j);
  }
  return true;
}

/// Of the prior on one intrinsic by itself; 0 where there is none.
double Refiner::prior_precision(std::size_t i) const {
  if (!policy_.free[i] || !(policy_.prior_sd[i] > 0.0)) return 0.0;
  return prior_weight_ / (policy_.prior_sd[i] * policy_.prior_sd[i]);
}

/// Of the prior on fy - fx, px^-2; 0 where there is none.
double Refiner::aspect_precision() const {
  if (!(policy_.aspect_sd > 0.0) || !policy_.free[0] || !policy_.free[1]) return 0.0;
  const double sd_px = policy_.aspect_sd * 0.5 * (camera_.fx + camera_.fy);
  return prior_weight_ / (sd_px * sd_px);
}

Mat9 Refiner::prior_information() const {
  Vec9 own;
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) own(static_cast<Eigen::Index>(i)) = prior_precision(i);
  Mat9 information = own.asDiagonal();
  const double aspect = aspect_precision();
  information(0, 0) += aspect;
  information(1, 1) += aspect;
  information(0, 1) = information(1, 0) = -aspect;
  return information;
}

void Refiner::add_priors() {
  cost_ = data_cost_;
  intrinsic_gradient_ = data_gradient_;
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    const double precision = prior_precision(i);
    const double error = camera_.*kIntrinsics[i] - policy_.prior_mean[i];
    cost_ += precision * error * error;
    intrinsic_gradient_(static_cast<Eigen::Index>(i)) -= precision * error;
  }
  const double aspect = aspect_precision();
  const double difference = camera_.fy - camera_.fx;
  cost_ += aspect * difference * difference;
  intrinsic_gradient_(0) += aspect * difference;
  intrinsic_gradient_(1) -= aspect * difference;
  intrinsic_block_ = data_block_ + prior_information();
  for (std::size_t i = 0; i < data_.relative.size(); ++i) {
    const RelativePrior& turn = data_.relative[i];
    const RefineView& a = views_[turn.view_a];
    const RefineView& b = views_[turn.view_b];
    if (a.partner == turn.view_b) cost_ += turn_precision(i) * turn_residual(turn, a.pose, b.pose).value.squaredNorm();
  }
}

/// Cost, residuals and normal equations of the current state.
/// @return false where they are not finite, or the cost is above `most_cost`; they may then be in part only
bool Refiner::linearise(double most_cost) {
  data_block_.setZero();
  data_gradient_.setZero();
  data_cost_ = 0.0;
  points_used_ = points_lost_ = 0;
  const double knee = radius_of_slope(camera_, kKneeSlope);
  for (std::size_t v = 0; v < views_.size(); ++v) {
    if (views_[v].used && !linearise_view(v, knee, most_cost)) return false;
  }
  add_priors();
  return std::isfinite(cost_) && camera_.fx > 0.0 && camera_.fy > 0.0;
}

/// Takes the poses of `view`, and of its partner for N = 12, out of the system's lower triangle: with C = L L' and
/// X = inv(L) E, E' inv(C) E is X'X.
template <int N>
bool Refiner::eliminate(std::size_t view, double damping, ReducedSystem* system) const {
  PoseGroup<N> group;
  gather(view, &group);
  group.block.diagonal() *= 1.0 + damping;
  Cholesky<N> factor;
  if (!factor.factor(group.block, kMinPosePivot)) return false;
  const Eigen::Matrix<double, N, 1> h = factor.whiten(group.gradient);
  Eigen::Matrix<double, N, 9> X;  // columns of free parameters alone
  for (int j = 0; j < num_free_; ++j) {
    const int to = free_[j];
    X.col(to) = factor.whiten(group.cross.col(to));
    system->gradient(to) -= X.col(to).dot(h);
    for (int i = 0; i <= j; ++i) system->matrix(to, free_[i]) -= X.col(to).dot(X.col(free_[i]));
  }
  return true;
}

bool Refiner::reduce(double damping, ReducedSystem* out) const {
  ReducedSystem system;
  system.matrix = intrinsic_block_;
  system.matrix.diagonal() *= 1.0 + damping;
  system.gradient = intrinsic_gradient_;
  for (std::size_t v = 0; v < views_.size(); ++v) {
    const std::uint32_t partner = views_[v].partner;
    if (!views_[v].used || (partner != kNoView && partner < v)) continue;
    if (!(partner == kNoView ? eliminate<6>(v, damping, &system) : eliminate<12>(v, damping, &system))) return false;
  }
  for (Eigen::Index i = 0; i < 9; ++i) {
    if (policy_.free[i]) continue;
    system.matrix.row(i).setZero();
    system.matrix.col(i).setZero();
    system.matrix(i, i) = 1.0;
    system.gradient(i) = 0.0;
  }
  system.matrix.triangularView<Eigen::StrictlyUpper>() = system.matrix.transpose();
  *out = system;
  return true;
}

bool Refiner::solve_damped(Vec9* delta) const {
  ReducedSystem system;
  Cholesky<9> factor;
  if (!reduce(damping_, &system) || !factor.factor(system.matrix)) return false;
  *delta = factor.solve(system.gradient);
  return delta->allFinite();
}

/// Moves the poses of `view`, and of its partner for N = 12.
template <int N>
void Refiner::move_poses(std::size_t view, const Vec9& delta, double* predicted, double* largest_step) {
  PoseGroup<N> group;
  gather(view, &group);
  const Eigen::Matrix<double, N, 1> diagonal = group.block.diagonal();
  group.block.diagonal() *= 1.0 + damping_;
  Cholesky<N> factor;
  if (!factor.factor(group.block, kMinPosePivot)) return;  // reduce() has factored the same matrix before
  const Eigen::Matrix<double, N, 1> steps =
      factor.solve(Eigen::Matrix<double, N, 1>(group.gradient - group.cross.lazyProduct(delta)));
  *predicted += steps.dot(group.gradient + damping_ * diagonal.cwiseProduct(steps));
  for (Eigen::Index k = 0; k < N; k += 6) {
    RefineView& moved = views_[k == 0 ? view : views_[view].partner];
    const Vec6 step = steps.template segment<6>(k);
    const Mat3 turn = so3_exp(step.head<3>());
    const Vec3 t = turn * translation_of(moved.pose) + step.tail<3>();
    moved.pose = make_pose(turn * rotation_of(moved.pose), t);  // drifts from SO(3) by an eps a step
    *largest_step = std::max({*largest_step, step.head<3>().norm(), step.tail<3>().norm() / (t.norm() + 1e-300)});
  }
}

/// Moves camera and poses by the damped step whose intrinsic part is `delta`.
/// @return the decrease of the cost that the quadratic model predicts
double Refiner::apply(const Vec9& delta, double* largest_relative_step) {
  double predicted = delta.dot(intrinsic_gradient_ + damping_ * intrinsic_block_.diagonal().cwiseProduct(delta));
  double largest = 0.0;
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    const double step = delta(static_cast<Eigen::Index>(i));
    camera_.*kIntrinsics[i] += step;
    largest = std::max(largest, std::abs(step) / (1.0 + std::abs(camera_.*kIntrinsics[i])));
  }
  for (RefineView& view : views_) view.previous = view.pose;
  for (std::size_t v = 0; v < views_.size(); ++v) {
    const std::uint32_t partner = views_[v].partner;
    if (!views_[v].used || (partner != kNoView && partner < v)) continue;
    if (partner == kNoView) {
      move_poses<6>(v, delta, &predicted, &largest);
    } else {
      move_poses<12>(v, delta, &predicted, &largest);
    }
  }
  *largest_relative_step = largest;
  return predicted;
}

void Refiner::restore(const Camera& camera) {
  camera_ = camera;
  for (RefineView& view : views_) std::swap(view.pose, view.previous);
}

Status Refiner::finish(StopReason reason, Status status) {
  reason_ = reason;
  return status;
}

/// The decrease that the undamped step promises is the square of its length in sigmas, all parameters taken together.
Status Refiner::finish_at_limit() {
  const Camera camera = camera_;
  const double damping = damping_;
  damping_ = 0.0;
  Vec9 delta;
  bool settled = solve_damped(&delta);
  if (settled) {
    double relative_step = 0.0;
    settled = apply(delta, &relative_step) <= kSettledSigmas * kSettledSigmas * prior_weight_;
    restore(camera);
  }
  damping_ = damping;
  return settled ? finish(StopReason::settled, Status::ok) : finish(StopReason::iteration_limit, Status::not_converged);
}

void Refiner::make_last_step() {
  if (reason_ == StopReason::small_decrease) restore(next_camera_);
}

Status Refiner::step() {
  if (!linearised_) {
    if (!linearise()) return finish(StopReason::numerical_failure, Status::numerical_failure);
    linearised_ = true;
  }
  if (iterations_ >= options_.max_iterations) return finish_at_limit();
  Vec9 delta;
  while (!solve_damped(&delta)) {
    damping_ = std::max(10.0 * damping_, 1e-8);
    if (damping_ > kMaxDamping) return finish(StopReason::numerical_failure, Status::numerical_failure);
  }
  const double cost_before = cost_;
  const Camera camera_before = camera_;
  double relative_step = 0.0;
  const double predicted = apply(delta, &relative_step);
  if (damping_ < kTrustedDamping && predicted <= options_.decrease_tolerance * cost_before) {
    next_camera_ = camera_;
    restore(camera_before);
    return finish(StopReason::small_decrease, Status::ok);
  }
  ++iterations_;
  const bool better = linearise(cost_before) && cost_ <= cost_before;
  const bool tiny_step = relative_step <= options_.step_tolerance;
  if (better) {
    const double decrease = cost_before - cost_;
    const double share = 2.0 * decrease / std::max(predicted, 1e-300) - 1.0;
    damping_ = std::max(damping_ * std::max(1.0 / 10.0, 1.0 - share * share * share), kMinDamping);
    damping_growth_ = kDampingGrowth;
    return tiny_step ? finish(StopReason::small_step, Status::ok) : Status::in_progress;
  }
  restore(camera_before);
  linearise();
  if (tiny_step) return finish(StopReason::small_step, Status::ok);
  damping_ *= damping_growth_;
  damping_growth_ *= 2.0;
  if (damping_ > kMaxDamping) return finish(StopReason::no_descent, Status::ok);
  return Status::in_progress;
}

}  // namespace lecalib
