// SPDX-License-Identifier: MIT
#include "lecalib/match/seed_search.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// Rounds of "assign, refine pose and focal length": gates in units.
constexpr double kGates[] = {14.0, 9.0, 6.0};
constexpr double kSlopes[] = {0.2, 0.15, 0.1};
constexpr std::size_t kNumGates = 3;
constexpr int kStepsPerGate = 2;
/// Lines that must find a detected one, or all of a smaller model.
constexpr std::size_t kMinLines = 4;
/// One sigma of the focal length around its guess, relative.
constexpr double kFocalSigma = 0.3;
/// Of the best score in the window a guess must have this share at once, with the widest gate.
constexpr double kHopelessShare = 0.4;
/// A window is done when a guess explains this share of the model on so many lines.
constexpr double kClearShare = 0.65;
constexpr std::uint16_t kClearLines = 7;
/// Seeds of one window count as the same one below these differences.
constexpr double kSameRotation = 0.05;  ///< |R1 - R2|, Frobenius
constexpr double kSameFocal = 0.05;     ///< relative

class SeedFit {
 public:
  SeedFit(const MatchScene& scene, const Lens& lens, std::size_t window, Span<const FlatLine> flat,
          const FlatFrame& frame, MatchScratch* scratch)
      : scene_(scene), lens_(lens), window_(window), flat_(flat), frame_(frame), scratch_(scratch) {}

  /// Refines a guess in its window; @return false when too little of the model is found, or far less than `best_score`.
  bool run(const PoseGuess& guess, const FocalRange& range, double best_score, MatchSeed* out) {
    Pose pose;
    std::copy(guess.R, guess.R + 9, pose.R);
    std::copy(guess.t, guess.t + 3, pose.t);
    lens_.f_px = guess.f_px;
    LensPrior prior;
    prior.mean = lens_;
    prior.sigma.f_px = kFocalSigma * guess.f_px;
    Support support;
    for (std::size_t round = 0; round < kNumGates; ++round) {
      const Span<const Assignment> taken = assign(pose, round, &support);
      if (support.lines < std::min(kMinLines, scene_.model.lines.size())) return false;
      if (round == 0 && support.score < kHopelessShare * best_score) return false;
      if (!refine(taken, prior, &pose)) return false;
      if (!(lens_.f_px > 0.8 * range.min_px && lens_.f_px < 1.25 * range.max_px)) return false;
    }
    static_cast<void>(assign(pose, kNumGates - 1, &support));
    if (support.lines < std::min(kMinLines, scene_.model.lines.size())) return false;
    out->pose = pose;
    out->f_px = lens_.f_px;
    out->score = support.score;
    out->num_lines = support.lines;
    out->possible = support.possible;
    out->window = static_cast<std::uint16_t>(window_);
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
    return assign_lines(scene_.model, pose, lens_.f_px, frame_, flat_, Instant::middle, options, &scratch_->assignment,
                        support);
  }

  bool refine(Span<const Assignment> taken, const LensPrior& prior, Pose* pose) {
    LineMatch matches[kMaxMatches];
    std::size_t count = 0;
    for (const Assignment& a : taken) {
      if (count == kMaxMatches) break;
      matches[count++] = {static_cast<std::uint16_t>(window_), a.line, a.model_line, a.flipped};
    }
    const LensView view{scene_.lines_of(window_), Span<const LineMatch>(matches, count), pose};
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

  /// The longest matches suffice for a seed.
  static constexpr std::size_t kMaxMatches = 32;

  const MatchScene& scene_;
  Lens lens_;
  std::size_t window_;
  Span<const FlatLine> flat_;
  FlatFrame frame_;
  MatchScratch* scratch_;
};

bool same_seed(const MatchSeed& a, const MatchSeed& b) {
  if (a.window != b.window) return false;
  if (std::abs(a.f_px - b.f_px) > kSameFocal * a.f_px) return false;
  return (rotation_of(a.pose) - rotation_of(b.pose)).norm() < kSameRotation;
}

void offer(const MatchSeed& seed, BoundedBest<MatchSeed>* seeds) {
  for (std::size_t i = 0; i < seeds->size(); ++i) {
    if (!same_seed((*seeds)[i], seed)) continue;
    if ((*seeds)[i].score >= seed.score) return;
    seeds->erase(i);
    break;
  }
  seeds->offer(seed, [](const MatchSeed& a, const MatchSeed& b) { return a.score > b.score; });
}

}  // namespace

void seed_from_quad(const MatchScene& scene, const Lens& lens, std::size_t window, Span<const FlatLine> flat,
                    const FlatFrame& frame, const ImageQuad& quad, const QuadPoseOptions& options,
                    MatchScratch* scratch, BoundedBest<MatchSeed>* seeds, SeedStats* stats) {
  double best_score = 0.0;
  for (const MatchSeed& seed : seeds->view()) {
    if (seed.window != window) continue;
    if (seed.num_lines >= kClearLines && seed.score >= kClearShare * seed.possible) return;
    best_score = std::max(best_score, seed.score);
  }
  ++stats->image_quads;
  for (const ModelQuad& face : scene.model.quads) {
    for (int labeling = 0; labeling < kNumQuadLabelings; ++labeling) {
      PoseGuess guesses[kMaxQuadGuesses];
      const std::size_t count = guess_poses(quad, face, labeling, options, guesses);
      for (std::size_t g = 0; g < count; ++g) {
        ++stats->guesses;
        MatchSeed seed;
        SeedFit fit(scene, lens, window, flat, frame, scratch);
        if (!fit.run(guesses[g], options.focal, best_score, &seed)) continue;
        ++stats->fits;
        best_score = std::max(best_score, seed.score);
        offer(seed, seeds);
      }
    }
  }
}

}  // namespace lecalib
