// SPDX-License-Identifier: MIT
/// The correspondence search: which detected line is which line of the model, with nothing known about the camera but
/// the size of its sensor.
///
///   bends of all lines -> one coefficient of distortion
///   quadrilaterals of some windows <-> quadrilaterals of the model -> guesses of focal length and pose
///   each good guess: fit in its window -> follow through all windows -> one lens for all -> fit again
///   the guess that explains most of all windows wins, if it explains enough and no rival with another camera does too
/// Hints bring guesses forward and decide between rivals.
///
/// Rough by intent: the result starts a refinement, and rematch() takes its camera back for the final matches. A wide
/// lens needs more coefficients than one, and leaves the right guess little better than a wrong one; so the verdict may
/// be left to rematch() too (LineMatcherOptions::provisional).
#pragma once

#include "lecalib/core/arena.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/match/bend_distortion.hpp"
#include "lecalib/match/seed_search.hpp"
#include "lecalib/match/track_comparison.hpp"

namespace lecalib {

struct LineMatcherCapacities {
  std::size_t windows = 64;
  std::size_t lines = 64;  ///< per window; of more the longest are used, the others counted
  std::size_t model_lines = 48;
  std::size_t model_quads = 16;  ///< the largest faces of the model
  std::size_t matches = 64;      ///< per window
  std::size_t seeds = 32;        ///< guesses that are kept for a trial over all windows
  ImageQuadCapacities quads;
};

struct LineMatcherOptions {
  std::uint16_t width = 0, height = 0;  ///< sensor, px
  double min_fov_deg = 20.0;            ///< horizontal field of view of the pinhole, [5, max)
  double max_fov_deg = 130.0;           ///< (min, 160]
  std::size_t seed_windows = 16;        ///< windows that are searched for guesses, spread evenly; >= 1
  std::size_t trials = 8;               ///< guesses that are followed through all windows; >= 1
  /// true: rematch() follows through the camera that is solved from the first result, and judges it. What one
  /// coefficient of distortion leaves open then passes at first.
  bool provisional = false;
  MatchHints hints;  ///< none by default; a focal length widens the range of views to itself
};

/// Whether the options lie in their ranges, as LineMatcher::init() asks. A hint may widen the range of views as far as
/// there are steps for: focal lengths of up to 25 sensor widths by default.
[[nodiscard]] bool valid(const LineMatcherOptions& options);

/// Where the object is in one window.
struct WindowPoses {
  std::uint16_t window;
  std::uint16_t num_lines;    ///< model lines matched
  std::uint32_t first_match;  ///< into LineMatcher::matches()
  std::uint32_t num_matches;
  double rms_px;
  Pose begin;
  Pose end;
};

/// Counters of everything the search left out, and the figures behind its verdict.
struct LineMatcherStats {
  std::uint32_t lines_dropped = 0;  ///< detected lines beyond the capacity, over all windows
  std::uint32_t model_quads_dropped = 0;
  SeedStats seeds;
  std::uint32_t seeds_dropped = 0;
  std::uint32_t matches_dropped = 0;
  std::uint32_t trials = 0;  ///< guesses followed through all windows
  double score = 0;          ///< of the winner: model lines explained, summed over windows
  double possible = 0;       ///< what a complete explanation of its windows would score
  double rival_score = 0;    ///< best trial with other matches and another focal length
  double rival_focal_px = 0;
  bool ambiguous = false;     ///< the rival explains nearly as much as what is judged: no_match
  bool against_hint = false;  ///< the winner contradicts a hint
};

/// A pose known beforehand, for rematch().
struct WindowPrediction {
  std::uint16_t window;
  Pose begin;
  Pose end;
};

struct LineMatcherWorkspace {
  MatchScratch scratch;
  ImageQuadWorkspace quads;
  Span<ModelQuad> model_quads;
  Span<ModelSides> model_sides;
  Span<EventLine> lines;           ///< of all windows, within the capacity
  Span<std::uint16_t> line_ids;    ///< their indices in the caller's windows
  Span<std::uint32_t> first_line;  ///< [windows + 1]
  Span<WindowTimes> times;
  Span<MatchSeed> seeds;
  LineTrack trial;
  LineTrack best;
  Span<LineMatch> matches;
  Span<WindowPoses> poses;
};

template <class Carver>
constexpr bool carve(Carver& carver, const LineMatcherCapacities& c, LineTrack* out) {
  return carver.carve(c.windows, &out->windows) && carver.carve(c.windows * c.matches, &out->matches);
}

template <class Carver>
constexpr bool carve(Carver& carver, const LineMatcherCapacities& c, MatchScratch* out) {
  AssignmentCapacities assignment;
  assignment.model_lines = c.model_lines;
  assignment.lines = c.lines;
  assignment.candidates = 4 * c.matches;
  assignment.assignments = c.matches;
  return carve(carver, assignment, &out->assignment) && carver.carve(c.lines, &out->flat) &&
         carver.carve(c.windows, &out->views) && carver.carve(c.windows, &out->systems) &&
         carver.carve(c.windows, &out->values) && carver.carve(c.model_lines, &out->votes) &&
         carver.carve(c.model_lines, &out->contrast) && carver.carve(c.lines, &out->line_contrast);
}

template <class Carver>
constexpr bool carve(Carver& carver, const LineMatcherCapacities& c, LineMatcherWorkspace* out) {
  return carve(carver, c, &out->scratch) && carve(carver, c.quads, &out->quads) &&
         carver.carve(c.model_quads, &out->model_quads) && carver.carve(c.model_lines, &out->model_sides) &&
         carver.carve(c.windows * c.lines, &out->lines) && carver.carve(c.windows * c.lines, &out->line_ids) &&
         carver.carve(c.windows + 1, &out->first_line) && carver.carve(c.windows, &out->times) &&
         carver.carve(c.seeds, &out->seeds) && carve(carver, c, &out->trial) && carve(carver, c, &out->best) &&
         carver.carve(c.windows * c.matches, &out->matches) && carver.carve(c.windows, &out->poses);
}

class LineMatcher {
 public:
  /// Copies the lines; the model must outlive the matcher. A second init() starts anew.
  /// @param windows in order of time
  /// @return ok | buffer_too_small (arena) | capacity_exceeded (windows, model lines) | invalid_argument (options, a
  /// value of model or lines that is not finite) | too_few_lines (model below 4 lines, or no window) |
  /// degenerate_geometry (model lines all parallel, or no four of them around a flat face)
  Status init(Arena* arena, const LineMatcherCapacities& capacities, const LineMatcherOptions& options,
              Span<const ModelLine> model, Span<const LineWindow> windows);

  /// A bounded piece of the search: one quadrilateral, or one window.
  /// @return in_progress | ok (results are there) | no_match (nothing explains enough, or ambiguous: see stats()) |
  /// wrong_state (before init())
  Status step();

  /// Matches again through a known camera: predicted poses are fitted with tight gates, windows without one follow from
  /// their neighbours. Then step() as before; camera() keeps the given one.
  /// @param predictions any order; a later one for the same window replaces an earlier one
  /// @return ok | wrong_state (before init()) | invalid_argument (camera, its size, a window's index, no prediction)
  Status rematch(const Camera& camera, Span<const WindowPrediction> predictions);

  /// Valid once step() returned ok, until the next init() or rematch(). Ordered by window.
  [[nodiscard]] Span<const LineMatch> matches() const { return workspace_.matches.first(num_matches_); }
  [[nodiscard]] Span<const WindowPoses> poses() const { return workspace_.poses.first(num_poses_); }
  [[nodiscard]] const Camera& camera() const { return camera_; }
  /// What the guess that explains most says, also where it is not believed (no_match): in how many windows it finds the
  /// object, and in how many of these a model line, < the model's size. 0 before there is a guess.
  [[nodiscard]] std::size_t windows_explained() const { return best_.num_windows; }
  [[nodiscard]] std::size_t windows_with(std::size_t model_line) const;
  /// Valid at any time.
  [[nodiscard]] const LineMatcherStats& stats() const { return stats_; }

 private:
  enum class Phase : std::uint8_t { idle, bends, quads, select, follow, settle, finish, done, failed };

  Status copy_lines(const LineMatcherCapacities& capacities, Span<const LineWindow> windows);
  void step_bends();
  void step_quads();
  void step_select();
  void step_follow();
  void step_settle();
  void judge_trial();
  Status step_finish();
  [[nodiscard]] bool is_repeated(const MatchSeed& seed) const;
  [[nodiscard]] bool agrees_with_hints(const LineTrack& track) const;
  void publish();

  Phase phase_ = Phase::idle;
  LineMatcherOptions options_;
  LineMatcherWorkspace workspace_;
  MatchScene scene_;
  LensPrior prior_;
  LineMatcherStats stats_;

  BendVotes bends_;
  std::size_t next_ = 0;  ///< what the phase works on: a window or a place in its order of windows

  SeedWindow seeding_;
  Span<const ImageQuad> image_quads_;
  std::size_t next_quad_ = 0;
  BoundedBest<MatchSeed> seeds_;

  LineTrack trial_;
  LineTrack best_;
  std::size_t seed_window_ = 0;
  MotionScatter scatter_;
  int round_ = 0;  ///< of settle: lens, fit, lens, fit

  bool known_camera_ = false;
  Camera camera_;
  std::size_t num_matches_ = 0;
  std::size_t num_poses_ = 0;
};

}  // namespace lecalib
