// SPDX-License-Identifier: MIT
/// The last word on a line: where it stands at the window's ends, from all of its events, and how sure they are of it.
///
/// A fitted line moves evenly and bends like a parabola. Hands and wings accelerate, and strong distortion bends lines
/// in other ways, by tenths of a pixel each: more than the statistical error of a line with thousands of events. The
/// shape has ten terms, with u from -1 to 1 along the line and tau from -1 to 1 in time:
///     d = c . (1, u, tau, u tau, u^2, tau^2, u tau^2, u^2 tau, u^3, u^4)
/// held by priors on all that a fitted line does not have.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/core/records.hpp"
#include "lecalib/segments/line_equations.hpp"
#include "lecalib/segments/line_workspace.hpp"
#include "lecalib/segments/moving_line.hpp"
#include "lecalib/segments/shape_equations.hpp"
#include "lecalib/segments/shared_stretches.hpp"

namespace lecalib {

struct LineShapeOptions {
  /// Standard deviations of the priors, px at the line's ends, > 0: tau^2, u tau^2; u^2 tau, u^3 and u^4 as a share of
  /// the line's bend, which distortion gives all of them, and what they may have without it.
  float acceleration_px = 0.2F;
  float turn_acceleration_px = 0.1F;
  float bend_change_share = 0.05F;
  float higher_bend_share = 0.15F;
  float least_bend_change_px = 0.03F;
  float least_bend_px = 0.02F;
  std::uint32_t max_events = 4000;  ///< the fit takes at most about so many, evenly chosen
  /// Part of sigma that does not shrink with the number of events, px: an edge's events are late together, by its
  /// contrast and the scene's light. And its growth on sparse edges, px^2 times events per px^2 swept.
  float systematic_px = 0.46F;
  float systematic_sparse_px2 = 0.3F;
  /// What the shape's terms leave of a bend, as a share of it and at the line's ends: near its fold a distortion bends
  /// lines in higher orders.
  float unshaped_bend_share = 0.03F;
  /// Events that scatter like independent draws have no offset in common: by so much, px ...
  float independent_scatter_px = 0.9F;
  /// ... as unevenly along the line as chance does: variance over mean of their counts, at least ...
  float independent_dispersion = 0.55F;
  float independent_px = 0.03F;  ///< ... and this is their systematic part instead, px
};

/// A fitted shape, in the frame of its line.
struct LineShape {
  float middle_px = 0;               ///< s at u = 0
  float half_px = 1;                 ///< half of the line's length
  float terms[kNumShapeTerms] = {};  ///< c, px

  [[nodiscard]] float position(float s_px) const noexcept { return (s_px - middle_px) / half_px; }  ///< u
  [[nodiscard]] float low_px() const noexcept { return middle_px - half_px; }
  [[nodiscard]] float high_px() const noexcept { return middle_px + half_px; }
};

/// Stretches of about 12 px in which a shape's line is summed up, see ShapeCells.
int shape_columns(const LineShape& shape);

/// Holds a shape's terms by the priors of the options and by those that a fitted line has too.
void add_shape_priors(const LineShapeOptions& options, const LinePriors& priors, const LineShape& shape,
                      ShapeEquations* equations);

struct ShapedLine {
  EventLine record;
  LineShape shape;
  std::size_t num_samples = 0;  ///< written
};

/// Fits the shape to the line's events, its own and free ones.
/// @param priors   of what a fitted line has too
/// @param shared   events there are left out
/// @param samples  room for what stands for the events in a later fit: their means over stretches of the line and of
///                 time, each with its sigma; may be empty
ShapedLine shape_line(const EventCloud& cloud, const LineShapeOptions& options, const LinePriors& priors,
                      const LineWorkspace& workspace, const MovingLine& line, const SharedStretches& shared,
                      Span<LineSample> samples);

}  // namespace lecalib
