// SPDX-License-Identifier: MIT
/// From events to a calibrated camera: strings the stages together, in bounded pieces of work.
///
///     push: events -> window
///     step: window -> noise filter -> lines -> bank
///           bank -> matches -> points -> camera, in rounds: the next round matches through the camera of the last
///
/// A camera comes from the lines' edges (see edge_points.hpp) where they determine it, else from the lines themselves.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/arena.hpp"
#include "lecalib/core/records.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/events/noise_filter.hpp"
#include "lecalib/events/window_builder.hpp"
#include "lecalib/match/line_matcher.hpp"
#include "lecalib/pipeline/capacities.hpp"
#include "lecalib/pipeline/coverage.hpp"
#include "lecalib/pipeline/edge_points.hpp"
#include "lecalib/pipeline/line_bank.hpp"
#include "lecalib/pipeline/line_detector.hpp"
#include "lecalib/pipeline/mono_solver.hpp"
#include "lecalib/pipeline/view_points.hpp"
#include "lecalib/pipeline/window_length.hpp"
#include "lecalib/solve/gyro_prior.hpp"

namespace lecalib {

/// Defaults suit any sensor and object; ranges stand with the fields of each stage. Sensor sizes inside of the stages'
/// options are set from the capacities, LineMatcherOptions::provisional from rounds.
struct MonoOptions {
  WindowLengthOptions window;
  NoiseFilterOptions noise;
  DetectorOptions detector;
  LineMatcherOptions matcher;
  ViewPointOptions points;
  bool windows_on_grid = false;  ///< see WindowOptions::on_grid; set where two cameras are calibrated together
  bool use_edges = true;         ///< false: lines only, ten times less sure of flat objects, at 30 ns less per event
  EdgePointOptions edges;
  MonoSolverOptions solver = recorded_lines();
  /// Readings of a gyro that is fixed to the camera, on the events' clock, in order of time: they tell how the camera
  /// has turned from each window's begin to its end. Must outlive the calibrator; may be empty.
  Span<const GyroSample> gyro_samples = {};
  GyroOptions gyro;
  int rounds = 2;  ///< of matching and solving, >= 1; the second one finds matches that a rough camera missed

  /// What differs from the solver's own defaults, which suit points that were measured elsewhere.
  static MonoSolverOptions recorded_lines();
};

/// What went through and what did not.
struct MonoStats {
  WindowStats windows;
  NoiseFilterStats noise;
  std::uint64_t lines = 0;          ///< detected, over all windows
  std::uint64_t lines_dropped = 0;  ///< detected, beyond the capacity of a window
  std::uint32_t windows_kept = 0;   ///< in the bank
  std::uint32_t windows_matched = 0;
  std::uint32_t matches = 0;
  std::uint32_t turns = 0;                          ///< windows whose turn the gyro tells, of those matched
  std::uint64_t stage_ns[kNumDetectorStages] = {};  ///< of detection, where the options give a clock
  LineMatcherStats matcher;
  EdgePointStats edges;                 ///< of the last round
  bool edges_used = false;              ///< the result comes from edges
  std::uint32_t crossings_dropped = 0;  ///< pixels that edges left out for want of room
};

enum class MonoPhase : std::uint8_t { idle, collecting, matching, solving, done, failed };
/// The phase's name. Never null.
const char* to_string(MonoPhase phase) noexcept;

/// Everything a MonoCalibrator keeps in the caller's memory.
struct MonoWorkspace {
  Span<Event> events;
  LineBank bank;
  Span<EventLine> lines;  ///< of the current window
  Span<float> travel;
  // Collecting and solving never run together: their parts share the same bytes.
  NoiseFilterWorkspace noise;
  DetectorWorkspace detector;
  Span<std::max_align_t> matcher;
  MonoSolverWorkspace solver;
  Span<LinePoint> points;
  Span<EdgePoint> edges;
  Span<View> views;
  Span<Pose> start_poses;
  Span<WindowPrediction> predictions;
  Span<RelativePrior> turns;  ///< one per window
};

/// What the stages must hold so that the calibrator holds `capacities`.
constexpr DetectorCapacities detector_capacities(const Capacities& c) {
  DetectorCapacities out;
  out.events = c.events_per_window;
  out.lines = c.lines_per_window;
  out.width = c.sensor_width;
  out.height = c.sensor_height;
  out.edges = c.edges;
  if (!c.reference_detector) out.surface_points = out.regions = out.image_cells = 0;
  return out;
}
constexpr LineMatcherCapacities matcher_capacities(const Capacities& c) {
  LineMatcherCapacities out;
  out.windows = c.windows;
  out.lines = c.lines_per_window;
  out.model_lines = c.model_lines;
  if (out.matches > c.lines_per_window) out.matches = c.lines_per_window;  // a detected line has one match at most
  return out;
}
constexpr MonoSolverCapacities solver_capacities(const Capacities& c) {
  MonoSolverCapacities out;
  out.views = 2 * std::size_t{c.windows};
  out.points = out.views * matcher_capacities(c).matches * c.points_per_line;
  out.model_lines = c.model_lines;
  if (c.edges) out.edge_points = c.windows * matcher_capacities(c).matches * kEdgePointsPerMatch;
  return out;
}

template <class Carver>
constexpr bool carve(Carver& carver, const Capacities& c, MonoWorkspace* out) {
  if (!carver.carve(c.events_per_window, &out->events) || !out->bank.carve(carver, c.windows, c.lines_per_window) ||
      !carver.carve(c.lines_per_window, &out->lines) || !carver.carve(c.lines_per_window, &out->travel)) {
    return false;
  }
  const std::size_t shared = carver.mark();
  FlickerFilter flicker;  // remembers earlier windows; the other filters are done when detection begins
  if (!flicker.carve(carver, c.sensor_width, c.sensor_height)) return false;
  const std::size_t window = carver.mark();
  if (!carve(carver, NoiseFilterCapacities{c.sensor_width, c.sensor_height, false}, &out->noise)) return false;
  out->noise.flicker = flicker;
  carver.rewind(window);
  if (!carve(carver, detector_capacities(c), &out->detector)) return false;
  carver.rewind(shared);
  ArenaMeter matcher;
  LineMatcherWorkspace ignored;
  (void)carve(matcher, matcher_capacities(c), &ignored);
  const MonoSolverCapacities solver = solver_capacities(c);
  return carver.carve(matcher.peak() / sizeof(std::max_align_t) + 1, &out->matcher) &&
         carve(carver, solver, &out->solver) && carver.carve(solver.points, &out->points) &&
         carver.carve(solver.edge_points, &out->edges) && carver.carve(solver.views, &out->views) &&
         carver.carve(solver.views, &out->start_poses) && carver.carve(c.windows, &out->predictions) &&
         carver.carve(c.windows, &out->turns);
}

/// Bytes that MonoCalibrator::init() needs.
constexpr std::size_t required_bytes(const Capacities& capacities) {
  ArenaMeter meter;
  MonoWorkspace workspace;
  (void)carve(meter, capacities, &workspace);
  return meter.peak();
}

/// What edges take beyond lines, by pointers: where these are null, nothing refers to the code and the linker leaves it
/// out.
struct EdgeStages {
  EdgeFinder find = nullptr;
  decltype(&make_edge_points) make_points = nullptr;
  decltype(&MonoSolver::init_on_edges) init_solver = nullptr;
};

/// Calibrates one camera. push() and step() touch the same window: call them from one thread; a sensor's interrupt
/// fills an EventRing that the thread drains.
class MonoCalibrator {
 public:
  /// Carves everything; nothing is carved later. A second init() starts anew.
  /// @param memory at least required_bytes(capacities), aligned to kArenaAlign; must outlive the calibrator
  /// @param model  must outlive the calibrator
  /// @return ok | buffer_too_small |
  ///         capacity_exceeded (model lines, points per line, no room for the detector chosen) |
  ///         invalid_argument (options, capacities) | too_few_lines (fewer than 4 model lines)
  [[gnu::always_inline]] Status init(Span<std::byte> memory, const Capacities& capacities, const MonoOptions& options,
                                     Span<const ModelLine> model) {
    // Inline, so that a program without Capacities::edges, known when it is compiled, does not hold their code.
    EdgeStages edges;
    if (capacities.edges) {
      edges.find = line_edges;
      edges.make_points = make_edge_points;
      edges.init_solver = &MonoSolver::init_on_edges;
    }
    return init(memory, capacities, options, model, edges);
  }

  /// Takes events from the front of *events.
  /// @return ok (all taken) | in_progress (a window is full: call step() before the rest can be pushed) | wrong_state
  Status push(Span<const Event>* events);

  /// Events are missing between those pushed and those to come: no window holds both. What was pushed since the last
  /// full window goes. @return ok | in_progress (a window is full: call step() first) | wrong_state
  Status cut();

  /// No more events come: what is there is solved by further calls of step(). @return ok | wrong_state
  Status finish();

  /// One bounded piece of work: one window's lines, a step of the matcher or one iteration of the solver.
  /// @return in_progress (call again) | need_more_data (push() or finish()) | ok (result() is there) | wrong_state
  ///         (before init()) | final: why there is no result: too_few_lines (no window with lines), no_match, or what
  ///         MonoSolver::step() gives
  Status step();

  /// The camera, and two views for each matched window: at its begin and its end, or, from edges, kEdgeTime of half of
  /// it before and after its middle.
  /// @return ok | what the last step() returned; *out is the refused solution then, for diagnosis, where there is one
  Status result(CalibrationResult* out) const;

  /// Times of result()'s views.
  [[nodiscard]] Span<const View> views() const { return workspace_.views.first(num_views_); }
  [[nodiscard]] MonoPhase phase() const { return phase_; }
  /// 0 to 1, never 1 before success. It stays at 0 while events are collected: nobody knows how many will come.
  [[nodiscard]] float progress() const;
  [[nodiscard]] const MonoStats& stats() const { return stats_; }
  /// The search for the model, for what it tells of one that ended in no_match.
  [[nodiscard]] const LineMatcher& matcher() const { return matcher_; }

  /// What was seen so far and what is missing; at any time after init(). What the poses tell is there once the object
  /// was matched, and what the solution tells once step() has ended.
  /// Complexity: some thousand line projections once the object is matched; call it when somebody wants to know.
  [[nodiscard]] Coverage coverage() const;

  // What step() does while events are collected, in parts, and what it holds in the end: for those that calibrate
  // several cameras on one clock together (stereo_calibrator.hpp).

  /// The full window that step() would work on next; null: there is none.
  [[nodiscard]] const EventWindow* full_window() const { return has_window_ ? &window_ : nullptr; }
  /// Ends the window that is being filled. @return whether there is a full one
  bool close_window();
  /// Finds the lines of full_window(), which is none any longer.
  /// @param out its lines are valid until the next window is full
  /// @return ok | wrong_state (no full window) | what detect_lines() gives: then the calibrator has failed
  Status find_lines(LineWindow* out);
  /// Takes the lines of a window. @param information see LineBank::add()
  void keep(const LineWindow& window, float information);
  /// The length that this camera's next window should have. @return microseconds
  [[nodiscard]] std::int64_t wanted_length_us(Span<const EventLine> lines) const;
  /// @return in_progress | what set_length_us() of WindowBuilder gives: then the calibrator has failed
  Status set_window_length_us(std::int64_t length_us);

  /// The windows that were matched, two of views() each, in this order.
  [[nodiscard]] Span<const WindowPoses> matched_windows() const { return matcher_.poses(); }
  /// The result comes from edges; else from lines.
  [[nodiscard]] bool is_from_edges() const { return on_edges_; }
  /// Once step() has returned ok and is_from_edges(): solves anew by lines, by further calls of step().
  /// @return in_progress | wrong_state | why not
  Status use_lines();
  [[nodiscard]] MonoSolver& solver() { return solver_; }

 private:
  Status init(Span<std::byte> memory, const Capacities& capacities, const MonoOptions& options,
              Span<const ModelLine> model, const EdgeStages& edges);
  Status detect();
  Status begin_matching();
  Status begin_solving(bool on_edges);
  Status start_solver();
  Status make_points(ViewsMade* made);
  std::size_t find_turns();
  Status begin_next_round();
  Status advance(Status status);
  Status fail(Status status);

  Capacities capacities_;
  MonoOptions options_;
  EdgeStages edges_;
  MonoWorkspace workspace_;
  Span<const ModelLine> model_;
  WindowBuilder builder_;
  CoverageMap coverage_;
  LineMatcher matcher_;
  MonoSolver solver_;
  MonoStats stats_;
  EventWindow window_;
  std::int64_t window_length_us_ = 0;
  std::size_t num_views_ = 0;
  std::uint64_t steps_ = 0;  ///< of matcher and solver, for progress()
  int round_ = 0;
  bool has_window_ = false;
  bool on_edges_ = false;  ///< what is being solved stands for edges
  bool finishing_ = false;
  Status verdict_ = Status::wrong_state;
  MonoPhase phase_ = MonoPhase::idle;
};

}  // namespace lecalib
