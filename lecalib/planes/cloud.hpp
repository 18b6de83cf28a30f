// SPDX-License-Identifier: MIT
/// Pre-processing of [Liu24] section 3.1: a window's events become the point cloud (x, y, t / c_z), in grid order.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/core/records.hpp"
#include "lecalib/core/status.hpp"

namespace lecalib {

/// Widest and highest sensor, px.
inline constexpr std::uint16_t kMaxSensorSide = 4096;

struct CloudOptions {
  std::uint16_t width = 0, height = 0;  ///< of the sensor, px, 1 to kMaxSensorSide
  /// c_z, microseconds per px of depth, > 0; 0: automatic, so that the window is auto_depth_px deep. [Liu24] uses 5000.
  float c_z_us_per_px = 0;
  /// Depth of the window under automatic c_z, px, > 0. An edge that travels as many px stands at 45 degrees.
  float auto_depth_px = 8;
};

struct CloudCapacities {
  std::size_t events = 0;
  std::uint16_t width = 0, height = 0;
};

struct CloudStats {
  std::uint32_t events = 0;          ///< in the window
  std::uint32_t outside_sensor = 0;  ///< dropped: coordinates that the sensor does not have
  std::uint32_t thinned = 0;         ///< dropped evenly, because the window holds more than the capacity
};

struct CloudWorkspace {
  Span<std::uint16_t> x, y, t;     ///< [events]
  Span<std::uint32_t> cell_start;  ///< [2 * cells + 1]
};

template <class Carver>
constexpr bool carve(Carver& carver, const CloudCapacities& capacities, CloudWorkspace* out) {
  return carver.carve(capacities.events, &out->x) && carver.carve(capacities.events, &out->y) &&
         carver.carve(capacities.events, &out->t) &&
         carver.carve(2 * cloud_cells(capacities.width, capacities.height) + 1, &out->cell_start);
}

/// Sorts the window's events into the grid by a stable counting sort, two passes; a third where it is thinned.
/// Events that precede the window (the sensor's own disorder) are put at its begin.
/// @param[out] cloud  views into the workspace; unchanged unless ok
/// @param[out] stats  always written; may be null
/// @return ok (also without events) | invalid_argument (size, c_z, depth, an empty window) | buffer_too_small (the
/// workspace's grid is smaller than the sensor needs, or it holds no event)
Status build_cloud(const EventWindow& window, const CloudOptions& options, const CloudWorkspace& workspace,
                   EventCloud* cloud, CloudStats* stats);

}  // namespace lecalib
