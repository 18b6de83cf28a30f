// SPDX-License-Identifier: MIT
/// Which side of an edge is the brighter one does not change while it is watched: polarity times the direction of the
/// motion across the edge tells it in every window. A match that says otherwise is another edge nearby.
#pragma once

#include "lecalib/match/flat_lines.hpp"

namespace lecalib {

/// @return +1 where the brighter side is the one that (-dy, dx) points to, first to second end point (dx, dy); -1 where
/// it is the other one; 0 where the line does not tell: both polarities, or less than `min_motion_px` across
int contrast_of(const EventLine& line, double min_motion_px);

/// Votes for one model line.
struct ContrastVote {
  std::uint16_t positive = 0;
  std::uint16_t negative = 0;
};

/// The decided contrast, relative to p -> q: +1 or -1; 0 while the votes are few or divided (the two flanks of a
/// printed line vote against each other).
int decided_contrast(const ContrastVote& vote);

}  // namespace lecalib
