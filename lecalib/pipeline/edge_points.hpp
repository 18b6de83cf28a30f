// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "lecalib/core/records.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/pipeline/view_points.hpp"
#include "lecalib/solve/calibration_data.hpp"

namespace lecalib {

/// Where the views by edges come to lie.
struct EdgePointRoom {
  Span<LinePoint> points;  ///< [kEdgePointsPerMatch x matches] at least; what is beyond is room for other flanks
  Span<EdgePoint> edges;   ///< [as points]
  Span<View> views;        ///< [2 x matched windows] at least
};

/// Which edges count, and how much.
struct EdgePointOptions {
  /// Largest scatter of an edge's crossings, px, with `strong_events` in a crossing and with fewer: more is no single
  /// edge, but two close ones, a rim in relief, a shadow.
  float max_scatter_px = 0.18F;
  float max_faint_scatter_px = 0.22F;
  /// A lens out of focus and pixels unlike each other make all edges scatter more. So strong ones may scatter this many
  /// times as much as the better quarter of a recording's, where that is more than max_scatter_px ...
  float scatter_over_usual = 1.5F;
  float max_usual_scatter_px = 0.35F;  ///< ... but no more than this: two rims scatter so. Below max_scatter_px: off
  /// One sigma, px, that an edge with no more than one event and a half per crossing has besides its own; it falls to
  /// nothing at one event more.
  float faint_sigma_px = 0.10F;
  /// Where so many lines of a window have edges with as many events per crossing, its fainter ones are left out: what
  /// fires there is often something else than the model's edge.
  std::uint32_t strong_lines = 6;
  float strong_events = 2;
  /// How far away the other flank of a drawn line is looked for, px; 0: drawn lines are not looked for.
  float max_drawn_width_px = 8;
};

/// What was left out.
struct EdgePointStats {
  std::uint32_t lines = 0;           ///< matched
  std::uint32_t without_edge = 0;    ///< of these: hardly moved, or seen in part
  std::uint32_t blurred = 0;         ///< beyond max_scatter_px
  std::uint32_t faint = 0;           ///< beside enough strong ones
  std::uint32_t flanks = 0;          ///< added: opposite sides of lines matched
  std::uint32_t flanks_dropped = 0;  ///< of one view, for want of room
};

/// Points that stand for an edge in one view: kEdgePlaces.
inline constexpr std::size_t kPointsPerEdge = 3;
/// For each match: in two views.
inline constexpr std::size_t kEdgePointsPerMatch = 2 * kPointsPerEdge;

/// Turns the matched lines of windows into views by their edges: two for each matched window, kEdgeTime of half a
/// window before and after its middle. Lines without a good edge give no points. With a line comes the nearest line
/// that is not matched, runs along it and is dark on the side of it: then the model's line is drawn, with these as its
/// flanks.
/// @param matches ordered by window
/// @param stats   may be null
/// @return ok | invalid_argument (an index out of range, matches not ordered) | capacity_exceeded; *made unchanged
///         unless ok
Status make_edge_points(const EdgePointOptions& options, Span<const LineWindow> windows, Span<const LineMatch> matches,
                        const EdgePointRoom& room, ViewsMade* made, EdgePointStats* stats);

}  // namespace lecalib
