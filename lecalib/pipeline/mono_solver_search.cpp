// SPDX-License-Identifier: MIT
/// Starts from the measured lines alone, and samples that tell wrong lines from right ones: a part of MonoSolver,
/// reached through search_ only, so that programs which always give a start don't hold its code.
#include <algorithm>
#include <cmath>

#include "lecalib/pipeline/mono_solver.hpp"

namespace lecalib {
namespace {

/// A residual of so many robust sigmas is no accident among the points of a calibration.
constexpr double kWrongSpreads = 5.0;

/// Fewer lines than this, in all views, leave the centre and the distortion free to run off before the pose is right:
/// twice what a view's linear solution takes.
constexpr std::size_t kFewLinesInAll = 2 * kMinNonPlanarLines;

}  // namespace

Status MonoSolver::init(const CalibrationData& data, const MonoSolverOptions& options,
                        const MonoSolverWorkspace& workspace) {
  const Status status = prepare(data, options, workspace);
  if (status != Status::ok) return status;
  if (!data.edges.empty()) return Status::invalid_argument;
  search_ = &MonoSolver::search;
  begin_guess();
  return Status::ok;
}

/// One step of the search; after an attempt from a start: what to try next.
/// @param attempt what the attempt came to
/// @return in_progress | attempt, where nothing is left to try | why there is no start, or no right lines
Status MonoSolver::search(Status attempt) {
  if (phase_ == Phase::guess) return step_guess();
  if (phase_ == Phase::ransac) return step_ransac();
  if (attempt != Status::ok && attempts_ < options_.max_attempts && guess_.begin_next_candidate()) {
    phase_ = Phase::guess;
    return Status::in_progress;
  }
  if (attempt != Status::ok && sortings_ == 0 && !poses_were_first_ && has_few_lines()) {
    begin_guess();
    poses_first_ = poses_were_first_ = true;
    return Status::in_progress;
  }
  if (sortings_ == 0 && options_.reject_lines && has_wrong_lines() && begin_ransac() == Status::ok) {
    return Status::in_progress;
  }
  return attempt;
}

void MonoSolver::begin_guess() {
  guess_ = InitialGuess();
  guess_.init(data_, options_.guess, workspace_.guess);
  poses_first_ = false;
  phase_ = Phase::guess;
}

Status MonoSolver::step_guess() {
  const Status status = guess_.step();
  if (status != Status::ok) return status;
  begin_refinement(guess_.camera(), guess_.geometry());
  return Status::in_progress;
}

bool MonoSolver::has_few_lines() const {
  std::size_t lines = 0;
  for (const View& view : data_.views) lines += count_lines(data_, view, workspace_.guess.sums);
  return lines < kFewLinesInAll;
}

/// Whether some residuals are larger than what the bulk of them explains, or all are too large to be measurements.
bool MonoSolver::has_wrong_lines() {
  if (result_.rms_px > options_.plausibility.max_rms_share * data_.width) return true;
  const double spread = fitted_spread();
  const double limit = kWrongSpreads * (options_.covariance.trust_sigma ? std::max(spread, 1.0) : spread);
  for (const float residual : workspace_.residuals) {
    if (std::abs(static_cast<double>(residual)) > limit) return true;
  }
  return false;
}

Status MonoSolver::begin_ransac() {
  const Status status = ransac_.init(
      data_, options_.ransac, {workspace_.guess.sums, workspace_.guess.lines, workspace_.chosen}, workspace_.left_out);
  if (status == Status::ok) phase_ = Phase::ransac;
  return status;
}

/// The right lines are solved from the beginning.
Status MonoSolver::step_ransac() {
  const Status status = ransac_.step();
  if (status == Status::in_progress) return status;
  if (is_error(status)) {
    phase_ = Phase::done;
    return result_.status;
  }
  data_.left_out = workspace_.left_out;
  sortings_ = 1;
  attempts_ = 0;
  begin_guess();
  return Status::in_progress;
}

}  // namespace lecalib
