// SPDX-License-Identifier: MIT
/// What the poses of some windows say about those of others: predictions, and how far they can be trusted.
#pragma once

#include "lecalib/match/pose_refinement.hpp"

namespace lecalib {

struct WindowTimes {
  std::int64_t begin_us;
  std::int64_t end_us;
};

/// A hypothesis in one window.
struct WindowTrack {
  Pose pose[kNumInstants];  ///< by Instant
  double score;             ///< Support::score
  double found;             ///< Support::found
  double possible;          ///< Support::possible without what cannot be seen: see silent_weight()
  double rms_px;
  std::uint16_t num_lines;    ///< model lines matched
  std::uint16_t num_matches;  ///< detected lines matched
  bool matched;
};

/// The windows of a hypothesis in order of time; both spans have the same size.
struct WindowMotion {
  Span<const WindowTimes> times;
  Span<const WindowTrack> windows;
};

inline constexpr std::size_t kMaxPredictions = 5;

/// Poses to expect at the middle of a window, from the nearest matched windows on both sides.
/// @return their number, 0 when no window is matched yet
std::size_t predict_poses(const WindowMotion& motion, std::size_t window, Pose out[kMaxPredictions]);

/// How far poses lie from what their neighbours predict: the motion's own unsteadiness.
struct MotionScatter {
  double rotation_rad = 0;
  double lateral = 0;  ///< of the model's centre across the line of sight, share of the distance
  double depth = 0;    ///< along it
  bool known = false;  ///< false with too few windows to tell
};

/// Medians over the matched windows that lie between matched ones.
/// @param centre_m of the model
/// @param scratch  at least as many as windows
MotionScatter measure_scatter(const WindowMotion& motion, const double (&centre_m)[3], Span<double> scratch);

/// What the two neighbours say about a window's pose.
/// @return false, *out unchanged, where a neighbour is missing or the scatter is not known
bool neighbour_prior(const WindowMotion& motion, const MotionScatter& scatter, const double (&centre_m)[3],
                     std::size_t window, PosePrior* out);

}  // namespace lecalib
