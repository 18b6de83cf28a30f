// SPDX-License-Identifier: MIT
#include "lecalib/match/window_track.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/line_projection.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// A window counts when this share of what the model could show in it is found ...
constexpr double kMinScoreShare = 0.25;
/// ... on at least so many model lines, or all but one of a smaller model.
constexpr std::size_t kMinTrackLines = 4;
/// A match must hold at the window's begin and end, too: within so many units at each of its points.
constexpr double kMaxEndUnits = 7.0;

std::size_t min_lines_of(const MatchScene& scene) { return std::min(kMinTrackLines, scene.model.lines.size() - 1); }

/// Removes assignments that do not hold at the instant; @return those that stay, in place.
Span<Assignment> drop_misfits(const MatchScene& scene, const Pose& pose, double f_px, Span<const FlatLine> flat,
                              Instant instant, Span<Assignment> assignments) {
  const std::size_t k = static_cast<std::size_t>(instant);
  const Mat3 R = rotation_of(pose);
  const Vec3 t = translation_of(pose);
  std::size_t count = 0;
  for (const Assignment& assignment : assignments) {
    const Vec3 N = line_in_camera(R, t, scene.model.lines[assignment.model_line]).moment;
    const FlatLine& line = flat[assignment.line];
    double worst = 0.0;
    for (std::size_t q = 0; q < kLinePoints; ++q) {
      worst = std::max(worst, std::abs(N.x() * line.x[k][q] + N.y() * line.y[k][q] + N.z() * f_px));
    }
    if (worst <= kMaxEndUnits * scene.unit_px * N.head<2>().norm()) assignments[count++] = assignment;
  }
  return assignments.first(count);
}

/// Poses at both ends of a window, from its matches at the middle. Matches that fit the middle but not the ends (their
/// motion was measured wrongly) are taken out.
Span<Assignment> refine_ends(const MatchScene& scene, double f_px, Span<const FlatLine> flat, const WindowFit& fit,
                             Pose* poses) {
  PoseRefinementOptions options;
  options.sigma_floor_px = 0.5 * scene.unit_px;
  options.loss_px = scene.unit_px;
  options.iterations = 4;
  const Instant ends[] = {Instant::begin, Instant::end};
  const auto refine = [&](Span<const Assignment> assignments) {
    for (const Instant instant : ends) {
      Pose& pose = poses[static_cast<std::size_t>(instant)];
      pose = fit.pose;
      const PoseLines seen{scene.model.lines, flat, assignments, instant};
      if (!refine_pose(seen, f_px, nullptr, options, &pose, nullptr)) {
        pose = fit.pose;
      }
    }
  };
  refine(fit.assignments);
  Span<Assignment> kept = fit.assignments;
  for (const Instant instant : ends) {
    kept = drop_misfits(scene, poses[static_cast<std::size_t>(instant)], f_px, flat, instant, kept);
  }
  if (kept.size() < fit.assignments.size()) refine(kept);
  poses[static_cast<std::size_t>(Instant::middle)] = fit.pose;
  return kept;
}

std::uint16_t count_model_lines(Span<const Assignment> assignments) {
  std::uint16_t count = 0;
  for (std::size_t i = 0; i < assignments.size(); ++i) {
    const Span<const Assignment> before = assignments.first(i);
    const bool repeated = std::any_of(before.begin(), before.end(), [&](const Assignment& other) {
      return other.model_line == assignments[i].model_line;
    });
    if (!repeated) ++count;
  }
  return count;
}

Span<const std::int8_t> line_contrasts(const MatchScene& scene, std::size_t window, Span<std::int8_t> out) {
  const Span<const EventLine> lines = scene.lines_of(window);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    out[i] = static_cast<std::int8_t>(contrast_of(lines[i], scene.unit_px));
  }
  return out.first(lines.size());
}

bool is_enough(const MatchScene& scene, const Support& support) {
  return support.lines >= min_lines_of(scene) && support.score >= kMinScoreShare * support.possible;
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

void match_window(const MatchScene& scene, std::size_t window, const WindowStart& start, MatchScratch* scratch,
                  LineTrack* track, std::uint32_t* dropped) {
  const Span<const FlatLine> flat = flatten_window(scene, track->optics, window, scratch);
  const FlatFrame frame = frame_of(scene, track->optics);
  const double f_px = track->optics.f_px();
  WindowTrack result{};
  WindowFitOptions options;
  options.unit_px = scene.unit_px;
  options.start = start.from;
  options.prior = start.prior;
  if (start.use_contrast) {
    options.contrast = scratch->contrast.first(scene.model.lines.size());
    options.line_contrast = line_contrasts(scene, window, scratch->line_contrast);
  }
  for (const Pose& pose : start.poses) {
    WindowFit fit;
    if (!fit_window(scene.model, f_px, frame, flat, pose, options, &scratch->assignment, &fit)) continue;
    if (!is_enough(scene, fit.support) || fit.support.score <= result.score) continue;
    Pose poses[kNumInstants];
    const Span<const Assignment> kept = refine_ends(scene, f_px, flat, fit, poses);
    const std::uint16_t num_lines = count_model_lines(kept);
    if (num_lines < min_lines_of(scene)) continue;
    std::copy(poses, poses + kNumInstants, result.pose);
    result.matched = true;
    result.score = fit.support.score;
    result.found = fit.support.found;
    result.possible = fit.support.possible - silent_weight(scene.model, poses, f_px, frame, scene.unit_px, kept);
    result.rms_px = fit.rms_px;
    result.num_lines = num_lines;
    const Span<const Assignment> stored = kept.first(track->matches_per_window);
    result.num_matches = static_cast<std::uint16_t>(stored.size());
    *dropped += fit.support.assignments_dropped + static_cast<std::uint32_t>(kept.size() - stored.size());
    for (std::size_t i = 0; i < stored.size(); ++i) {
      track->matches[window * track->matches_per_window + i] = {static_cast<std::uint16_t>(window), stored[i].line,
                                                                stored[i].model_line, stored[i].flipped};
    }
  }
  track->windows[window] = result;
}

void decide_contrast(const MatchScene& scene, const LineTrack& track, MatchScratch* scratch) {
  const Span<ContrastVote> votes = scratch->votes.first(scene.model.lines.size());
  std::fill(votes.begin(), votes.end(), ContrastVote{});
  for (std::size_t w = 0; w < track.windows.size(); ++w) {
    if (!track.windows[w].matched) continue;
    for (const LineMatch& match : track.matches_of(w)) {
      const int contrast = contrast_of(scene.lines_of(w)[match.line], scene.unit_px);
      if (contrast == 0) continue;
      ContrastVote& vote = votes[match.model_line];
      ++((contrast > 0) == match.flipped ? vote.negative : vote.positive);
    }
  }
  for (std::size_t j = 0; j < votes.size(); ++j) {
    scratch->contrast[j] = static_cast<std::int8_t>(decided_contrast(votes[j]));
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
  return refine_lens_step(scene.model.lines, scratch->views.first(count), prior, options, scratch->systems,
                          &track->optics.lens, &cost);
}

void sum_up(LineTrack* track) {
  track->score = 0.0;
  track->found = 0.0;
  track->possible = 0.0;
  track->num_windows = 0;
  for (const WindowTrack& window : track->windows) {
    if (!window.matched) continue;
    track->score += window.score;
    track->found += window.found;
    track->possible += window.possible;
    ++track->num_windows;
  }
}

}  // namespace lecalib
