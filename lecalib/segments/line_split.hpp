// SPDX-License-Identifier: MIT
/// Cuts rows of edges that lie on one line where nothing fires between them: panes of a window, doors along a wall.
#pragma once

#include <cstddef>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/segments/line_fit.hpp"
#include "lecalib/segments/line_workspace.hpp"
#include "lecalib/segments/moving_line.hpp"

namespace lecalib {

struct SplitOptions {
  /// How much rarer than once per line a gap must be by chance before the line is cut there, nats, > 0. A gap's
  /// probability comes from the line's own share of pixels without events.
  float min_surprise = 5;
  float min_gap_px = 5;  ///< px, >= 1: shorter gaps are the pixel grid's
};

/// Cuts lines at their gaps. A gap moves with the object along the line, which the line itself cannot show; the motion
/// is tried in steps, and the one with the clearest gap is taken. Pieces that are too short or too weak for a line of
/// their own are left out. Pieces keep the whole line's surface and id: its events have placed it better than their own
/// would.
/// @param lines  room for pieces behind [*count]; a piece without room stays joined to its neighbour
/// @param[in,out] count  lines before and after
/// @return how many cuts were made
/// Complexity: one visit per event of the lines, plus their length in px times the motions tried.
std::size_t split_lines(const EventCloud& cloud, const SplitOptions& options, const LineFitOptions& fit_options,
                        const LineWorkspace& workspace, Span<MovingLine> lines, std::size_t* count);

}  // namespace lecalib
