// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "lecalib/core/records.hpp"

namespace lecalib {

/// Along a line, model coordinates are px times this, so that the normal equations' entries are of one magnitude.
inline constexpr float kAlongUnit = 1.0F / 64.0F;

/// Number of coefficients of a MovingLine.
inline constexpr int kNumLineCoefficients = 5;

/// An image line that moves, turns and bends during a window. In the frame of a fixed origin and direction, a point at
/// s along the line lies at d across it, at the time tau = -1 (the window's begin) to +1 (its end):
///     d(s, tau) = m0 + m1 s + m2 tau + m3 s tau + m4 s^2     (d in px, s in units of 64 px)
/// The surface is a helicoid where a plane would be m3 = m4 = 0: m3 is the turn, m4 the bend that distortion makes.
struct MovingLine {
  float cx = 0, cy = 0;  ///< origin, px
  float ux = 1, uy = 0;  ///< unit direction; the normal, along which d counts, is (-uy, ux)
  float m[kNumLineCoefficients] = {};
  float low[2] = {0, 0};  ///< its ends along the direction, px, at the window's begin and end
  float high[2] = {0, 0};
  float thickness_px = 1;     ///< one sigma of the events' distance
  float covariance[15] = {};  ///< of m: upper triangle by rows
  std::uint32_t events = 0;
  std::uint8_t polarities = 0;  ///< bit 0: OFF, bit 1: ON
  std::uint8_t id = 0;          ///< owner of its events, see LineWorkspace
  bool has_gap = false;         ///< where nothing fires, see EdgeRow

  /// d at s px along the line.
  [[nodiscard]] float offset(float s_px, float tau) const noexcept {
    const float s = s_px * kAlongUnit;
    return m[0] + s * (m[1] + s * m[4]) + tau * (m[2] + s * m[3]);
  }
  [[nodiscard]] float x(float s_px, float d) const noexcept { return cx + s_px * ux - d * uy; }
  [[nodiscard]] float y(float s_px, float d) const noexcept { return cy + s_px * uy + d * ux; }
  [[nodiscard]] float along(float px, float py) const noexcept { return (px - cx) * ux + (py - cy) * uy; }
  [[nodiscard]] float across(float px, float py) const noexcept { return (py - cy) * ux - (px - cx) * uy; }
  [[nodiscard]] float length() const noexcept { return 0.5F * (high[0] - low[0] + high[1] - low[1]); }
  [[nodiscard]] float lowest() const noexcept { return low[0] < low[1] ? low[0] : low[1]; }
  [[nodiscard]] float highest() const noexcept { return high[0] > high[1] ? high[0] : high[1]; }
};

/// Variance of d at (s, tau), px^2, from the covariance.
float offset_variance(const MovingLine& line, float s_px, float tau);

/// Puts the origin on the line's middle at mid window and the direction along it there: m0 = m1 = 0. The covariance is
/// not carried over.
void recentre(MovingLine* line);

/// The line through two segments, one at each end of the window; their first points belong together.
/// @return false when a segment is shorter than 1 px or they point apart by more than 60 degrees
bool line_between(const Segment& begin, const Segment& end, MovingLine* out);

}  // namespace lecalib
