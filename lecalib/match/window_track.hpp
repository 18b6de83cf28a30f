// SPDX-License-Identifier: MIT
/// A hypothesis about the camera and the object's motion in all windows of a recording: each window's pose is fitted
/// from where it is expected, then one lens is refined for all of them.
#pragma once

#include "lecalib/match/contrast_votes.hpp"
#include "lecalib/match/window_fit.hpp"
#include "lecalib/match/window_motion.hpp"

namespace lecalib {

/// What is looked at: the model and the lines of all windows.
struct MatchScene {
  std::uint16_t width = 0, height = 0;
  double unit_px = 1.0;  ///< scale of all tolerances: a thousandth of the image's diagonal, not below a pixel
  ModelGraph model;
  Span<const EventLine> lines;           ///< of all windows, one after the other
  Span<const std::uint32_t> first_line;  ///< [windows + 1]
  Span<const WindowTimes> times;         ///< [windows]

  [[nodiscard]] Span<const EventLine> lines_of(std::size_t window) const {
    return lines.subspan(first_line[window], first_line[window + 1] - first_line[window]);
  }
};

/// What it is looked at through: a lens under estimation, or a known camera.
struct Optics {
  Lens lens;
  const Camera* camera = nullptr;  ///< when set it replaces the lens

  [[nodiscard]] double f_px() const { return camera != nullptr ? camera->fx : lens.f_px; }
};

/// The hypothesis in all windows.
struct LineTrack {
  Optics optics;
  double score = 0;  ///< sum over matched windows
  double found = 0;
  double possible = 0;
  std::size_t num_windows = 0;  ///< matched
  std::size_t matches_per_window = 0;
  Span<WindowTrack> windows;
  Span<LineMatch> matches;  ///< [windows x matches_per_window]

  [[nodiscard]] Span<LineMatch> matches_of(std::size_t window) const {
    return matches.subspan(window * matches_per_window, windows[window].num_matches);
  }
};

struct MatchScratch {
  AssignmentWorkspace assignment;
  Span<FlatLine> flat;              ///< [lines per window]
  Span<LensView> views;             ///< [windows]
  Span<LensViewSystem> systems;     ///< [windows]
  Span<double> values;              ///< [windows]
  Span<ContrastVote> votes;         ///< [model lines]
  Span<std::int8_t> contrast;       ///< [model lines] decided ones
  Span<std::int8_t> line_contrast;  ///< [lines per window]
};

/// Flat lines of a window, in the scratch.
Span<const FlatLine> flatten_window(const MatchScene& scene, const Optics& optics, std::size_t window,
                                    MatchScratch* scratch);
FlatFrame frame_of(const MatchScene& scene, const Optics& optics);

/// Where the fit of a window begins, and what holds it.
struct WindowStart {
  Span<const Pose> poses;
  FitStart from = FitStart::far;
  const PosePrior* prior = nullptr;  ///< may be null
  bool use_contrast = false;         ///< a match must not contradict the contrasts that were decided
};

/// Fits one window from each of the start's poses and keeps the best fit, if it is good enough; else the window counts
/// as lost.
/// @param[in,out] dropped matches beyond the capacity are added
void match_window(const MatchScene& scene, std::size_t window, const WindowStart& start, MatchScratch* scratch,
                  LineTrack* track, std::uint32_t* dropped);

/// Decides from all matches of a track which side of each model line is the brighter one: MatchScratch::contrast.
void decide_contrast(const MatchScene& scene, const LineTrack& track, MatchScratch* scratch);

/// One refinement step of the lens and of all matched windows' middle poses.
/// @return false when nothing was or could be refined
bool refine_track_lens(const MatchScene& scene, const LensPrior& prior, MatchScratch* scratch, LineTrack* track);

/// Adds up score and windows.
void sum_up(LineTrack* track);

}  // namespace lecalib
