// SPDX-License-Identifier: MIT
/// The lines at both ends of a window, from all events near to a moving line: robust fit, extents, tests, sigma.
#pragma once

#include <cstdint>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/core/records.hpp"
#include "lecalib/segments/line_equations.hpp"
#include "lecalib/segments/line_workspace.hpp"
#include "lecalib/segments/moving_line.hpp"

namespace lecalib {

struct LineFitOptions {
  LinePriors priors;
  float min_length_px = 0;        ///< px; 0: 7 % of the sensor's diagonal, within 20 to 30 px
  std::uint32_t min_events = 25;  ///< >= 10
  float max_thickness_px = 1.6F;  ///< one sigma of the events' distance, px, > 0: more is no edge but texture
  float min_contrast = 2.2F;      ///< events on the line over events in equal areas beside it
  float min_over_noise = 4;       ///< events on the line over what the noise floor lets expect
  float min_evenness = 0.6F;  ///< median over mean of equal patches along the line; hot pixels and crossings are uneven
  float max_empty_share = 0.25F;        ///< of patches without events, 0 to 1
  float min_half_share = 0.12F;         ///< of the events in the poorer half of the window, 0 to 0.5
  std::uint32_t max_fit_events = 3000;  ///< the fit takes at most about so many, evenly chosen
  /// Part of sigma that does not shrink with the number of events, px: an edge's events are late together, by its
  /// contrast and the scene's light. And its growth on sparse edges, px^2 times events per px^2 swept.
  float systematic_px = 0.35F;
  float systematic_sparse_px2 = 0.18F;
};

/// Why a line was accepted or not.
enum class FitOutcome : std::uint8_t {
  accepted,
  too_few_events,
  no_solution,   ///< normal equations not positive definite
  too_thick,     ///< see max_thickness_px
  low_contrast,  ///< see min_contrast
  noise,         ///< see min_over_noise
  uneven,        ///< see min_evenness, max_empty_share
  one_sided,     ///< see min_half_share
  too_short,
};
inline constexpr std::size_t kNumFitOutcomes = 9;

/// Whose events a fit may take beside the free ones, and what it marks them with.
struct FitClaim {
  std::uint8_t id = 0;                ///< new owner of the line's events, 1 to kMaxLines
  std::uint8_t may_take[2] = {0, 0};  ///< owners that the line replaces (merging)
  float tolerance = 1;                ///< factor on the evenness tests: a joined line may be less even
};

/// Fits the line: events within a wide band, then iteratively re-weighted least squares with a narrowing one; the
/// extent of the support in each half of the window gives the ends; tests tell lines from noise and texture.
/// @param line  in: low, high, coefficients, polarities; out: all fields, centred; unchanged unless accepted
/// On acceptance the events near to the line are marked as its own.
FitOutcome fit_line(const EventCloud& cloud, const LineFitOptions& options, const LineWorkspace& workspace,
                    const FitClaim& claim, MovingLine* line);

/// The record of a line fitted in `cloud`, with its one-sigma: the statistical part from the covariance, the systematic
/// part from the options.
EventLine to_event_line(const EventCloud& cloud, const MovingLine& line, const LineFitOptions& options);

/// Smallest length of a line on this sensor, px.
float min_line_length(const LineFitOptions& options, std::uint16_t width, std::uint16_t height);

}  // namespace lecalib
