// SPDX-License-Identifier: MIT
#include "lecalib/match/window_track.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// A motion is not extended over more than this many times the interval in which it was seen.
constexpr double kMaxExtrapolation = 4.0;
/// A window counts when this share of what the model could show in it is found ...
constexpr double kMinScoreShare = 0.25;
/// ... on at least so many model lines, or all but one of a smaller model.
constexpr std::size_t kMinLines = 4;

double middle_us(const WindowTimes& times, std::int64_t origin_us) {
  return 0.5 * (static_cast<double>(times.begin_us - origin_us) + static_cast<double>(times.end_us - origin_us));
}

/// The pose after `share` times the motion from one pose to another, starting at `start`.
Pose extend(const Pose& from, const Pose& to, double share, const Pose& start) {
  const Mat3 dR = rotation_of(to) * rotation_of(from).transpose();
  const Vec3 v = translation_of(to) - dR * translation_of(from);
  const Mat3 step = so3_exp(share * so3_log(dR));
  return make_pose(step * rotation_of(start), step * translation_of(start) + share * v);
}

/// Poses at both ends of a window, from its matches at the middle.
void refine_ends(const MatchScene& scene, double f_px, Span<const FlatLine> flat, const WindowFit& fit, Pose* poses) {
  PoseRefinementOptions options;
  options.sigma_floor_px = 0.5 * scene.unit_px;
  options.loss_px = 2.0 * scene.unit_px;
  for (const Instant instant : {Instant::begin, Instant::end}) {
    Pose& pose = poses[static_cast<std::size_t>(instant)];
    pose = fit.pose;
    if (!refine_pose(scene.model, f_px, flat, instant, fit.assignments, options, &pose, nullptr)) pose = fit.pose;
  }
  poses[static_cast<std::size_t>(Instant::middle)] = fit.pose;
}

bool is_enough(const MatchScene& scene, const Support& support) {
  const std::size_t min_lines = std::min(kMinLines, scene.model.size() - 1);
  return support.lines >= min_lines && support.score >= kMinScoreShare * support.possible;
}

}  // namespace

Span<const FlatLine> flatten_window(const MatchScene& scene, const Optics& optics, std::size_t window,
                                    MatchScratch* scratch) {
  const Span<const EventLine> lines = scene.lines_of(window);
  const Span<FlatLine> flat = scratch->flat.first(lines.size());
  if (optics.camera != nullptr) {
    flatten_lines(*optics.camera, lines, flat);
  } else {
    flatten_lines(optics.lens, lines, flat);
  }
  return flat;
}

FlatFrame frame_of(const MatchScene& scene, const Optics& optics) {
  return optics.camera != nullptr ? flat_frame(*optics.camera) : flat_frame(optics.lens, scene.width, scene.height);
}

std::size_t predict_poses(const MatchScene& scene, const LineTrack& track, std::size_t window,
                          Pose out[kMaxPredictions]) {
  const std::int64_t origin_us = scene.times[0].begin_us;
  const double now_us = middle_us(scene.times[window], origin_us);
  const std::size_t none = track.windows.size();
  std::size_t neighbour[2] = {none, none};
  for (std::size_t w = 0; w < track.windows.size(); ++w) {
    if (!track.windows[w].matched || w == window) continue;
    if (w < window) neighbour[0] = w;
    if (w > window && neighbour[1] == none) neighbour[1] = w;
  }
  std::size_t count = 0;
  if (neighbour[0] != none && neighbour[1] != none) {
    const Pose& before = track.windows[neighbour[0]].pose[1];
    const Pose& after = track.windows[neighbour[1]].pose[1];
    const double t0 = middle_us(scene.times[neighbour[0]], origin_us);
    const double t1 = middle_us(scene.times[neighbour[1]], origin_us);
    out[count++] = extend(before, after, t1 > t0 ? (now_us - t0) / (t1 - t0) : 0.5, before);
  }
  for (const std::size_t w : neighbour) {
    if (w == none) continue;
    const WindowTrack& near = track.windows[w];
    const double span_us = static_cast<double>(scene.times[w].end_us - scene.times[w].begin_us);
    const double share = span_us > 0.0 ? (now_us - middle_us(scene.times[w], origin_us)) / span_us : 0.0;
    const double limited = std::min(kMaxExtrapolation, std::max(-kMaxExtrapolation, share));
    out[count++] = extend(near.pose[0], near.pose[2], limited, near.pose[1]);
    out[count++] = near.pose[1];
  }
  return count;
}

void match_window(const MatchScene& scene, std::size_t window, Span<const Pose> starts, FitStart from,
                  MatchScratch* scratch, LineTrack* track, std::uint32_t* dropped) {
  const Span<const FlatLine> flat = flatten_window(scene, track->optics, window, scratch);
  const FlatFrame frame = frame_of(scene, track->optics);
  const double f_px = track->optics.f_px();
  WindowTrack& result = track->windows[window];
  result.matched = false;
  result.score = 0.0;
  result.possible = 0.0;
  result.num_matches = 0;
  result.num_lines = 0;
  for (const Pose& start : starts) {
    WindowFit fit;
    WindowFitOptions options;
    options.unit_px = scene.unit_px;
    options.start = from;
    if (!fit_window(scene.model, f_px, frame, flat, start, options, &scratch->assignment, &fit)) continue;
    if (!is_enough(scene, fit.support) || fit.support.score <= result.score) continue;
    refine_ends(scene, f_px, flat, fit, result.pose);
    result.matched = true;
    result.score = fit.support.score;
    result.possible = fit.support.possible;
    result.rms_px = fit.rms_px;
    result.num_lines = fit.support.lines;
    result.num_matches = 0;
    *dropped += fit.support.assignments_dropped;
    for (const Assignment& assignment : fit.assignments) {
      if (result.num_matches == track->matches_per_window) {
        ++*dropped;
        continue;
      }
      track->matches[window * track->matches_per_window + result.num_matches++] = {
          static_cast<std::uint16_t>(window), assignment.line, assignment.model_line, assignment.flipped};
    }
  }
}

bool refine_track_lens(const MatchScene& scene, const LensPrior& prior, MatchScratch* scratch, LineTrack* track) {
  std::size_t count = 0;
  for (std::size_t w = 0; w < track->windows.size(); ++w) {
    if (!track->windows[w].matched) continue;
    scratch->views[count++] = {scene.lines_of(w), track->matches_of(w), &track->windows[w].pose[1]};
  }
  if (count == 0) return false;
  PoseRefinementOptions options;
  options.sigma_floor_px = 0.5 * scene.unit_px;
  options.loss_px = 2.0 * scene.unit_px;
  double cost = 0.0;
  return refine_lens_step(scene.model, scratch->views.first(count), prior, options, scratch->systems,
                          &track->optics.lens, &cost);
}

void sum_up(LineTrack* track) {
  track->score = 0.0;
  track->possible = 0.0;
  track->num_windows = 0;
  for (const WindowTrack& window : track->windows) {
    if (!window.matched) continue;
    track->score += window.score;
    track->possible += window.possible;
    ++track->num_windows;
  }
}

}  // namespace lecalib
