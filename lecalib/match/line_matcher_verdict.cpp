// SPDX-License-Identifier: MIT
/// Which hypothesis is believed, and whether any: a part of LineMatcher.
#include <algorithm>

#include "lecalib/match/line_matcher.hpp"

namespace lecalib {
namespace {

/// A guess repeats a track whose pose is turned by less, rad.
constexpr double kRepeatedTurn = 0.1;
/// A rival counts as another camera beyond this ratio of focal lengths, and as equally good above this share of score.
constexpr double kRivalFocal = 1.06;
constexpr double kRivalShare = 0.95;
/// What a result must explain: nearly all of the model in its windows, or, beyond the lines that a free focal length
/// and pose can always be bent to, a good share of its length and of its lines closely, or more than half of its lines
/// closely. Edges whose contrast changes along them are found in part, in every window: their number tells what their
/// length does not. A model of another size lies along many lines, and closely along few.
constexpr double kMinExplained = 0.75;
constexpr double kMinExplainedAtFirst = 0.65;  ///< of a provisional result
constexpr double kFreeLines = 3.5;
constexpr double kMinExplainedBeyond = 0.25;
constexpr double kMinFoundBeyond = 0.55;
/// And it must measure more than there are unknowns.
constexpr double kMinRedundancy = 8.0;

bool explains_enough(const LineTrack& track, double least_share) {
  if (track.score >= least_share * track.possible) return true;
  const double free_score = kFreeLines * static_cast<double>(track.num_windows);
  const double beyond = track.possible - free_score;
  const double least = std::min(track.score, track.found) - free_score;
  return beyond > 0.0 &&
         (least >= kMinExplainedBeyond * beyond || track.found - free_score >= kMinFoundBeyond * beyond);
}

}  // namespace

/// True when the best track so far already says this about the seed's window.
bool LineMatcher::is_repeated(const MatchSeed& seed) const {
  if (best_.num_windows == 0 || !best_.windows[seed.window].matched) return false;
  // Of poses that differ by a symmetry of the model, the hinted one is wanted.
  const bool up_to_symmetry = !options_.hints.has_pose;
  const double ratio = best_.optics.lens.f_px / seed.f_px;
  return ratio > 0.8 && ratio < 1.25 &&
         is_same_placement(scene_.model, best_.windows[seed.window].pose[1], seed.pose, kRepeatedTurn, up_to_symmetry);
}

/// Also true where there are no hints. A pose is about the first window that shows the object.
bool LineMatcher::agrees_with_hints(const LineTrack& track) const {
  if (!options_.hints.agrees_with_focal(track.optics.lens.f_px)) return false;
  for (const WindowTrack& window : track.windows) {
    if (window.matched) return options_.hints.agrees_with_pose(window.pose[1], scene_.model.centre_m);
  }
  return true;
}

/// The better of trial and best stays; the other one is a rival when it says something else about camera and lines. A
/// hint decides between hypotheses that explain nearly the same.
void LineMatcher::judge_trial() {
  phase_ = known_camera_ ? Phase::finish : Phase::select;
  if (best_.num_windows == 0) {
    std::swap(trial_, best_);
    return;
  }
  const bool trial_agrees = agrees_with_hints(trial_);
  const bool best_agrees = agrees_with_hints(best_);
  const double margin = trial_agrees == best_agrees ? 1.0 : trial_agrees ? kRivalShare : 1.0 / kRivalShare;
  const bool rivals = !is_same_matching(scene_, best_, trial_);
  if (trial_.score > margin * best_.score) {
    std::swap(trial_, best_);
    const double ratio = stats_.rival_focal_px / best_.optics.lens.f_px;
    if (ratio < kRivalFocal && ratio * kRivalFocal > 1.0) stats_.rival_score = 0.0;
    if (trial_agrees && !best_agrees) stats_.rival_score = 0.0;
  }
  if (agrees_with_hints(best_) && !agrees_with_hints(trial_)) return;
  const double ratio = trial_.optics.lens.f_px / best_.optics.lens.f_px;
  const bool differs = ratio > kRivalFocal || ratio * kRivalFocal < 1.0;
  if (rivals && differs && trial_.score > stats_.rival_score) {
    stats_.rival_score = trial_.score;
    stats_.rival_focal_px = trial_.optics.lens.f_px;
  }
}

std::size_t LineMatcher::windows_with(std::size_t model_line) const {
  std::size_t count = 0;
  for (std::size_t w = 0; best_.num_windows > 0 && w < best_.windows.size(); ++w) {
    if (!best_.windows[w].matched) continue;
    const Span<const LineMatch> matches = best_.matches_of(w);
    count += std::any_of(matches.begin(), matches.end(),
                         [model_line](const LineMatch& match) { return match.model_line == model_line; })
                 ? 1U
                 : 0U;
  }
  return count;
}

Status LineMatcher::step_finish() {
  // A rival was left at what it explained at first, with wider gates than a known camera has.
  const double beside_rival = known_camera_ ? std::max(stats_.score, best_.score) : best_.score;
  stats_.score = best_.score;
  stats_.possible = best_.possible;
  double redundancy = -static_cast<double>(kNumLens);
  for (const WindowTrack& window : best_.windows) {
    if (best_.num_windows > 0 && window.matched) redundancy += 2.0 * window.num_lines - 6.0;
  }
  if (!known_camera_) stats_.against_hint = best_.num_windows > 0 && !agrees_with_hints(best_);
  const bool is_first_of_two = options_.provisional && !known_camera_;
  stats_.ambiguous = known_camera_ == options_.provisional && stats_.rival_score > kRivalShare * beside_rival;
  const bool enough = best_.num_windows > 0 &&
                      explains_enough(best_, is_first_of_two ? kMinExplainedAtFirst : kMinExplained) &&
                      (known_camera_ || redundancy >= kMinRedundancy);
  if (!enough || stats_.ambiguous) {
    phase_ = Phase::failed;
    return Status::no_match;
  }
  publish();
  phase_ = Phase::done;
  return Status::ok;
}

}  // namespace lecalib
