// SPDX-License-Identifier: MIT
/// The geometric records of one window: its events as points in (x, y, t / c_z), and planes in that space.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/span.hpp"

namespace lecalib {

/// A point of space-time, px: image coordinates and depth z = (t - window begin) / c_z.
struct Point3 {
  float x, y, z;
};

/// Side of the square cells that order an EventCloud, px. Smaller ones hold too few events to be worth a visit, larger
/// ones make every search read events that it throws away.
inline constexpr int kCloudCellShift = 3;
inline constexpr int kCloudCellPx = 1 << kCloudCellShift;

/// Cells of the grid over a sensor.
constexpr std::size_t cloud_cells(std::uint16_t width, std::uint16_t height) noexcept {
  constexpr int kRoundUp = kCloudCellPx - 1;
  return static_cast<std::size_t>((width + kRoundUp) >> kCloudCellShift) *
         static_cast<std::size_t>((height + kRoundUp) >> kCloudCellShift);
}

/// A window's length in units of EventCloud::t. Lines travel some 5 px in a window: one unit is 1e-4 px.
inline constexpr int kCloudTicks = 65535;

/// A window's events as points, ordered by polarity (OFF first), then by grid cell (row-major), then by time.
struct EventCloud {
  Span<const std::uint16_t> x, y;        ///< px
  Span<const std::uint16_t> t;           ///< time since the window's begin, in kCloudTicks to the window
  Span<const std::uint32_t> cell_start;  ///< [2 * cols * rows + 1] first event of each cell; the last entry is the size
  std::uint16_t width = 0, height = 0;   ///< of the sensor, px
  std::uint16_t cols = 0, rows = 0;      ///< of the grid
  float depth_px = 0;                    ///< z at the window's end, > 0
  float kept_share = 1;                  ///< of the window's events: below 1 when it was thinned
  float noise_floor[2] = {0, 0};         ///< events per px^2 by chance (no whole number per cell), by polarity

  [[nodiscard]] Point3 point(std::size_t event) const noexcept {
    return {static_cast<float>(x[event]), static_cast<float>(y[event]), z(event)};
  }
  /// Depth, see Point3.
  [[nodiscard]] float z(std::size_t event) const noexcept {
    return static_cast<float>(t[event]) * (depth_px * (1.0F / kCloudTicks));
  }
  /// Time from -1 at the window's begin to 1 at its end.
  [[nodiscard]] float tau(std::size_t event) const noexcept { return tau_of(t[event]); }
  [[nodiscard]] static float tau_of(std::uint16_t ticks) noexcept {
    return static_cast<float>(ticks) * (2.0F / kCloudTicks) - 1.0F;
  }
  [[nodiscard]] std::size_t size() const noexcept { return x.size(); }
  [[nodiscard]] std::size_t cells() const noexcept { return static_cast<std::size_t>(cols) * rows; }
  /// The noise floor of a set of polarities (bit 0: OFF, bit 1: ON), events per px^2.
  [[nodiscard]] float noise_in(unsigned polarities) const noexcept {
    return ((polarities & 1U) != 0 ? noise_floor[0] : 0.0F) + ((polarities & 2U) != 0 ? noise_floor[1] : 0.0F);
  }
  [[nodiscard]] bool is_on(std::size_t event) const noexcept { return event >= cell_start[cells()]; }
};

/// A plane swept by a moving edge. Its points are [first, first + count) of the array that comes with it.
struct EventPlane {
  Point3 centre;
  Point3 normal;        ///< unit, (nx, ny) points to the right of or straight down in the image
  float thickness_px;   ///< rms distance of its points
  std::uint32_t first;  ///< its points' place
  std::uint32_t count;
  std::uint8_t polarity;  ///< 1 ON, 0 OFF
};

}  // namespace lecalib
