// SPDX-License-Identifier: MIT
/// Quadrilaterals among the lines of one window: four lines of which at least three neighbouring pairs meet near their
/// ends. Works on flat lines at the window's middle. Broken lines are joined first, the pieces stay candidates as well.
#pragma once

#include "lecalib/core/arena.hpp"
#include "lecalib/match/bounded_best.hpp"
#include "lecalib/match/flat_lines.hpp"

namespace lecalib {

struct ImageQuadOptions {
  double unit_px = 1.0;  ///< scale of all tolerances in px, > 0; about a thousandth of the image's diagonal
  /// A line may end this share of its length before a corner, and go on this share of it behind one: that of a
  /// checkerboard does so by a square. Both may also be so many units.
  double gap_share = 0.12;
  double overhang_share = 0.25;
  double end_units = 8.0;
  double min_sine = 0.12;     ///< smallest sine of the angle at a corner
  double min_coverage = 0.4;  ///< share of a side that its line must cover
};

/// Four lines around a patch of the image. corner[i] is where side i meets side i + 1, flat px.
struct ImageQuad {
  double corner[4][2];
  double covered_px;  ///< length of the sides that carries detected lines: the rank
};

/// A detected line or several pieces of one.
struct ImageEdge {
  double end[2][2];   ///< flat px
  double normal[3];   ///< nx x + ny y + c = 0, unit length
  double length_px;   ///< between the ends
  double support_px;  ///< of it, covered by detected lines
};

/// Two edges that meet near an end of each.
struct ImageCorner {
  double point[2];
  std::uint16_t edge[2];
  std::uint8_t end[2];    ///< which end of each edge is near
  std::uint16_t next[2];  ///< next corner at the same end of the same edge: linked lists over ImageQuadWorkspace::first
  double gap_px;          ///< sum of both distances from end to corner
};

struct ImageQuadCapacities {
  std::size_t edges = 96;
  std::size_t corners = 384;
  std::size_t quads = 96;
};

struct ImageQuadWorkspace {
  Span<ImageEdge> edges;
  Span<ImageCorner> corners;
  Span<std::uint16_t> first;  ///< [2 * edges] head of the list of corners at each edge end
  Span<ImageQuad> quads;
};

template <class Carver>
constexpr bool carve(Carver& carver, const ImageQuadCapacities& capacities, ImageQuadWorkspace* out) {
  return carver.carve(capacities.edges, &out->edges) && carver.carve(capacities.corners, &out->corners) &&
         carver.carve(2 * capacities.edges, &out->first) && carver.carve(capacities.quads, &out->quads);
}

struct ImageQuadStats {
  std::uint32_t edges_dropped = 0;    ///< joined lines beyond the capacity
  std::uint32_t corners_dropped = 0;  ///< the widest gaps beyond the capacity
  std::uint32_t quads_dropped = 0;    ///< the least covered beyond the capacity
};

/// @param lines flat lines of a window; unusable ones are skipped
/// @param stats added to
/// @return the quads, longest covered outline first; in the workspace
/// Complexity O(lines^2 + corners * (corners per end)^2).
Span<const ImageQuad> find_image_quads(Span<const FlatLine> lines, const ImageQuadOptions& options,
                                       ImageQuadWorkspace* workspace, ImageQuadStats* stats);

}  // namespace lecalib
