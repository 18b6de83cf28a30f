// SPDX-License-Identifier: MIT
/// A hypothesis about the camera and the object's motion, followed through the windows of a recording: each window's
/// pose is predicted from its neighbours and fitted, then one lens is refined for all of them.
#pragma once

#include "lecalib/match/window_fit.hpp"

namespace lecalib {

struct WindowTimes {
  std::int64_t begin_us;
  std::int64_t end_us;
};

/// What is looked at: the model and the lines of all windows.
struct MatchScene {
  std::uint16_t width = 0, height = 0;
  double unit_px = 1.0;  ///< scale of all tolerances: a thousandth of the image's diagonal, not below a pixel
  Span<const ModelLine> model;
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

/// The hypothesis in one window.
struct WindowTrack {
  Pose pose[kNumInstants];  ///< by Instant
  double score;             ///< Support::score
  double possible;
  double rms_px;
  std::uint16_t num_lines;    ///< model lines matched
  std::uint16_t num_matches;  ///< detected lines matched
  bool matched;
};

/// The hypothesis in all windows.
struct LineTrack {
  Optics optics;
  double score = 0;  ///< sum over matched windows
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
  Span<FlatLine> flat;           ///< [lines per window]
  Span<LensView> views;          ///< [windows]
  Span<LensViewSystem> systems;  ///< [windows]
};

/// Flat lines of a window, in the scratch.
Span<const FlatLine> flatten_window(const MatchScene& scene, const Optics& optics, std::size_t window,
                                    MatchScratch* scratch);
FlatFrame frame_of(const MatchScene& scene, const Optics& optics);

inline constexpr std::size_t kMaxPredictions = 5;

/// Poses to expect at the middle of a window, from the nearest matched windows on both sides.
/// @return their number, 0 when no window is matched yet
std::size_t predict_poses(const MatchScene& scene, const LineTrack& track, std::size_t window,
                          Pose out[kMaxPredictions]);

/// Fits one window from each of the starts and keeps the best fit, if it is good enough; else the window counts as
/// lost.
/// @param[in,out] dropped matches beyond the capacity are added
void match_window(const MatchScene& scene, std::size_t window, Span<const Pose> starts, FitStart from,
                  MatchScratch* scratch, LineTrack* track, std::uint32_t* dropped);

/// One refinement step of the lens and of all matched windows' middle poses.
/// @return false when nothing was or could be refined
bool refine_track_lens(const MatchScene& scene, const LensPrior& prior, MatchScratch* scratch, LineTrack* track);

/// Adds up score and windows.
void sum_up(LineTrack* track);

}  // namespace lecalib
