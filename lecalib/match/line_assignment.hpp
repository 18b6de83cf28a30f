// SPDX-License-Identifier: MIT
/// Which detected line is which model line, once camera and pose are roughly known: the model's lines are projected
/// into the flat image, and detected lines are given to them by distance, direction and extent. Faces are not known, so
/// a hidden edge simply finds no line; nothing demands that it does.
#pragma once

#include "lecalib/core/arena.hpp"
#include "lecalib/match/bounded_best.hpp"
#include "lecalib/match/flat_lines.hpp"
#include "lecalib/match/model_graph.hpp"

namespace lecalib {

/// One detected line given to one model line.
struct Assignment {
  std::uint16_t line;
  std::uint16_t model_line;
  bool flipped;   ///< its first end point is nearer to the model line's q
  double low_px;  ///< where it lies along the projected model line, from p
  double high_px;
  double distance_px;  ///< mean distance of its points
  double weight_px;    ///< overlap times closeness: the rank
};

struct AssignmentOptions {
  double gate_px = 5.0;           ///< largest mean distance of a line's points
  double max_slope = 0.08;        ///< largest difference in direction (sine)
  double overshoot_px = 8.0;      ///< a detected line may reach so far beyond the model line's ends ...
  double overshoot_share = 0.12;  ///< ... or this share of its own length, whichever is more
  double unit_px = 1.0;           ///< about a thousandth of the image's diagonal
  /// With so few model lines found that the pose follows any of them, each must be covered by this share. 0: no demand.
  double min_coverage_of_few = 0.0;
  /// [model lines] contrast_of() that a match must not contradict, relative to p -> q, 0 any; empty: none is known.
  Span<const std::int8_t> contrast;
  /// [lines] contrast_of() of the detected lines; needed with `contrast`.
  Span<const std::int8_t> line_contrast;
};

/// A model line as the camera would see it.
struct ProjectedLine {
  double normal[3];     ///< nx x + ny y + c = 0 in flat px, unit length
  double start[2];      ///< flat image of p (of its part in front of the camera)
  double direction[2];  ///< unit, from p to q
  double length_px;     ///< 0: not in front of the camera
  double seen_low_px;   ///< part within the image, along the line
  double seen_high_px;
};

struct AssignmentWorkspace {
  Span<ProjectedLine> projected;  ///< [model lines]
  Span<Assignment> candidates;    ///< pairs under test
  Span<std::uint8_t> line_used;   ///< [lines per window]
  Span<Assignment> assignments;   ///< the result
};

struct AssignmentCapacities {
  std::size_t model_lines = 40;
  std::size_t lines = 64;
  std::size_t candidates = 160;
  std::size_t assignments = 64;  ///< matches per window
};

template <class Carver>
constexpr bool carve(Carver& carver, const AssignmentCapacities& capacities, AssignmentWorkspace* out) {
  return carver.carve(capacities.model_lines, &out->projected) &&
         carver.carve(capacities.candidates, &out->candidates) && carver.carve(capacities.lines, &out->line_used) &&
         carver.carve(capacities.assignments, &out->assignments);
}

/// What an assignment says about the pose behind it.
struct Support {
  double score = 0;     ///< sum over model lines of coverage times closeness, long lines count more: see .cpp
  double found = 0;     ///< the same, but whole for a line of which half is covered closely, and only by what is close
  double possible = 0;  ///< both if every model line in the image were found exactly
  std::uint16_t lines = 0;  ///< model lines with at least one detected line
  std::uint32_t candidates_dropped = 0;
  std::uint32_t assignments_dropped = 0;
};

/// @param f_px  focal length of the flat image
/// @param lines flat lines of the window, looked at at `instant`
/// @param[out] support may be null
/// @return the assignments, in the workspace; each detected line at most once
Span<Assignment> assign_lines(const ModelGraph& model, const Pose& pose, double f_px, const FlatFrame& frame,
                              Span<const FlatLine> lines, Instant instant, const AssignmentOptions& options,
                              AssignmentWorkspace* workspace, Support* support);

/// What of Support::possible belongs to model lines that could not be found: an edge that slides along itself, or
/// stands, makes no events.
/// @param poses of the window, by Instant
/// @param taken the window's assignments; lines that were found count as possible
double silent_weight(const ModelGraph& model, const Pose (&poses)[kNumInstants], double f_px, const FlatFrame& frame,
                     double unit_px, Span<const Assignment> taken);

}  // namespace lecalib
