// SPDX-License-Identifier: MIT
/// Joins pieces of one line, and with them finds of the same line twice.
#pragma once

#include <cstddef>

#include "lecalib/segments/line_fit.hpp"

namespace lecalib {

struct MergeOptions {
  float min_cosine = 0.99F;      ///< of the angle between two pieces (0.99: 8 degrees)
  float max_distance_px = 0.8F;  ///< of one piece's ends from the other's surface, px, beyond its own uncertainty
  float distance_sigmas = 3;     ///< uncertainty allowed on top, in sigmas of both
  float max_allowed_px = 6;      ///< px: but no more than this, however uncertain the extrapolation
  float max_gap_lengths = 1;     ///< gap between pieces, in mean lengths, plus 8 px
  float min_gap_filling = 0.4F;  ///< share of the expected events that a gap must hold: two edges in a row stay two
};

/// Joins every pair of pieces whose surfaces agree at both their ends, begin and end, when the gap between them is
/// filled with events (their own, or those of lines that cross there), and the fit of the whole is accepted. On both
/// sides of a stretch that they share with a crossing line it is enough that one line fits both.
/// @param lines  [*count] joined ones are removed, order otherwise kept
/// @return how many lines were joined to another
/// Complexity O(lines^2) pairs, plus a fit for each join.
std::size_t merge_lines(const EventCloud& cloud, const MergeOptions& options, const SharingOptions& sharing,
                        const LineFitOptions& fit_options, const LineWorkspace& workspace, Span<MovingLine> lines,
                        std::size_t* count);

}  // namespace lecalib
