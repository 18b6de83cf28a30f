// SPDX-License-Identifier: MIT
/// From a first guess of a moving line to all of it: grows along the line in the events themselves.
#pragma once

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/segments/line_equations.hpp"
#include "lecalib/segments/line_workspace.hpp"
#include "lecalib/segments/moving_line.hpp"
#include "lecalib/segments/shared_stretches.hpp"

namespace lecalib {

struct GrowthOptions {
  float band_px = 2.8F;          ///< events within it belong to the line while it grows, px, (0, 100]
  float max_gap_px = 16;         ///< a line without support for so long ends, px, 4 to 1e6
  float gap_events = 12;         ///< so does one without support where it should have had so many events, >= 0
  float min_density = 0.3F;      ///< of the line's own density: less is no support, 0 to 1
  float min_over_noise = 1.5F;   ///< support in units of the noise floor
  float other_polarity_px = 16;  ///< a line goes on in the other polarity (checkerboards) if for so long, px; 0: never
  float min_other_polarity_evidence = 28;  ///< ... and if its events there are no noise, nats
  std::uint32_t min_events = 10;           ///< in the first guess
};

/// Whether a line's growth stays within whole numbers: what other options can do wrong shows in the lines alone.
constexpr bool valid(const GrowthOptions& o) {
  return o.band_px > 0 && o.band_px <= 100 && o.max_gap_px >= 4 && o.max_gap_px <= 1e6F && o.gap_events >= 0;
}

/// Fits the line to the events near to it that it may take and lets it grow at both ends, step by step, fitting anew
/// after each. Events of other lines neither support it nor end it: crossings are bridged.
/// @param shared  events there support the line, whose ever they are, but don't shape it
/// @param line  in: a guess with low, high, polarities, events (an estimate, 0: not known); out: the grown line
///              (low[0] = low[1], high[0] = high[1]) and an estimate of its events, without thickness and covariance;
///              unchanged unless true
/// @return false when the guess holds too few events
bool grow_line(const EventCloud& cloud, const GrowthOptions& options, const LinePriors& priors,
               const LineWorkspace& workspace, const OwnerFilter& may_take, const SharedStretches& shared,
               MovingLine* line);

}  // namespace lecalib
