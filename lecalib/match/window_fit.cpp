// SPDX-License-Identifier: MIT
#include "lecalib/match/window_fit.hpp"

namespace lecalib {
namespace {

/// One round: gate and slope of the assignment before its pose steps. Gates in units.
struct Round {
  double gate_units;
  double max_slope;
  double overshoot_units;
  int iterations;
};

/// From coarse to fine; the last one only assigns.
constexpr Round kWindowRounds[] = {
    {12.0, 0.20, 16.0, 2}, {7.0, 0.12, 12.0, 2}, {4.0, 0.08, 10.0, 2}, {3.5, 0.06, 10.0, 0}};
constexpr std::size_t kNumWindowRounds = sizeof(kWindowRounds) / sizeof(kWindowRounds[0]);
constexpr std::uint16_t kMinFitLines = 3;
/// From this round on a pose with few lines needs whole ones.
constexpr std::size_t kFineRound = 2;
constexpr double kMinCoverageOfFew = 0.6;

}  // namespace

bool fit_window(const ModelGraph& model, double f_px, const FlatFrame& frame, Span<const FlatLine> lines,
                const Pose& start, const WindowFitOptions& options, AssignmentWorkspace* workspace, WindowFit* out) {
  WindowFit fit;
  fit.pose = start;
  for (std::size_t round = static_cast<std::size_t>(options.start); round < kNumWindowRounds; ++round) {
    AssignmentOptions assignment;
    assignment.unit_px = options.unit_px;
    assignment.contrast = options.contrast;
    assignment.line_contrast = options.line_contrast;
    assignment.gate_px = kWindowRounds[round].gate_units * options.unit_px;
    assignment.max_slope = kWindowRounds[round].max_slope;
    assignment.overshoot_px = kWindowRounds[round].overshoot_units * options.unit_px;
    if (round >= kFineRound) assignment.min_coverage_of_few = kMinCoverageOfFew;
    fit.assignments =
        assign_lines(model, fit.pose, f_px, frame, lines, Instant::middle, assignment, workspace, &fit.support);
    if (fit.support.lines < kMinFitLines) return false;
    if (kWindowRounds[round].iterations == 0) continue;
    PoseRefinementOptions refinement;
    refinement.iterations = kWindowRounds[round].iterations;
    refinement.sigma_floor_px = 0.5 * options.unit_px;
    refinement.loss_px = 0.5 * assignment.gate_px;
    const PoseLines seen{model.lines, lines, fit.assignments};
    if (!refine_pose(seen, f_px, options.prior, refinement, &fit.pose, &fit.rms_px)) {
      return false;
    }
  }
  *out = fit;
  return true;
}

}  // namespace lecalib
