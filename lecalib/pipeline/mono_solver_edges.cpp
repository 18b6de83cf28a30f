// SPDX-License-Identifier: MIT
/// Edges have offsets that are estimated with the camera, and some of them are not the model's: a part of MonoSolver.
#include "lecalib/math/cholesky.hpp"
#include "lecalib/pipeline/mono_solver.hpp"

namespace lecalib {
namespace {

/// Rounds of moving edges and refining, at most, and the change of an offset that ends them, px.
constexpr int kMaxOffsetRounds = 6;
constexpr double kSettledOffsetPx = 0.002;

/// See kMinPosePivot: a view whose pose rests on less has lines that are all but parallel, and tells nothing.
constexpr double kMinViewPivot = 1e-7;

}  // namespace

Status MonoSolver::init_on_edges(const CalibrationData& data, const MonoSolverOptions& options,
                                 const MonoSolverWorkspace& workspace, const MonoStart& start) {
  const Status status = prepare(data, options, workspace);
  if (status != Status::ok) return status;
  if (data.edges.empty()) return Status::invalid_argument;
  const std::size_t points = data.points.size();
  if (workspace.corrected.size() < points || workspace.wrong_edges.size() < points ||
      !has_room(workspace.offsets, data.model.size())) {
    return Status::capacity_exceeded;
  }
  begin_edges();
  return take_start(start);
}

void MonoSolver::begin_edges() {
  sort_edges_ = &MonoSolver::sort_edges;
  const std::size_t points = data_.points.size();
  workspace_.corrected = workspace_.corrected.first(points);
  workspace_.wrong_edges = workspace_.wrong_edges.first(points);
  offsets_.init(data_, options_.offsets, workspace_.offsets);
  offsets_.correct(workspace_.corrected);
  for (std::uint8_t& wrong : workspace_.wrong_edges) wrong = 0;
  offsets_.mark_strays(workspace_.wrong_edges);
  for (std::size_t i = 0; i < points; ++i) workspace_.left_out[i] = workspace_.wrong_edges[i];
  data_.points = workspace_.corrected;
  data_.left_out = workspace_.left_out;
}

/// Leaves out the views whose poses their lines do not determine.
void MonoSolver::drop_open_views() {
  Cholesky<6> factor;
  for (RefineView& view : workspace_.guess.views) {
    if (!view.used || factor.factor(pose_block_of(view), kMinViewPivot)) continue;
    view.used = false;
    --views_used_;
  }
}

/// What follows a refinement: move edges and refine, sort lines and refine anew, until nothing changes.
Status MonoSolver::sort_edges() {
  if (move_edges()) return Status::in_progress;
  if (sortings_ >= kMaxSortings) return Status::ok;
  const bool changed = drop_wrong_edges() || sort_lines();
  if (!changed && sortings_ > 0) return Status::ok;
  ++sortings_;
  offset_rounds_ = 0;
  begin_refinement(refiner_.camera(), classify());
  return Status::in_progress;
}

/// @return whether points have moved, so that the refinement must go on
bool MonoSolver::move_edges() {
  double change_px = 0;
  if (offset_rounds_ >= kMaxOffsetRounds || !offsets_.solve(refiner_, &change_px)) return false;
  ++offset_rounds_;
  offsets_.correct(workspace_.corrected);
  refiner_.points_changed();
  return change_px > kSettledOffsetPx;
}

bool MonoSolver::drop_wrong_edges() {
  if (!offsets_.mark_wrong_lines(workspace_.wrong_edges)) return false;
  for (std::size_t i = 0; i < data_.points.size(); ++i) {
    if (workspace_.wrong_edges[i] != 0) workspace_.left_out[i] = 1;
  }
  offsets_.correct(workspace_.corrected);
  return true;
}

}  // namespace lecalib
