// SPDX-License-Identifier: MIT
/// Where a line's edge is, rather than its events: one virtual event for each pixel that the line crosses, at the time
/// when the intensity there is half way.
///
/// In log intensity an edge's events lie towards its dark side, by tenths of a pixel up to more than one, as its
/// contrast has it. A pixel's own events say when it was half way. With n events of one polarity in a crossing and the
/// sensor's threshold theta, ln C = (n + 1) theta is the contrast: what the last event before left over and what the
/// next one still lacks are half a threshold each, on average, and a change of direction costs one more. So the k-th
/// event (from 1) stands at the log step (k + 1/2) theta, and the edge at ln(2 C / (1 + C)) below the bright level;
/// time is interpolated between the two events around it. Edges of one event or two per crossing still trail their
/// motion, by an amount that depends on n alone.
///
/// Incomplete crossings lack the events of one side and would pull the line: those pixels are left out that the line
/// does not pass from before the first possible event to behind the last.
#pragma once

#include <cstdint>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/core/records.hpp"
#include "lecalib/segments/line_equations.hpp"
#include "lecalib/segments/line_shape.hpp"
#include "lecalib/segments/line_workspace.hpp"

namespace lecalib {

/// Gauss and Legendre's three places from -1 to 1 along a line, and their weights, of sum 1. The values there, at two
/// times evenly before and after the middle, are uncorrelated for a fit that is quadratic along the line, linear in
/// time and has its data spread evenly.
inline constexpr float kEdgePlaces[3] = {-0.7745967F, 0, 0.7745967F};
inline constexpr float kEdgePlaceWeights[3] = {5.0F / 18, 8.0F / 18, 5.0F / 18};

struct CrossingOptions {
  float threshold = 0.24F;  ///< theta, of ln intensity, (0, 2]; a third more or less moves an edge by 0.05 px
  float band_px = 2.5F;     ///< events so near to the line belong to its crossings, (0, 100]
  /// How far the line passes beyond a pixel, px, > 0: on the edge's bright side, where crossings begin (OFF) or end
  /// (ON) as the edge arrives; and on its dark side, where they reach the further out the more events they have.
  float bright_margin_px = 0.5F;
  /// The same on the bright side, of the edge itself once it is found: it lies nearer to there than its events.
  float edge_margin_px = 0.8F;
  float dark_margin_px = 0.35F;
  float dark_margin_per_event_px = 0.12F;
  float max_dark_margin_px = 1.2F;
  /// So near to its ends a line's crossings count for nothing: pixels there see only a part of its contrast, and what
  /// else ends there, px. Up to a tenth of the line at either end.
  float end_margin_px = 2;
  float max_gap_px = 1.5F;           ///< travel between two events of one crossing, > 0 ...
  float min_gap_us = 800;            ///< ... within these times
  float max_gap_us = 100000;         ///< >= min_gap_us
  std::uint32_t max_events = 40;     ///< of a crossing, 1 to 255; more are flicker or a hot pixel
  std::uint32_t min_crossings = 40;  ///< of a line, > 0; fewer share too few errors to average
  /// One sigma, px, of how much the edge and its events move apart within a window.
  float motion_change_px = 0.1F;
  /// Error that neighbouring crossings share, px, of a line with shared_crossings; it grows as sqrt(1 / n) below that,
  /// and with the scatter of crossings above the other figure, px.
  float shared_error_px = 0.04F;
  float shared_error_scatter_px = 0.12F;
  float shared_crossings = 200;
};

/// Whether crossings stay within whole numbers: what other options can do wrong shows in the edges alone.
constexpr bool valid(const CrossingOptions& o) {
  return o.threshold > 0 && o.threshold <= 2 && o.band_px > 0 && o.band_px <= 100 && o.max_gap_px > 0 &&
         o.min_gap_us <= o.max_gap_us && o.max_events > 0 && o.max_events <= 255 && o.min_crossings > 0;
}

/// How to fit to crossings.
struct CrossingFit {
  float window_us;  ///< length of the window, > 0
  const CrossingOptions& crossings;
  const LineShapeOptions& shape;  ///< as for the events' shape
  const LinePriors& priors;
};

/// Fits a line's shape to the complete crossings of its pixels.
/// @param shape    of the line's events, from shape_line()
/// @param[out] out the edge; unchanged unless true
/// @param[in,out] dropped  grows by the pixels left out, evenly, for want of room
/// @return false for lines of both polarities and for those with too few complete crossings
/// Needs all events of the window: thinned, a crossing lacks its first or last one.
bool fit_crossings(const EventCloud& cloud, const CrossingFit& fit, const LineWorkspace& workspace,
                   const MovingLine& line, const LineShape& shape, LineEdge* out, std::uint32_t* dropped);

}  // namespace lecalib
