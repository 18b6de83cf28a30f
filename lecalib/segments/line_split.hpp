// SPDX-License-Identifier: MIT
/// Cuts rows of edges that lie on one line where nothing fires between them: panes of a window, doors along a wall.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/segments/line_fit.hpp"
#include "lecalib/segments/line_workspace.hpp"
#include "lecalib/segments/moving_line.hpp"

namespace lecalib {

/// Cuts lines at the gaps that their fit has seen, see EdgeRow. Pieces that are too short or too weak for a line of
/// their own are left out. Pieces keep the whole line's surface and id: its events have placed it better than their own
/// would.
/// @param lines  room for all pieces of a line behind [*count]: without any it stays whole, and pieces beyond it go
/// @param[in,out] count  lines before and after
/// @param[in,out] dropped  grows by the pieces that found no room
/// @return how many cuts were made
/// Complexity: for lines with gaps one visit per event, plus their length in px times the motions tried.
std::size_t split_lines(const EventCloud& cloud, const LineFitOptions& options, const LineWorkspace& workspace,
                        Span<MovingLine> lines, std::size_t* count, std::uint32_t* dropped);

}  // namespace lecalib
