// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/mono_calibrator.hpp"

#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// Steps of matcher and solver after which progress() stands half way to its end.
constexpr float kHalfWaySteps = 200;

/// Where the views of edges stand between a window's begin (0) and end (1), and where those stand between the views.
constexpr double kFirstView = 0.5 - 0.5 * static_cast<double>(kEdgeTime);
constexpr double kBeginFromViews = 0.5 - 0.5 / static_cast<double>(kEdgeTime);

/// The pose at a fraction of the way from one to another, or beyond them.
Pose pose_between(const Pose& from, const Pose& to, double fraction) {
  const Mat3 R = rotation_of(from);
  const Mat3 turn = so3_exp(fraction * so3_log(rotation_of(to) * R.transpose()));
  return make_pose(turn * R, (1 - fraction) * translation_of(from) + fraction * translation_of(to));
}

/// Whether the capacities are in the ranges that their docstrings give.
bool capacities_are_valid(const Capacities& c) {
  const auto lies_in = [](std::uint32_t value, std::uint32_t first, std::uint32_t last) {
    return value - first <= last - first;
  };
  return c.events_per_window >= 2 && lies_in(c.lines_per_window, 1, kMaxLines) && lies_in(c.windows, 1, 0xffff) &&
         c.model_lines <= 0xffff && lies_in(c.sensor_width, 2, kMaxSensorSide) &&
         lies_in(c.sensor_height, 2, kMaxSensorSide);
}

/// Below so many events per crossing an edge's place is not known well, see EdgePointOptions.
constexpr float kFaintEvents = 1.4F;

/// Whether most of the matched edges make about one event per crossing.
bool on_faint_edges(Span<const LineWindow> windows, Span<const LineMatch> matches) {
  std::size_t edges = 0;
  std::size_t faint = 0;
  for (const LineMatch& match : matches) {
    const LineEdge& edge = windows[match.window].lines[match.line].edge;
    if (edge.crossings == 0) continue;
    ++edges;
    if (edge.events_per_crossing < kFaintEvents) ++faint;
  }
  return 2 * faint > edges;
}

}  // namespace

const char* to_string(MonoPhase phase) noexcept {
  switch (phase) {
    case MonoPhase::idle: return "idle";
    case MonoPhase::collecting: return "collecting";
    case MonoPhase::matching: return "matching";
    case MonoPhase::solving: return "solving";
    case MonoPhase::done: return "done";
    case MonoPhase::failed: return "failed";
  }
  return "unknown";
}

MonoSolverOptions MonoOptions::recorded_lines() {
  MonoSolverOptions options;
  options.policy.aspect_sd = 0.005;
  options.policy.higher_radial_sd = 0.1;
  options.covariance.line_errors = {0.5, 0.2, 0.1};
  options.plausibility.max_focal_sigma = 0.02;
  // Four sigma of the prior: only a model of other dimensions pulls pixels of any real sensor so far from square.
  options.plausibility.max_aspect = 1.02;
  // Lenses sit over the sensor's centre to about 5 % of its width; four sigma of that.
  options.policy.spatial_centre_sd = 0.05;
  options.plausibility.centre_margin = -0.3;
  // The lines' sigmas hold their systematic part: the right model stays at about 1 or below.
  options.plausibility.max_chi2_per_dof = 2;
  return options;
}

Status MonoCalibrator::init(Span<std::byte> memory, const Capacities& capacities, const MonoOptions& options,
                            Span<const ModelLine> model, const EdgeStages& edges) {
  phase_ = MonoPhase::idle;
  verdict_ = Status::wrong_state;
  if (options.rounds < 1 || !capacities_are_valid(capacities) || !valid(options.window) || !valid(options.detector) ||
      !valid(options.points)) {
    return Status::invalid_argument;
  }
  if (model.size() < 4) return Status::too_few_lines;
  if (model.size() > capacities.model_lines || options.points.points_per_line > capacities.points_per_line ||
      (options.detector.find_lines != fast_detector && !capacities.reference_detector)) {
    return Status::capacity_exceeded;
  }
  Arena arena(memory);
  if (!carve(arena, capacities, &workspace_)) return Status::buffer_too_small;

  capacities_ = capacities;
  options_ = options;
  options_.use_edges = options.use_edges && capacities.edges;
  edges_ = edges;
  options_.noise.width = options_.detector.cloud.width = options_.matcher.width = capacities.sensor_width;
  options_.noise.height = options_.detector.cloud.height = options_.matcher.height = capacities.sensor_height;
  options_.matcher.provisional = options_.rounds > 1;
  if (!valid(options_.matcher)) return Status::invalid_argument;
  model_ = model;
  window_length_us_ = options.window.first_us;
  WindowOptions window;
  window.length_us = window_length_us_;
  window.on_grid = options.windows_on_grid;
  if (const Status status = builder_.init(window, workspace_.events); status != Status::ok) return status;
  workspace_.bank.clear();
  coverage_.clear(capacities.sensor_width, capacities.sensor_height);
  stats_ = {};
  num_views_ = 0;
  steps_ = 0;
  round_ = 0;
  has_window_ = false;
  finishing_ = false;
  verdict_ = Status::in_progress;
  phase_ = MonoPhase::collecting;
  return Status::ok;
}

Status MonoCalibrator::push(Span<const Event>* events) {
  if (phase_ != MonoPhase::collecting || finishing_) return Status::wrong_state;
  if (has_window_) return Status::in_progress;
  const Status status = builder_.push(events, &window_);
  if (status == Status::need_more_data) return Status::ok;
  if (status != Status::ok) return status;
  has_window_ = true;
  return Status::in_progress;
}

Status MonoCalibrator::cut() {
  if (phase_ != MonoPhase::collecting || finishing_) return Status::wrong_state;
  if (has_window_) return Status::in_progress;
  builder_.cut();
  stats_.windows = builder_.stats();
  return Status::ok;
}

Status MonoCalibrator::finish() {
  if (phase_ != MonoPhase::collecting) return Status::wrong_state;
  finishing_ = true;
  return Status::ok;
}

Status MonoCalibrator::step() {
  switch (phase_) {
    case MonoPhase::collecting:
      if (has_window_) return detect();
      if (!finishing_) return Status::need_more_data;
      if (close_window()) return detect();
      return begin_matching();
    case MonoPhase::matching:
    case MonoPhase::solving: ++steps_; return advance(phase_ == MonoPhase::matching ? matcher_.step() : solver_.step());
    case MonoPhase::idle:
    case MonoPhase::done:
    case MonoPhase::failed: break;
  }
  return verdict_;
}

bool MonoCalibrator::close_window() {
  if (phase_ == MonoPhase::collecting && !has_window_) has_window_ = builder_.finish(&window_) == Status::ok;
  return has_window_;
}

/// window -> lines -> bank, and the length of the next window.
Status MonoCalibrator::detect() {
  LineWindow window;
  const Status status = find_lines(&window);
  if (status != Status::ok) return status;
  keep(window, LineBank::information_of(window.lines.first(capacities_.lines_per_window)));
  return set_window_length_us(wanted_length_us(window.lines));
}

Status MonoCalibrator::find_lines(LineWindow* out) {
  if (!has_window_) return Status::wrong_state;
  has_window_ = false;
  EventWindow window;
  Status status = filter_noise(window_, options_.noise, &workspace_.noise, workspace_.events, &window, &stats_.noise);
  if (status != Status::ok) return fail(status);
  DetectorStats detected;
  std::size_t count = 0;
  // A crossing of which events were thinned out tells nothing.
  const bool thinned = builder_.stats().thinned != stats_.windows.thinned;
  options_.detector.find_edges = options_.use_edges && !thinned ? edges_.find : nullptr;
  status = detect_lines(window, options_.detector, &workspace_.detector, workspace_.lines, &count, &detected);
  if (status != Status::ok) return fail(status);
  stats_.windows = builder_.stats();
  stats_.lines += count;
  stats_.lines_dropped += detected.lines_dropped;
  stats_.crossings_dropped += detected.crossings_dropped;
  for (std::size_t i = 0; i < kNumDetectorStages; ++i) stats_.stage_ns[i] += detected.stage_ns[i];
  *out = {window.begin_us, window.end_us, {workspace_.lines.data(), count}};
  return Status::ok;
}

void MonoCalibrator::keep(const LineWindow& window, float information) {
  workspace_.bank.add(window, information);
  coverage_.add(window.lines);
}

std::int64_t MonoCalibrator::wanted_length_us(Span<const EventLine> lines) const {
  return next_window_length(options_.window, window_length_us_, lines, workspace_.travel);
}

Status MonoCalibrator::set_window_length_us(std::int64_t length_us) {
  window_length_us_ = length_us;
  const Status status = builder_.set_length_us(length_us);
  return status == Status::ok ? Status::in_progress : fail(status);
}

Status MonoCalibrator::begin_matching() {
  const Span<const LineWindow> windows = workspace_.bank.windows();
  stats_.windows_kept = static_cast<std::uint32_t>(windows.size());
  Arena arena(
      {reinterpret_cast<std::byte*>(workspace_.matcher.data()), workspace_.matcher.size() * sizeof(std::max_align_t)});
  const Status status = matcher_.init(&arena, matcher_capacities(capacities_), options_.matcher, model_, windows);
  if (status != Status::ok) return fail(status);
  phase_ = MonoPhase::matching;
  return Status::in_progress;
}

/// What follows a step of the matcher or the solver.
Status MonoCalibrator::advance(Status status) {
  if (status == Status::in_progress) return status;
  stats_.matcher = matcher_.stats();
  if (phase_ == MonoPhase::solving && status != Status::ok && on_edges_) return begin_solving(false);
  if (status != Status::ok) return fail(status);
  if (phase_ == MonoPhase::matching) return begin_solving(options_.use_edges);
  stats_.edges_used = on_edges_;
  if (++round_ < options_.rounds) return begin_next_round();
  phase_ = MonoPhase::done;
  return verdict_ = Status::ok;
}

/// How the camera turned in each matched window, where the gyro tells. @return how many do
std::size_t MonoCalibrator::find_turns() {
  std::size_t count = 0;
  for (std::size_t v = 0; v + 1 < num_views_; v += 2) {
    RelativePrior& turn = workspace_.turns[count];
    turn.view_a = static_cast<std::uint32_t>(v);
    turn.view_b = static_cast<std::uint32_t>(v + 1);
    const std::int64_t begin_us = workspace_.views[v].t_us;
    const std::int64_t end_us = workspace_.views[v + 1].t_us;
    if (integrate_gyro(options_.gyro, options_.gyro_samples, begin_us, end_us, &turn) == Status::ok) ++count;
  }
  stats_.turns = static_cast<std::uint32_t>(count);
  return count;
}

/// matches -> points, of edges or of lines
Status MonoCalibrator::make_points(ViewsMade* made) {
  const Span<const LineWindow> windows = workspace_.bank.windows();
  if (!on_edges_) {
    return make_view_points(options_.points, windows, matcher_.matches(), workspace_.points, workspace_.views, made);
  }
  return edges_.make_points(options_.edges, windows, matcher_.matches(),
                            {workspace_.points, workspace_.edges, workspace_.views}, made, &stats_.edges);
}

/// @param on_edges solve by edges, or else, and where these don't suffice, by lines
Status MonoCalibrator::begin_solving(bool on_edges) {
  phase_ = MonoPhase::solving;
  on_edges_ = on_edges;
  Status status = start_solver();
  if (status != Status::ok && on_edges_) {
    on_edges_ = false;
    status = start_solver();
  }
  return status == Status::ok ? Status::in_progress : fail(status);
}

/// points -> solver, which starts from the matcher's camera and poses.
Status MonoCalibrator::start_solver() {
  const Span<const WindowPoses> poses = matcher_.poses();
  stats_.windows_matched = static_cast<std::uint32_t>(poses.size());
  stats_.matches = static_cast<std::uint32_t>(matcher_.matches().size());
  ViewsMade made;
  const Status status = make_points(&made);
  if (status != Status::ok) return status;
  num_views_ = made.views;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double first = on_edges_ ? kFirstView : 0.0;
    workspace_.start_poses[2 * i] = pose_between(poses[i].begin, poses[i].end, first);
    workspace_.start_poses[2 * i + 1] = pose_between(poses[i].end, poses[i].begin, first);
  }
  CalibrationData data = {capacities_.sensor_width,
                          capacities_.sensor_height,
                          model_,
                          {workspace_.points.data(), made.points},
                          {workspace_.views.data(), num_views_}};
  MonoSolverOptions solver = options_.solver;
  if (on_edges_) {
    data.edges = {workspace_.edges.data(), made.points};
    solver.covariance.line_errors = {};  // offsets are estimated
  }
  data.relative = workspace_.turns.first(find_turns());
  const MonoStart start = {matcher_.camera(), {workspace_.start_poses.data(), num_views_}};
  return on_edges_ ? (solver_.*edges_.init_solver)(data, solver, workspace_.solver, start)
                   : solver_.init(data, solver, workspace_.solver, start);
}

/// Matches anew through the camera that was just found.
Status MonoCalibrator::begin_next_round() {
  const CalibrationResult& result = solver_.result();
  const Span<const WindowPoses> poses = matcher_.poses();
  std::size_t count = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const ViewResult& begin = result.views[2 * i];
    const ViewResult& end = result.views[2 * i + 1];
    if (!begin.used || !end.used) continue;
    const double before = on_edges_ ? kBeginFromViews : 0.0;
    workspace_.predictions[count++] = {poses[i].window, pose_between(begin.T_cam_world, end.T_cam_world, before),
                                       pose_between(end.T_cam_world, begin.T_cam_world, before)};
  }
  const Status status = matcher_.rematch(result.camera, {workspace_.predictions.data(), count});
  if (status != Status::ok) return fail(status);
  phase_ = MonoPhase::matching;
  return Status::in_progress;
}

Status MonoCalibrator::use_lines() {
  if (phase_ != MonoPhase::done || !on_edges_) return Status::wrong_state;
  return verdict_ = begin_solving(false);
}

Status MonoCalibrator::fail(Status status) {
  phase_ = MonoPhase::failed;
  return verdict_ = status;
}

Status MonoCalibrator::result(CalibrationResult* out) const {
  if (phase_ == MonoPhase::done || phase_ == MonoPhase::failed) *out = solver_.result();
  return phase_ == MonoPhase::collecting || phase_ == MonoPhase::matching || phase_ == MonoPhase::solving
             ? Status::wrong_state
             : verdict_;
}

Coverage MonoCalibrator::coverage() const {
  Coverage coverage = coverage_.seen();
  advise_collecting(&coverage);
  if (phase_ == MonoPhase::idle || phase_ == MonoPhase::collecting || phase_ == MonoPhase::matching) return coverage;
  const Span<const LineWindow> windows = workspace_.bank.windows();
  CoverageSolution solution;
  solution.camera = matcher_.camera();
  solution.model = model_;
  solution.faint = on_faint_edges(windows, matcher_.matches());
  const CalibrationResult& result = solver_.result();
  const bool ended = phase_ == MonoPhase::done || phase_ == MonoPhase::failed;
  if (ended && num_views_ > 0 && result.covariance[0] > 0.0) {
    solution.camera = result.camera;
    solution.covariance = result.covariance;
    solution.solved = verdict_ == Status::ok;
  }
  advise_found(solution, matcher_.poses(), &coverage);
  return coverage;
}

float MonoCalibrator::progress() const {
  if (phase_ == MonoPhase::done) return 1;
  const auto steps = static_cast<float>(steps_);
  return steps / (steps + kHalfWaySteps);
}

}  // namespace lecalib
