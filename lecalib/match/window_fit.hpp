// SPDX-License-Identifier: MIT
/// Pose and matches of one window from a rough pose: assign, refine the pose, assign again with a tighter gate.
#pragma once

#include "lecalib/match/line_assignment.hpp"
#include "lecalib/match/pose_refinement.hpp"

namespace lecalib {

/// How far from the truth the starting pose may be.
enum class FitStart : std::uint8_t {
  far,   ///< a guess from a quad or a prediction over a gap
  near,  ///< the pose is known but for the lens
  fine,  ///< only the matches are to be renewed
};

struct WindowFitOptions {
  double unit_px = 1.0;  ///< about a thousandth of the image's diagonal
  FitStart start = FitStart::far;
  const PosePrior* prior = nullptr;  ///< from the windows around it; may be null
  Span<const std::int8_t> contrast;  ///< as in AssignmentOptions
  Span<const std::int8_t> line_contrast;
};

struct WindowFit {
  Pose pose;                     ///< at the window's middle
  Support support;               ///< with the last gate
  double rms_px = 0;             ///< robust
  Span<Assignment> assignments;  ///< in the workspace
};

/// @return false, *out unchanged, when fewer than three model lines find a detected one
bool fit_window(const ModelGraph& model, double f_px, const FlatFrame& frame, Span<const FlatLine> lines,
                const Pose& start, const WindowFitOptions& options, AssignmentWorkspace* workspace, WindowFit* out);

}  // namespace lecalib
