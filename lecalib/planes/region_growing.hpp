// SPDX-License-Identifier: MIT
/// Region growing and merging ([Liu24] section 3.1): surface points become planes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/planes/pca_normals.hpp"
#include "lecalib/planes/plane_moments.hpp"

namespace lecalib {

struct RegionOptions {
  float reach_px = 8;  ///< largest step from point to point, px, > 0; more than a cell's side counts as one side
  float max_distance_px = 1.5F;  ///< of a point from the region's plane, px, > 0
  float min_cosine = 0.94F;      ///< of the angle between a point's normal and the region's, 0 to 1 (0.94: 20 degrees)
  std::uint32_t min_points = 8;  ///< fewer make no plane, >= 3
  float merge_cosine = 0.985F;   ///< of the angle between the normals of two parts of one plane (0.985: 10 degrees)
  float merge_distance_px = 1.0F;  ///< of each part's centre from the other's plane, px
  float merge_gap_px = 16;         ///< between the parts' bounding boxes in the image, px
};

struct RegionStats {
  std::uint32_t planes = 0;     ///< found, after merging
  std::uint32_t merged = 0;     ///< parts that were joined to another
  std::uint32_t too_small = 0;  ///< regions given up for their few points
  std::uint32_t dropped = 0;    ///< planes that found no room in the output or the workspace
};

/// A plane while it grows.
struct Region {
  PlaneMoments moments;  ///< relative to origin
  Point3 origin{};       ///< the seed
  Point3 centre{};       ///< of the plane as last fitted
  Point3 normal{};
  float variance = 0;
  float min_x = 0, max_x = 0, min_y = 0, max_y = 0;
  std::uint32_t first = 0, count = 0;  ///< members
  std::uint32_t parent = 0;            ///< region that it was merged into, or itself
  std::uint8_t polarity = 0;
};

struct RegionCapacities {
  std::size_t points = 0;
  std::size_t regions = 0;
  std::uint16_t width = 0, height = 0;
};

struct RegionWorkspace {
  Span<std::uint32_t> order;       ///< [points] seeds, flattest first
  Span<std::uint32_t> members;     ///< [points] of the regions, one after the other; the growing region's are its queue
  Span<std::uint8_t> taken;        ///< [points]
  Span<std::uint32_t> cell_start;  ///< [2 * cells + 1]
  Span<Region> regions;            ///< [regions]
};

template <class Carver>
constexpr bool carve(Carver& carver, const RegionCapacities& capacities, RegionWorkspace* out) {
  const std::size_t cells = capacities.points > 0 ? 2 * cloud_cells(capacities.width, capacities.height) + 1 : 0;
  return carver.carve(capacities.points, &out->order) && carver.carve(capacities.points, &out->members) &&
         carver.carve(capacities.points, &out->taken) && carver.carve(cells, &out->cell_start) &&
         carver.carve(capacities.regions, &out->regions);
}

/// Grows regions from the flattest points on. A point joins when it is near to a point of the region, near to the
/// region's own plane, and its normal is near to that plane's normal: where lines cross, normals are mixtures and wait
/// for no region, while the plane carries the growth across. The plane is fitted anew whenever the region has grown by
/// a quarter. Polarities never mix. Parts of one plane are then merged.
/// @param points             in the order of the cloud's cells, as from estimate_normals
/// @param[out] planes        most points first
/// @param[out] plane_points  [>= points.size()] the planes' points, see EventPlane::first
/// @return ok, too when planes were dropped (counted) | invalid_argument | buffer_too_small
/// Complexity O(points * points near) + O(regions^2). Allocates nothing.
Status grow_planes(const EventCloud& cloud, Span<const SurfacePoint> points, const RegionOptions& options,
                   const RegionWorkspace& workspace, Span<EventPlane> planes, Span<Point3> plane_points,
                   std::size_t* count, RegionStats* stats);

}  // namespace lecalib
