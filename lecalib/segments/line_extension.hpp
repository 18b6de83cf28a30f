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
  SharingOptions sharing;
  float min_gain_px = 8;        ///< by which the line must become longer, px
  float max_thickening = 1.4F;  ///< of the line: more and it has left its edge
  float min_kept_share = 0.5F;  ///< of its events that a line must keep, or it is fitted again and may be dropped
};

/// Fits lines that share stretches with others anew, each by what is surely its own, and drops those that lose most of
/// their events by it: what was found between two edges, of events of both.
/// @param lines  [*count] each with its id as the owner of its events
/// @param[in,out] count  lines before and after; order is kept
void clear_lines(const EventCloud& cloud, const ExtensionOptions& options, const LineFitOptions& fit_options,
                 const LineWorkspace& workspace, Span<MovingLine> lines, std::size_t* count);

/// Lets lines grow on through those that they cross; lines that lose their events by it are treated as in
/// clear_lines().
/// @param lines, count  as there
/// @return how many lines were extended
/// Complexity: a growth and a fit for each line that crosses another at a small angle.
std::size_t extend_lines(const EventCloud& cloud, const ExtensionOptions& options, const GrowthOptions& growth_options,
                         const LineFitOptions& fit_options, const LineWorkspace& workspace, Span<MovingLine> lines,
                         std::size_t* count);

}  // namespace lecalib
