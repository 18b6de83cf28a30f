// SPDX-License-Identifier: MIT
/// Where two edges cross at a small angle, the line that was found first holds the events of both for a long stretch,
/// and the other one ends there, or is found in pieces. Once all lines are known, each may grow on through the events
/// of those that it crosses.
#pragma once

#include <cstddef>

#include "lecalib/segments/line_fit.hpp"
#include "lecalib/segments/line_growth.hpp"

namespace lecalib {

struct ExtensionOptions {
  /// Sine of the angle at which lines cross (0.03 to 0.2: 1.7 to 11.5 degrees). Lines at smaller angles are rows of
  /// edges or repeats, and merging's; at larger ones growth bridges the crossing.
  float min_sine = 0.03F;
  float max_sine = 0.2F;
  float reach_px = 150;         ///< between the crossing and either line's nearer end, px: further ones hide nothing
  float min_gain_px = 8;        ///< by which the line must become longer, px
  float max_thickening = 1.4F;  ///< of the line: more and it has left its edge
  float min_kept_share = 0.5F;  ///< of its events that a line must keep, or it is fitted again and may be dropped
};

/// Lets lines grow on through those that they cross, and fits anew, or drops, lines that lost their events by it: what
/// was found between two edges, of events of both.
/// @param lines  [*count] each with its id as the owner of its events
/// @param[in,out] count  lines before and after; order is kept
/// @return how many lines were extended
/// Complexity: a growth and a fit for each line that crosses another at a small angle.
std::size_t extend_lines(const EventCloud& cloud, const ExtensionOptions& options, const GrowthOptions& growth_options,
                         const LineFitOptions& fit_options, const LineWorkspace& workspace, Span<MovingLine> lines,
                         std::size_t* count);

}  // namespace lecalib
