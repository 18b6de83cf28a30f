// SPDX-License-Identifier: MIT
#include "lecalib/match/line_matcher.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/core/time.hpp"
#include "lecalib/math/so3.hpp"
#include "lecalib/math/trigonometry.hpp"

namespace lecalib {
namespace {

/// What is known of a lens nobody has seen: one sigma of the principal point as a share of the width, and of lambda
/// times the squared half diagonal around the bends' vote.
constexpr double kCentreSigma = 0.03;
constexpr double kLambdaSigma = 0.15;
constexpr double kFocalSigma = 0.5;
/// Rounds of "refine lens, fit all windows" in which a trial settles, and lens steps in each.
constexpr int kSettleRounds = 3;
constexpr int kLensSteps = 4;
/// A trial that explains less than this share of the best one's score is not settled.
constexpr double kHopelessShare = 0.5;
/// A hinted pose is about windows that begin so early in a recording, us: what moves by hand turns by less than the
/// hint may be off.
constexpr std::uint64_t kHintedUs = 200000;

/// The i-th of `count` windows that are searched, spread evenly, or with a hinted pose the half of them at the begin.
std::size_t even_window(std::size_t i, std::size_t count, std::size_t windows) {
  return (2 * i + 1) * windows / (2 * count);
}
std::size_t hinted_window(std::size_t i, std::size_t count, std::size_t windows) {
  const std::size_t first = (count + 1) / 2;
  return i < first ? i : first + even_window(i - first, count - first, windows - first);
}

bool is_finite(const EventLine& line) {
  const float values[] = {line.begin.x1, line.begin.y1,       line.begin.x2,    line.begin.y2,
                          line.end.x1,   line.end.y1,         line.end.x2,      line.end.y2,
                          line.bend_px,  line.sigma_begin_px, line.sigma_end_px};
  return std::all_of(std::begin(values), std::end(values), [](float v) { return std::abs(v) < 1e6F; });
}

double length2(const EventLine& line) {
  Vec2 points[kLinePoints];
  line_points(line, Instant::middle, points);
  return (points[2] - points[0]).squaredNorm();
}

double focal_of(double fov_deg, double width) { return 0.5 * width / tangent(deg_to_rad(0.5 * fov_deg)); }

/// The focal lengths that are searched.
FocalRange focal_range(const LineMatcherOptions& options) {
  FocalRange focal = {focal_of(options.max_fov_deg, options.width), focal_of(options.min_fov_deg, options.width)};
  if (const double hinted_px = options.hints.focal_px; hinted_px > 0.0) {
    focal.min_px = std::min(focal.min_px, (1.0 - options.hints.focal_share) * hinted_px);
    focal.max_px = std::max(focal.max_px, (1.0 + options.hints.focal_share) * hinted_px);
  }
  return focal;
}

}  // namespace

bool valid(const LineMatcherOptions& options) {
  if (options.width < 2 || options.height < 2 || options.seed_windows == 0 || options.trials == 0 ||
      !(options.min_fov_deg >= 5.0 && options.min_fov_deg < options.max_fov_deg && options.max_fov_deg <= 160.0) ||
      !options.hints.valid()) {
    return false;
  }
  const FocalRange focal = focal_range(options);
  return focal.max_px <= focal_span() * focal.min_px;
}

Status LineMatcher::init(Arena* arena, const LineMatcherCapacities& capacities, const LineMatcherOptions& options,
                         Span<const ModelLine> model, Span<const LineWindow> windows) {
  phase_ = Phase::idle;
  if (!valid(options)) return Status::invalid_argument;
  if (windows.size() > capacities.windows || model.size() > capacities.model_lines) return Status::capacity_exceeded;
  if (windows.empty()) return Status::too_few_lines;
  if (!carve(*arena, capacities, &workspace_)) return Status::buffer_too_small;

  stats_ = {};
  if (const Status status = build_model_graph(model, {}, workspace_.model_quads, workspace_.model_sides, &scene_.model);
      status != Status::ok) {
    return status;
  }
  if (scene_.model.quads.empty()) return Status::degenerate_geometry;
  stats_.model_quads_dropped = scene_.model.quads_dropped;
  if (const Status status = copy_lines(capacities, windows); status != Status::ok) return status;

  const double diagonal_px = std::sqrt(static_cast<double>(options.width) * options.width +
                                       static_cast<double>(options.height) * options.height);
  options_ = options;
  scene_.width = options.width;
  scene_.height = options.height;
  scene_.unit_px = std::max(1.0, 1e-3 * diagonal_px);
  seeding_.focal = focal_range(options);
  trial_ = workspace_.trial;
  best_ = workspace_.best;
  for (LineTrack* track : {&trial_, &best_}) {
    track->windows = track->windows.first(windows.size());
    track->matches_per_window = capacities.matches;
  }
  seeds_ = BoundedBest<MatchSeed>(workspace_.seeds);
  bends_.init(options.width, options.height, scene_.unit_px);
  known_camera_ = false;
  num_matches_ = num_poses_ = 0;
  next_ = 0;
  phase_ = Phase::bends;
  return Status::ok;
}

Status LineMatcher::copy_lines(const LineMatcherCapacities& capacities, Span<const LineWindow> windows) {
  std::uint32_t first = 0;
  for (std::size_t w = 0; w < windows.size(); ++w) {
    const Span<const EventLine> lines = windows[w].lines;
    workspace_.times[w] = {windows[w].begin_us, windows[w].end_us};
    workspace_.first_line[w] = first;
    BoundedBest<std::uint16_t> longest(workspace_.line_ids.subspan(first, capacities.lines));
    for (std::size_t i = 0; i < lines.size() && i < 0xffff; ++i) {
      if (!is_finite(lines[i])) return Status::invalid_argument;
      longest.offer(static_cast<std::uint16_t>(i),
                    [&lines](std::uint16_t a, std::uint16_t b) { return length2(lines[a]) > length2(lines[b]); });
    }
    for (const std::uint16_t id : longest.view()) workspace_.lines[first++] = lines[id];
    stats_.lines_dropped += longest.dropped();
  }
  workspace_.first_line[windows.size()] = first;
  scene_.lines = workspace_.lines.first(first);
  scene_.first_line = workspace_.first_line.first(windows.size() + 1);
  scene_.times = workspace_.times.first(windows.size());
  return Status::ok;
}

Status LineMatcher::step() {
  switch (phase_) {
    case Phase::idle: return Status::wrong_state;
    case Phase::bends: step_bends(); return Status::in_progress;
    case Phase::quads: step_quads(); return Status::in_progress;
    case Phase::select: step_select(); return Status::in_progress;
    case Phase::follow: step_follow(); return Status::in_progress;
    case Phase::settle: step_settle(); return Status::in_progress;
    case Phase::finish: return step_finish();
    case Phase::done: return Status::ok;
    case Phase::failed: return Status::no_match;
  }
  return Status::wrong_state;
}

void LineMatcher::step_bends() {
  bends_.add(scene_.lines_of(next_++));
  if (next_ < scene_.times.size()) return;
  const double half_diagonal2 =
      0.25 * (static_cast<double>(scene_.width) * scene_.width + static_cast<double>(scene_.height) * scene_.height);
  prior_.mean = {0.0, 0.5 * (scene_.width - 1.0), 0.5 * (scene_.height - 1.0), bends_.lambda()};
  prior_.sigma = {0.0, kCentreSigma * scene_.width, kCentreSigma * scene_.width, kLambdaSigma / half_diagonal2};
  next_ = 0;
  image_quads_ = {};
  next_quad_ = 0;
  phase_ = Phase::quads;
}

/// One quadrilateral; or, when the last one of a window is done, the search for those of the next window.
void LineMatcher::step_quads() {
  const std::size_t count = std::min(options_.seed_windows, scene_.times.size());
  if (next_quad_ < image_quads_.size()) {
    seed_from_quad(scene_, seeding_, image_quads_[next_quad_++], options_.hints, &workspace_.scratch, &seeds_,
                   &stats_.seeds);
    return;
  }
  if (next_ == count) {
    stats_.seeds_dropped = seeds_.dropped();
    best_.score = 0.0;
    best_.num_windows = 0;
    phase_ = Phase::select;
    return;
  }
  seeding_.index = options_.hints.has_pose ? hinted_window(next_, count, scene_.times.size())
                                           : even_window(next_, count, scene_.times.size());
  ++next_;
  const Optics optics{prior_.mean, nullptr};
  seeding_.flat = flatten_window(scene_, optics, seeding_.index, &workspace_.scratch);
  seeding_.frame = frame_of(scene_, optics);
  seeding_.lens = prior_.mean;
  const std::int64_t first_us = scene_.times[0].begin_us;
  const std::int64_t begin_us = scene_.times[seeding_.index].begin_us;
  seeding_.near_hint = begin_us <= first_us || distance_us(first_us, begin_us) <= kHintedUs;
  if (seeding_.near_hint) {
    seed_from_hint(scene_, seeding_, options_.hints, &workspace_.scratch, &seeds_, &stats_.seeds);
  }
  ImageQuadOptions quads;
  quads.unit_px = scene_.unit_px;
  image_quads_ = find_image_quads(seeding_.flat, quads, &workspace_.quads, &stats_.seeds.limits);
  next_quad_ = 0;
}

/// Takes the best seed that was not tried and says something new; the window order starts at its window.
void LineMatcher::step_select() {
  for (MatchSeed& seed : seeds_.view()) {
    if (seed.tried || is_repeated(seed)) continue;
    if (stats_.trials == options_.trials) break;
    seed.tried = true;
    ++stats_.trials;
    trial_.optics = {prior_.mean, nullptr};
    trial_.optics.lens.f_px = seed.f_px;
    const MatchHints& hints = options_.hints;
    const bool hinted = hints.focal_px > 0.0 && hints.agrees_with_focal(seed.f_px);
    prior_.mean.f_px = hinted ? hints.focal_px : seed.f_px;
    prior_.sigma.f_px = hinted ? 0.5 * hints.focal_share * hints.focal_px : kFocalSigma * seed.f_px;
    for (WindowTrack& window : trial_.windows) window.matched = false;
    seed_window_ = seed.window;
    match_window(scene_, seed_window_, {Span<const Pose>(&seed.pose, 1)}, &workspace_.scratch, &trial_,
                 &stats_.matches_dropped);
    if (!trial_.windows[seed_window_].matched) return;
    next_ = 1;
    phase_ = Phase::follow;
    return;
  }
  phase_ = Phase::finish;
}

/// Windows in the order seed + 1 ... last, seed - 1 ... first.
void LineMatcher::step_follow() {
  const std::size_t after = scene_.times.size() - seed_window_;
  if (next_ < scene_.times.size()) {
    const std::size_t window = next_ < after ? seed_window_ + next_ : seed_window_ - (next_ - after + 1);
    ++next_;
    Pose starts[kMaxPredictions];
    const std::size_t count = predict_poses({scene_.times, trial_.windows}, window, starts);
    match_window(scene_, window, {Span<const Pose>(starts, count)}, &workspace_.scratch, &trial_,
                 &stats_.matches_dropped);
    return;
  }
  sum_up(&trial_);
  next_ = 0;
  round_ = 0;
  phase_ = trial_.score < kHopelessShare * best_.score ? Phase::select : Phase::settle;
}

/// Lens steps first, then one window after the other is fitted anew; kSettleRounds times. From the second round on the
/// neighbours' poses hold a window whose own lines leave its pose open.
void LineMatcher::step_settle() {
  const WindowMotion motion{scene_.times, trial_.windows};
  if (next_ < kLensSteps) {
    if (next_++ == 0) {
      scatter_ = measure_scatter(motion, scene_.model.centre_m, workspace_.scratch.values);
      decide_contrast(scene_, trial_, &workspace_.scratch);
    }
    if (!known_camera_) static_cast<void>(refine_track_lens(scene_, prior_, &workspace_.scratch, &trial_));
    return;
  }
  const std::size_t window = next_++ - kLensSteps;
  if (window < scene_.times.size()) {
    PosePrior prior;
    const bool has_prior = round_ > 0 && neighbour_prior(motion, scatter_, scene_.model.centre_m, window, &prior);
    const bool was_matched = trial_.windows[window].matched;
    Pose starts[kMaxPredictions];
    std::size_t count = 0;
    if (was_matched) {
      starts[count++] = trial_.windows[window].pose[1];
      if (has_prior) starts[count++] = prior.mean;
    } else {
      count = predict_poses(motion, window, starts);
    }
    const WindowStart start{Span<const Pose>(starts, count), was_matched ? FitStart::near : FitStart::far,
                            has_prior ? &prior : nullptr, true};
    match_window(scene_, window, start, &workspace_.scratch, &trial_, &stats_.matches_dropped);
    return;
  }
  next_ = 0;
  if (++round_ < kSettleRounds) return;
  sum_up(&trial_);
  judge_trial();
}

void LineMatcher::publish() {
  num_matches_ = num_poses_ = 0;
  double radius2 = 0.0;
  for (std::size_t w = 0; w < best_.windows.size(); ++w) {
    const WindowTrack& track = best_.windows[w];
    if (!track.matched) continue;
    WindowPoses& poses = workspace_.poses[num_poses_++];
    poses.window = static_cast<std::uint16_t>(w);
    poses.num_lines = track.num_lines;
    poses.first_match = static_cast<std::uint32_t>(num_matches_);
    poses.num_matches = track.num_matches;
    poses.rms_px = track.rms_px;
    poses.begin = track.pose[static_cast<std::size_t>(Instant::begin)];
    poses.end = track.pose[static_cast<std::size_t>(Instant::end)];
    for (const LineMatch& match : best_.matches_of(w)) {
      Vec2 points[kLinePoints];
      line_points(scene_.lines_of(w)[match.line], Instant::middle, points);
      const Vec2 centre(best_.optics.lens.cx, best_.optics.lens.cy);
      for (const Vec2& point : points) radius2 = std::max(radius2, (point - centre).squaredNorm());
      LineMatch& out = workspace_.matches[num_matches_++];
      out = match;
      out.line = workspace_.line_ids[scene_.first_line[w] + match.line];
    }
  }
  if (!known_camera_) camera_ = brown_camera(best_.optics.lens, scene_.width, scene_.height, std::sqrt(radius2));
}

Status LineMatcher::rematch(const Camera& camera, Span<const WindowPrediction> predictions) {
  if (phase_ == Phase::idle) return Status::wrong_state;
  if (camera.width != scene_.width || camera.height != scene_.height || !(camera.fx > 0.0) || !(camera.fy > 0.0) ||
      predictions.empty()) {
    return Status::invalid_argument;
  }
  for (const WindowPrediction& prediction : predictions) {
    if (prediction.window >= scene_.times.size()) return Status::invalid_argument;
  }
  for (WindowTrack& window : trial_.windows) window.matched = false;
  camera_ = camera;
  known_camera_ = true;
  trial_.optics = {prior_.mean, &camera_};
  for (const WindowPrediction& prediction : predictions) {
    WindowTrack& window = trial_.windows[prediction.window];
    window.pose[0] = prediction.begin;
    window.pose[2] = prediction.end;
    // Halfway between both ends.
    const Mat3 R0 = rotation_of(prediction.begin);
    const Mat3 half = so3_exp(0.5 * so3_log(rotation_of(prediction.end) * R0.transpose()));
    window.pose[1] = make_pose(half * R0, 0.5 * (translation_of(prediction.begin) + translation_of(prediction.end)));
    window.matched = true;
    window.num_matches = 0;
  }
  best_.score = 0.0;
  best_.num_windows = 0;
  if (!options_.provisional) stats_.rival_score = 0.0;
  num_matches_ = num_poses_ = 0;
  next_ = 0;
  round_ = kSettleRounds - 2;
  phase_ = Phase::settle;
  return Status::ok;
}

}  // namespace lecalib
