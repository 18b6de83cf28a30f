// SPDX-License-Identifier: MIT
#include "lecalib/match/seed_search.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/match/track_comparison.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// Rounds of "assign, refine pose and focal length": gates in units.
constexpr double kGates[] = {14.0, 9.0, 6.0};
constexpr double kSlopes[] = {0.2, 0.15, 0.1};
constexpr std::size_t kNumGates = 3;
constexpr int kStepsPerGate = 2;
/// Lines that must find a detected one, or all of a smaller model.
constexpr std::size_t kMinSeedLines = 4;
/// One sigma of the focal length around its guess, relative.
constexpr double kSeedFocalSigma = 0.3;
/// Of the best score in the window a guess must have this share at once, with the widest gate.
constexpr double kHopelessSeedShare = 0.4;
/// A window is done when a guess explains this share of the model on so many lines.
constexpr double kClearShare = 0.65;
constexpr std::uint16_t kClearLines = 7;
/// Seeds of one window count as the same one below these differences.
constexpr double kSameTurn = 0.035;  ///< rad
constexpr double kSameFocal = 0.05;  ///< relative
/// A seed that agrees with a hint ranks before others that explain up to so much more, for each hint.
constexpr double kHintBonus = 0.5;

class SeedFit {
 public:
  SeedFit(const MatchScene& scene, const SeedWindow& window, MatchScratch* scratch)
      : scene_(scene), window_(window), lens_(window.lens), scratch_(scratch) {}

  /// Refines a guess in its window; @return false when too little of the model is found, or far less than `best_score`.
  bool run(const PoseGuess& guess, double best_score, MatchSeed* out) {
    Pose pose;
    std::copy(guess.R, guess.R + 9, pose.R);
    std::copy(guess.t, guess.t + 3, pose.t);
    lens_.f_px = guess.f_px;
    LensPrior prior;
    prior.mean = lens_;
    prior.sigma.f_px = kSeedFocalSigma * guess.f_px;
    Support support;
    for (std::size_t round = 0; round < kNumGates; ++round) {
      const Span<const Assignment> taken = assign(pose, round, &support);
      if (support.lines < std::min(kMinSeedLines, scene_.model.lines.size())) return false;
      if (round == 0 && support.score < kHopelessSeedShare * best_score) return false;
      if (!refine(taken, prior, &pose)) return false;
      if (!(lens_.f_px > 0.8 * window_.focal.min_px && lens_.f_px < 1.25 * window_.focal.max_px)) return false;
    }
    static_cast<void>(assign(pose, kNumGates - 1, &support));
    if (support.lines < std::min(kMinSeedLines, scene_.model.lines.size())) return false;
    out->pose = pose;
    out->f_px = lens_.f_px;
    out->score = support.score;
    out->num_lines = support.lines;
    out->possible = support.possible;
    out->window = static_cast<std::uint16_t>(window_.index);
    out->tried = false;
    return true;
  }

 private:
  Span<const Assignment> assign(const Pose& pose, std::size_t round, Support* support) {
    AssignmentOptions options;
    options.unit_px = scene_.unit_px;
    options.gate_px = kGates[round] * scene_.unit_px;
    options.max_slope = kSlopes[round];
    options.overshoot_px = 1.2 * options.gate_px;
    return assign_lines(scene_.model, pose, lens_.f_px, window_.frame, window_.flat, Instant::middle, options,
                        &scratch_->assignment, support);
  }

  bool refine(Span<const Assignment> taken, const LensPrior& prior, Pose* pose) {
    LineMatch matches[kMaxMatches];
    std::size_t count = 0;
    for (const Assignment& a : taken) {
      if (count == kMaxMatches) break;
      matches[count++] = {static_cast<std::uint16_t>(window_.index), a.line, a.model_line, a.flipped};
    }
    const LensView view{scene_.lines_of(window_.index), Span<const LineMatch>(matches, count), pose};
    PoseRefinementOptions options;
    options.sigma_floor_px = 0.5 * scene_.unit_px;
    options.loss_px = 4.0 * scene_.unit_px;
    LensViewSystem system;
    double cost = 0.0;
    for (int step = 0; step < kStepsPerGate; ++step) {
      if (!refine_lens_step(scene_.model.lines, Span<const LensView>(&view, 1), prior, options,
                            Span<LensViewSystem>(&system, 1), &lens_, &cost)) {
        return false;
      }
    }
    return true;
  }

  /// The matches of most weight, which come first, suffice for a seed: the fit through all windows takes all.
  static constexpr std::size_t kMaxMatches = 32;

  const MatchScene& scene_;
  const SeedWindow& window_;
  Lens lens_;
  MatchScratch* scratch_;
};

bool same_seed(const ModelGraph& model, const MatchSeed& a, const MatchSeed& b, bool up_to_symmetry) {
  return a.window == b.window && std::abs(a.f_px - b.f_px) <= kSameFocal * a.f_px &&
         is_same_placement(model, a.pose, b.pose, kSameTurn, up_to_symmetry);
}

double rank_of(const MatchScene& scene, const SeedWindow& window, const MatchHints& hints, const MatchSeed& seed) {
  double factor = 1.0;
  if (hints.focal_px > 0.0 && hints.agrees_with_focal(seed.f_px)) factor += kHintBonus;
  if (hints.has_pose && window.near_hint && hints.agrees_with_pose(seed.pose, scene.model.centre_m)) {
    factor += kHintBonus;
  }
  return factor * seed.score;
}

/// Of poses that a hint may tell apart all stay.
void offer(const ModelGraph& model, const MatchSeed& seed, bool up_to_symmetry, BoundedBest<MatchSeed>* seeds) {
  for (std::size_t i = 0; i < seeds->size(); ++i) {
    if (!same_seed(model, (*seeds)[i], seed, up_to_symmetry)) continue;
    if ((*seeds)[i].rank >= seed.rank) return;
    seeds->erase(i);
    break;
  }
  seeds->offer(seed, [](const MatchSeed& a, const MatchSeed& b) { return a.rank > b.rank; });
}

/// Best score of the seeds of a window; *done when one of them explains so much that no better one is looked for.
double best_score_of(Span<const MatchSeed> seeds, std::size_t window, bool* done) {
  double best_score = 0.0;
  *done = false;
  for (const MatchSeed& seed : seeds) {
    if (seed.window != window) continue;
    if (seed.num_lines >= kClearLines && seed.score >= kClearShare * seed.possible) *done = true;
    best_score = std::max(best_score, seed.score);
  }
  return best_score;
}

/// Fits a guess and offers what comes of it.
void try_guess(const MatchScene& scene, const SeedWindow& window, const PoseGuess& guess, const MatchHints& hints,
               MatchScratch* scratch, double* best_score, BoundedBest<MatchSeed>* seeds, SeedStats* stats) {
  ++stats->guesses;
  MatchSeed seed;
  SeedFit fit(scene, window, scratch);
  if (!fit.run(guess, *best_score, &seed)) return;
  ++stats->fits;
  *best_score = std::max(*best_score, seed.score);
  seed.rank = rank_of(scene, window, hints, seed);
  offer(scene.model, seed, !hints.has_pose, seeds);
}

}  // namespace

void seed_from_quad(const MatchScene& scene, const SeedWindow& window, const ImageQuad& quad, const MatchHints& hints,
                    MatchScratch* scratch, BoundedBest<MatchSeed>* seeds, SeedStats* stats) {
  bool done = false;
  double best_score = best_score_of(seeds->view(), window.index, &done);
  if (done) return;
  ++stats->image_quads;
  QuadPoseOptions options;
  options.focal = window.focal;
  for (const ModelQuad& face : scene.model.quads) {
    for (int labeling = 0; labeling < kNumQuadLabelings; ++labeling) {
      PoseGuess guesses[kMaxQuadGuesses];
      const std::size_t count = guess_poses(quad, face, labeling, options, guesses);
      for (std::size_t g = 0; g < count; ++g) {
        try_guess(scene, window, guesses[g], hints, scratch, &best_score, seeds, stats);
      }
    }
  }
}

void seed_from_hint(const MatchScene& scene, const SeedWindow& window, const MatchHints& hints, MatchScratch* scratch,
                    BoundedBest<MatchSeed>* seeds, SeedStats* stats) {
  if (!hints.has_pose) return;
  PoseGuess guess;
  std::copy(hints.T_cam_world.R, hints.T_cam_world.R + 9, guess.R);
  std::copy(hints.T_cam_world.t, hints.T_cam_world.t + 3, guess.t);
  guess.f_px = window.focal.min_px;
  bool done = false;
  double best_score = best_score_of(seeds->view(), window.index, &done);
  for (int step = 0; step < kMaxFocalSteps && guess.f_px <= window.focal.max_px; ++step, guess.f_px *= kFocalRatio) {
    if (!hints.agrees_with_focal(guess.f_px)) continue;
    try_guess(scene, window, guess, hints, scratch, &best_score, seeds, stats);
  }
}

}  // namespace lecalib
