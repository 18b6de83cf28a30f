// SPDX-License-Identifier: MIT
/// Guesses at camera and pose from single windows: every quadrilateral of a window laid upon every face of the model,
/// in every way, and kept when the rest of the model then finds lines too.
#pragma once

#include "lecalib/match/image_quads.hpp"
#include "lecalib/match/match_hints.hpp"
#include "lecalib/match/model_graph.hpp"
#include "lecalib/match/quad_pose.hpp"
#include "lecalib/match/window_track.hpp"

namespace lecalib {

/// A guess that fits its own window.
struct MatchSeed {
  Pose pose;
  double f_px;
  double score;  ///< Support::score in its window
  double possible;
  double rank;  ///< by which seeds are ordered: the score, more where it agrees with the hints
  std::uint16_t window;
  std::uint16_t num_lines;
  bool tried;
};

/// The window that is searched and through what it is seen.
struct SeedWindow {
  std::size_t index = 0;
  Span<const FlatLine> flat;  ///< its lines through `lens`, whose f_px is not used
  FlatFrame frame{};
  Lens lens;
  FocalRange focal{0, 0};
  bool near_hint = false;  ///< the hinted pose is about this window
};

struct SeedStats {
  ImageQuadStats limits;
  std::uint32_t image_quads = 0;  ///< looked at
  std::uint32_t guesses = 0;      ///< quads laid upon faces that passed the geometry
  std::uint32_t fits = 0;         ///< of them, fitted well enough to be offered
};

/// Tries one image quadrilateral on all faces of the model.
/// @param[in,out] seeds best first; one that repeats a better one of the same window is not added
void seed_from_quad(const MatchScene& scene, const SeedWindow& window, const ImageQuad& quad, const MatchHints& hints,
                    MatchScratch* scratch, BoundedBest<MatchSeed>* seeds, SeedStats* stats);

/// Tries the hinted pose itself, with all focal lengths of the range that agree with the hints.
void seed_from_hint(const MatchScene& scene, const SeedWindow& window, const MatchHints& hints, MatchScratch* scratch,
                    BoundedBest<MatchSeed>* seeds, SeedStats* stats);

}  // namespace lecalib
