// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/mono_solver.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/distortion_fit.hpp"
#include "lecalib/math/robust_loss.hpp"

namespace lecalib {
namespace {

/// Where the refinement by squares may stop: it only gives the scale of the residuals and a start for what follows.
constexpr double kSquaresTolerance = 1e-3;

/// Whether the workspace has room for the data, but for their edges.
bool has_room(const MonoSolverWorkspace& ws, const CalibrationData& data) {
  const std::size_t lines = data.model.size();
  const std::size_t points = data.points.size();
  const std::size_t views = data.views.size();
  const std::size_t rooms_and_needs[][2] = {{ws.guess.sums.size(), lines},
                                            {ws.guess.lines.size(), lines},
                                            {ws.guess.linear.size(), views},
                                            {ws.guess.focal_lengths.size(), views},
                                            {ws.guess.views.size(), views},
                                            {ws.residuals.size(), points},
                                            {ws.sorted_residuals.size(), points},
                                            {ws.feet.size(), points},
                                            {ws.results.size(), views},
                                            {ws.line_results.size(), max_line_results({views, points, lines})},
                                            {ws.left_out.size(), points},
                                            {ws.chosen.size(), lines},
                                            {ws.responses.size(), kLineErrors * lines}};
  for (const std::size_t(&pair)[2] : rooms_and_needs) {
    if (pair[0] < pair[1]) return false;
  }
  return true;
}

}  // namespace

Status MonoSolver::init(const CalibrationData& data, const MonoSolverOptions& options,
                        const MonoSolverWorkspace& workspace, const MonoStart& start) {
  const Status status = prepare(data, options, workspace);
  if (status != Status::ok) return status;
  return data.edges.empty() ? take_start(start) : Status::invalid_argument;
}

/// What all ways to begin share.
Status MonoSolver::prepare(const CalibrationData& data, const MonoSolverOptions& options,
                           const MonoSolverWorkspace& workspace) {
  phase_ = Phase::idle;
  if (const Status status = validate(data); status != Status::ok) return status;
  if (!(options.loss_width > 0.0) || options.refine.max_iterations <= 0 || options.max_attempts <= 0)
    return Status::invalid_argument;
  if (!has_room(workspace, data)) return Status::capacity_exceeded;
  const std::size_t views = data.views.size();
  data_ = data;
  options_ = options;
  workspace_ = workspace;
  workspace_.guess.views = workspace.guess.views.first(views);
  workspace_.guess.linear = workspace.guess.linear.first(views);
  workspace_.guess.sums = workspace.guess.sums.first(data.model.size());
  workspace_.results = workspace.results.first(views);
  workspace_.residuals = workspace.residuals.first(data.points.size());
  workspace_.feet = workspace.feet.first(data.points.size());
  for (float& residual : workspace_.residuals) residual = 0.0F;
  workspace_.left_out = workspace.left_out.first(data.points.size());
  result_ = CalibrationResult();
  attempts_ = sortings_ = offset_rounds_ = 0;
  poses_first_ = poses_were_first_ = false;
  search_ = nullptr;
  sort_edges_ = nullptr;
  return Status::ok;
}

Status MonoSolver::take_start(const MonoStart& start) {
  if (start.T_cam_world.size() != data_.views.size() || !(start.camera.fx > 0.0) || !(start.camera.fy > 0.0)) {
    return Status::invalid_argument;
  }
  for (std::size_t v = 0; v < data_.views.size(); ++v) {
    RefineView& view = workspace_.guess.views[v];
    view.pose = start.T_cam_world[v];
    view.used = count_lines(data_, data_.views[v], workspace_.guess.sums) >= kMinPosedLines;
  }
  Camera camera = start.camera;
  camera.width = data_.width;
  camera.height = data_.height;
  begin_refinement(camera, classify());
  return Status::ok;
}

ViewGeometry MonoSolver::classify() const {
  return classify_views(data_, workspace_.guess.views, workspace_.guess.sums, workspace_.guess.lines);
}

void MonoSolver::begin_refinement(const Camera& camera, ViewGeometry geometry) {
  views_used_ = 0;
  for (const RefineView& view : workspace_.guess.views) views_used_ += view.used ? 1 : 0;
  policy_ = choose_policy(data_.width, data_.height, geometry, views_used_, options_.policy);
  RefineOptions refine = options_.refine;
  refine.loss = Loss::squared;
  refine.decrease_tolerance = std::max(refine.decrease_tolerance, kSquaresTolerance);
  Camera start = in_model(camera, policy_.model, image_radius(camera), options_.policy.free_k3 ? 3 : 2);
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    if (!policy_.free[i]) start.*kIntrinsics[i] = policy_.prior_mean[i];
  }
  ParameterPolicy at_first = policy_;
  if (poses_first_) std::fill(at_first.free + kCx, at_first.free + kNumIntrinsics, false);
  refiner_.init(data_, at_first, refine, start, workspace_.guess.views, workspace_.residuals, workspace_.feet);
  phase_ = Phase::refine;
}

Status MonoSolver::step() {
  switch (phase_) {
    case Phase::idle: return Status::wrong_state;
    case Phase::refine:
    case Phase::refine_robust: return step_refinement();
    case Phase::guess:
    case Phase::ransac: {
      const Status status = (this->*search_)(Status::in_progress);
      return phase_ == Phase::guess && is_error(status) ? conclude(status) : status;
    }
    case Phase::done: return result_.status;
  }
  return Status::wrong_state;
}

Status MonoSolver::step_refinement() {
  if (views_used_ == 0) return conclude(Status::too_few_lines);
  const Status status = refiner_.step();
  if (status == Status::in_progress) return status;
  if (poses_first_) {
    poses_first_ = false;
    begin_refinement(refiner_.camera(), classify());
    return Status::in_progress;
  }
  if (status != Status::ok) return conclude(status);
  if (phase_ == Phase::refine_robust && has_edges() && (this->*sort_edges_)() == Status::in_progress)
    return Status::in_progress;
  if (phase_ == Phase::refine_robust && !has_edges() && sortings_ > 0 && sortings_ < kMaxSortings && sort_lines()) {
    ++sortings_;
    begin_refinement(refiner_.camera(), classify());
    return Status::in_progress;
  }
  if (phase_ == Phase::refine) {
    if (has_edges()) drop_open_views();
    phase_ = Phase::refine_robust;
    // Trusted sigmas are only ever widened, and the priors stay in proportion to them.
    const double spread = fitted_spread();
    const double scale = options_.covariance.trust_sigma ? std::max(spread, 1.0) : spread;
    refiner_.set_decrease_tolerance(options_.refine.decrease_tolerance);
    // Edges are off by more than their sigmas until their offsets are known: that says nothing about the sigmas.
    refiner_.set_loss(options_.loss, options_.loss_width * scale, has_edges() ? 1.0 : scale);
    return Status::in_progress;
  }
  refiner_.make_last_step();
  // What offsets do to points is worked out at the present state, and the equations beside it must be of the same.
  if (has_edges() && !refiner_.renew_equations()) return conclude(Status::numerical_failure);
  return conclude(Status::ok);
}

/// Robust spread of the residuals in given sigmas. 1 where too few residuals remain to tell.
double MonoSolver::fitted_spread() {
  std::size_t count = 0;
  for (std::size_t v = 0; v < data_.views.size(); ++v) {
    if (workspace_.guess.views[v].used) count += count_points(data_, data_.views[v]);
  }
  const auto num_free = std::count(policy_.free, policy_.free + kNumIntrinsics, true);
  const double unknowns = 6.0 * static_cast<double>(views_used_) + static_cast<double>(num_free);
  const double dof = static_cast<double>(count) - unknowns;
  if (dof < kMinScaleDof) return 1.0;
  // A fit makes its residuals smaller.
  return std::sqrt(static_cast<double>(count) / dof) * spread_of(workspace_.residuals);
}

/// The median absolute value, scaled to a Gaussian's sigma, over the points in use.
double MonoSolver::spread_of(Span<const float> residuals) {
  std::size_t count = 0;
  for (std::size_t v = 0; v < data_.views.size(); ++v) {
    if (!workspace_.guess.views[v].used) continue;
    const View& view = data_.views[v];
    for (std::size_t i = view.first; i < view.first + view.count && count < workspace_.sorted_residuals.size(); ++i) {
      if (!is_left_out(data_, i)) workspace_.sorted_residuals[count++] = std::abs(residuals[i]);
    }
  }
  if (count == 0) return 1.0;
  float* const first = workspace_.sorted_residuals.data();
  std::nth_element(first, first + count / 2, first + count);
  return std::max(kGaussianOverMedian * static_cast<double>(first[count / 2]), kMinSpread);
}

/// Ends an attempt: done where it went well or no start is left, otherwise on to the next start. Of several failures
/// the one with the smallest cost is reported.
Status MonoSolver::conclude(Status status) {
  const bool refined = phase_ != Phase::guess && views_used_ > 0;
  ++attempts_;
  CalibrationResult attempt;
  if (refined) {
    summarise(&attempt);
    status = judge(status, &attempt);
  }
  attempt.status = status;
  const bool sorted = sortings_ > 0 && !has_edges();
  if (sortings_ > 0 && status == Status::ok && !keeps_enough_lines(attempt)) status = attempt.status = Status::no_match;
  const bool first = attempts_ == 1 && !sorted;
  if (first || status == Status::ok || (refined && !sorted && refiner_.cost() < best_cost_)) {
    best_cost_ = refiner_.cost();
    result_ = attempt;
    if (refined) summarise_views(&result_);
  }
  if (refined && search_ != nullptr && (this->*search_)(status) == Status::in_progress) return Status::in_progress;
  if (sorted && status != Status::ok) data_.left_out = {};  // what came of all lines stands
  phase_ = Phase::done;
  return result_.status;
}

bool MonoSolver::keeps_enough_lines(const CalibrationResult& result) const {
  std::size_t kept = 0;
  for (const View& view : data_.views) kept += count_lines(data_, view, workspace_.guess.sums);
  const double right = options_.ransac.min_right_share * static_cast<double>(kept + result.lines_left_out);
  return static_cast<double>(kept) >= right;
}

/// Covariance and plausibility. A refinement that crawls along a valley has not failed, its parameter is undetermined.
Status MonoSolver::judge(Status status, CalibrationResult* result) {
  spread_ = {};
  if (status == Status::numerical_failure) {
    // Singular equations are the arrangement's fault; only values that are not finite are arithmetic's.
    ReducedSystem system;
    return std::isfinite(refiner_.cost()) && !refiner_.reduced_system(&system) ? Status::degenerate_geometry : status;
  }
  const Status covariance = compute_covariance(refiner_, policy_, options_.covariance, views_used_,
                                               workspace_.responses.first(kLineErrors * data_.model.size()), result,
                                               &spread_, has_edges() ? &offsets_ : nullptr);
  if (covariance != Status::ok) return covariance;
  const Status plausible = check_plausibility(data_, workspace_.guess.views, options_.plausibility, result);
  return status == Status::ok || plausible == Status::undetermined ? plausible : status;
}

void MonoSolver::summarise(CalibrationResult* result) {
  result->camera = refiner_.camera();
  result->iterations = refiner_.iterations();
  result->reason = refiner_.reason();
  result->points = static_cast<std::uint32_t>(refiner_.points_used());
  result->points_lost = static_cast<std::uint32_t>(refiner_.points_lost());
  result->lines_left_out = 0;
  CalibrationData all = data_;
  all.left_out = {};
  for (const View& view : data_.views) {
    result->lines_left_out += static_cast<std::uint32_t>(count_lines(all, view, workspace_.guess.sums) -
                                                         count_lines(data_, view, workspace_.guess.sums));
  }
  result->views_left_out = static_cast<std::uint32_t>(data_.views.size() - views_used_);
  double squares = 0.0;
  for (std::size_t v = 0; v < data_.views.size(); ++v) {
    if (workspace_.guess.views[v].used) squares += squared_distances(data_.views[v]);
  }
  result->rms_px = std::sqrt(squares / std::max(1.0, static_cast<double>(result->points)));
}

void MonoSolver::summarise_views(CalibrationResult* result) {
  result->views = workspace_.results;
  Span<ViewLineResult> free = workspace_.line_results;
  for (std::size_t v = 0; v < data_.views.size(); ++v) {
    const View& span = data_.views[v];
    const RefineView& view = workspace_.guess.views[v];
    ViewResult& out = workspace_.results[v];
    out = {};
    out.lines = static_cast<std::uint32_t>(count_lines(data_, span, workspace_.guess.sums));
    out.points = span.count;
    out.used = view.used;
    if (!view.used) continue;
    out.T_cam_world = view.pose;
    out.rms_px = std::sqrt(squared_distances(span) / std::max(1.0, static_cast<double>(count_points(data_, span))));
    const std::size_t lines = summarise_lines(span, free);
    out.residuals = free.first(lines);
    free = free.subspan(lines, free.size() - lines);
    compute_pose_covariance(refiner_, options_.covariance, spread_,
                            workspace_.responses.first(kLineErrors * data_.model.size()), v, &out);
  }
}

/// Residuals by line of one view. @return how many lines there are
std::size_t MonoSolver::summarise_lines(const View& view, Span<ViewLineResult> out) {
  const Span<LineSums> sums = workspace_.guess.sums;
  for (LineSums& sum : sums) sum.distances = {};
  for (std::size_t i = view.first; i < view.first + view.count; ++i) {
    LineDistances& line = sums[data_.points[i].line].distances;
    const double distance_px = static_cast<double>(workspace_.residuals[i]) * data_.points[i].sigma_px;
    const bool counts = !is_left_out(data_, i);
    (counts ? line.sum : line.left_out_sum) += distance_px;
    (counts ? line.squares : line.left_out_squares) += distance_px * distance_px;
    ++(counts ? line.count : line.left_out_count);
  }
  std::size_t lines = 0;
  for (std::size_t l = 0; l < sums.size(); ++l) {
    const LineDistances& line = sums[l].distances;
    const bool left_out = line.count == 0;
    const std::uint32_t count = left_out ? line.left_out_count : line.count;
    if (count == 0) continue;
    out[lines++] = {count, static_cast<float>((left_out ? line.left_out_sum : line.sum) / count),
                    static_cast<float>(std::sqrt((left_out ? line.left_out_squares : line.squares) / count)),
                    static_cast<std::uint16_t>(l), left_out};
  }
  return lines;
}

/// Sum of a view's squared distances, px^2.
double MonoSolver::squared_distances(const View& view) const {
  double squares = 0.0;
  for (std::size_t i = view.first; i < view.first + view.count; ++i) {
    if (is_left_out(data_, i)) continue;
    const double distance_px = static_cast<double>(workspace_.residuals[i]) * data_.points[i].sigma_px;
    squares += distance_px * distance_px;
  }
  return squares;
}

}  // namespace lecalib
