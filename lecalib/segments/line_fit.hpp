// SPDX-License-Identifier: MIT
/// From a grown line to one that stands: robust fit to the events near to it, extents, tests that tell it from noise.
#pragma once

#include <cstdint>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/segments/edge_row.hpp"
#include "lecalib/segments/line_equations.hpp"
#include "lecalib/segments/line_kink.hpp"
#include "lecalib/segments/line_workspace.hpp"
#include "lecalib/segments/moving_line.hpp"
#include "lecalib/segments/shared_stretches.hpp"

namespace lecalib {

struct LineFitOptions {
  LinePriors priors;
  float min_length_px = 0;        ///< px; 0: 3 % of the sensor's diagonal, within 12 to 30 px
  std::uint32_t min_events = 25;  ///< >= 10
  float max_thickness_px = 1.6F;  ///< one sigma of the events' distance, px, > 0: more is no edge but texture
  float min_contrast = 2.2F;      ///< events on the line over events in equal areas beside it
  /// Evidence against chance beyond the logarithm of how many lines can be tried in the image, nats, see
  /// required_evidence(): chance makes fewer than e^-4 lines in a window.
  float min_evidence = 4;
  float min_evenness = 0.6F;  ///< median over mean of equal patches along the line; hot pixels and crossings are uneven
  float max_empty_share = 0.25F;  ///< of patches without events, 0 to 1
  float min_half_share = 0.12F;   ///< of the events in the poorer half of the window, 0 to 0.5
  float max_end_sigma_px = 2;     ///< one sigma of where its ends stand across it, px: more says nothing there
  KinkOptions kink;
  GapOptions gaps;
  std::uint32_t max_fit_events = 1000;  ///< the fit takes about so many, evenly chosen; it only has to find the line
};

/// Why a line was accepted or not.
enum class FitOutcome : std::uint8_t {
  accepted,
  too_few_events,
  no_solution,   ///< normal equations not positive definite
  kinked,        ///< turns off, even after being cut twice
  too_thick,     ///< see max_thickness_px
  low_contrast,  ///< see min_contrast
  noise,         ///< see min_evidence
  uneven,        ///< see min_evenness, max_empty_share
  one_sided,     ///< see min_half_share
  too_short,
  uncertain,  ///< see max_end_sigma_px
};
inline constexpr std::size_t kNumFitOutcomes = 11;

/// What a fit may take, and what it marks it with.
struct FitClaim {
  std::uint8_t id = 0;          ///< new owner of the line's events, 1 to kMaxLines
  OwnerFilter may_take;         ///< whose events the line may take
  float tolerance = 1;          ///< factor on the evenness tests: a joined line may be less even
  SharedStretches shared = {};  ///< events there support the line but don't shape it
};

/// Fits the line: events within a wide band, then iteratively re-weighted least squares with a narrowing one; where it
/// turns off it is cut and the longer part fitted again; the extent of the support in each half of the window gives the
/// ends; tests tell lines from noise and texture.
/// @param line  in: low, high, coefficients, polarities, events (an estimate); out: all fields, centred; unchanged
///              unless accepted
/// On acceptance the events near to the line are marked as its own.
FitOutcome fit_line(const EventCloud& cloud, const LineFitOptions& options, const LineWorkspace& workspace,
                    const FitClaim& claim, MovingLine* line);

/// Evidence against chance that a line needs on this sensor, nats: min_evidence and the logarithm of the number of
/// lines that can be tried there: either end anywhere in the image at the window's begin, and up to 10 px across the
/// line from there at its end. Neighbouring ones share their events, so that steps of 2 px across the line and of 8 px
/// along it count, a third of the shortest line or so.
float required_evidence(const LineFitOptions& options, std::uint16_t width, std::uint16_t height);

/// Smallest length of a line on this sensor, px.
float min_line_length(const LineFitOptions& options, std::uint16_t width, std::uint16_t height);

}  // namespace lecalib
