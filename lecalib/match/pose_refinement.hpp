// SPDX-License-Identifier: MIT
/// Least squares for matched lines, in flat px: the distance of a detected point (x, y) from the image of its model
/// line is N . m / |(Nx, Ny)| with m = (x, y, f) and N the moment of the line in the camera frame. With m~ the foot of
/// m on the line its derivatives are (N x m~, D x m~) / |(Nx, Ny)| for the pose update x' = exp(w) x + v, and
/// Nz / |(Nx, Ny)| for f. Rough on purpose: the refinement of the final camera measures in distorted pixels.
#pragma once

#include "lecalib/match/flat_lines.hpp"
#include "lecalib/match/line_assignment.hpp"

namespace lecalib {

struct PoseRefinementOptions {
  int iterations = 3;           ///< Gauss-Newton steps, >= 1
  double sigma_floor_px = 0.5;  ///< added to the lines' own sigma: what the rough lens leaves
  double loss_px = 2.0;         ///< scale of the Cauchy loss
  /// One sigma of a step, keeps what the lines leave open: rad, and share of the object's distance.
  double damping = 0.5;
};

/// What the windows before and after say about a pose, as one sigma each. Depth is the weakest of an image's findings.
struct PosePrior {
  Pose mean;
  double centre_m[3];      ///< point of the model to whose position the sigmas refer
  double sigma_rad;        ///< of the rotation
  double sigma_lateral_m;  ///< of the centre's position across the line of sight
  double sigma_depth_m;    ///< along it
};

/// What a pose is refined by: assigned lines at one instant of the window.
struct PoseLines {
  Span<const ModelLine> model;
  Span<const FlatLine> lines;
  Span<const Assignment> assignments;
  Instant instant = Instant::middle;
};

/// Moves the pose to where the assigned lines (and the prior) want it.
/// @param prior may be null
/// @param[out] rms_px of the residuals before the last step, robustly weighted; may be null
/// @return false, *pose unchanged, when the normal equations cannot be solved
bool refine_pose(const PoseLines& seen, double f_px, const PosePrior* prior, const PoseRefinementOptions& options,
                 Pose* pose, double* rms_px);

/// One window for the refinement of the lens: its lines at its middle.
struct LensView {
  Span<const EventLine> lines;
  Span<const LineMatch> matches;
  Pose* pose;  ///< at the window's middle; updated
};

/// What is known about the lens beforehand, and how well (one sigma). A sigma of 0 holds the value.
struct LensPrior {
  Lens mean;
  Lens sigma;
};

/// Per view: the eliminated pose's solution, for the back-substitution.
struct LensViewSystem {
  double gain[6 * kNumLens];
  double step[6];
};

/// One damped Gauss-Newton step over the lens and the poses of all views; poses are eliminated view by view.
/// @param scratch at least views.size()
/// @param[out] cost sum of the robust losses before the step
/// @return false, nothing changed, when the equations cannot be solved
/// Complexity O(matches).
bool refine_lens_step(Span<const ModelLine> model, Span<const LensView> views, const LensPrior& prior,
                      const PoseRefinementOptions& options, Span<LensViewSystem> scratch, Lens* lens, double* cost);

}  // namespace lecalib
