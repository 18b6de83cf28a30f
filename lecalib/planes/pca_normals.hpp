// SPDX-License-Identifier: MIT
/// The surface's normal at events of a cloud, from the covariance of their neighbours ([Liu24] section 3.1, eq. 1).
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/planes/grid_knn.hpp"

namespace lecalib {

struct NormalOptions {
  NeighbourhoodOptions neighbourhood;
  /// Fewest neighbours on the surface, >= 3. Fewer are background activity.
  std::uint32_t min_support = 8;
  /// Smallest share of the neighbours on the surface, 0 to 1: noise has neighbours all around.
  float min_support_share = 0.5F;
  /// Support in units of what the noise floor lets expect in the same volume; less is background activity.
  float min_over_noise = 3;
  float max_thickness_px = 1.4F;  ///< rms distance of the surface's events, px, > 0
  /// Largest ratio of the smallest to the middle variance, 0 to 1; at 1 the neighbours fill a ball.
  float max_flatness = 0.35F;
  /// Largest |normal_z|, 0 to 1. A surface of constant time is no moving edge but a flash, or noise in a short window.
  float max_normal_z = 0.97F;
  float max_offset_px = 2.0F;  ///< px, > 0: an event farther from its neighbours' surface does not belong to it
};

/// An event moved onto the surface that its neighbours make.
struct SurfacePoint {
  Point3 position;
  Point3 normal;       ///< unit, see PlaneFit
  float variance;      ///< of the neighbours across the surface, px^2
  std::uint32_t cell;  ///< of the cloud, ON cells after all OFF cells
};

struct NormalStats {
  std::uint32_t queries = 0;   ///< events whose neighbourhood was looked at
  std::uint32_t skipped = 0;   ///< events passed over evenly, because there are more than the capacity
  std::uint32_t isolated = 0;  ///< too few neighbours
  std::uint32_t not_flat = 0;  ///< neighbours that make no moving surface
};

/// Most neighbours that a normal is taken from; enough that its direction is limited by the surface, not by counting.
inline constexpr std::size_t kMaxNeighbours = 96;

/// Finds the normals of at most out.size() events, evenly spread over the cloud. Each is a total least squares plane of
/// the neighbourhood, refined twice on the neighbours near to it, so that a second edge close by does not tilt it.
/// @param[out] out    in the order of the cloud's cells
/// @param[out] count  how many events have a normal
/// @param[out] stats  may be null
/// @return ok | invalid_argument (options out of range, min_count above kMaxNeighbours) | buffer_too_small (out empty)
/// Complexity O(queries * kMaxNeighbours). Allocates nothing.
Status estimate_normals(const EventCloud& cloud, const NormalOptions& options, Span<SurfacePoint> out,
                        std::size_t* count, NormalStats* stats);

}  // namespace lecalib
