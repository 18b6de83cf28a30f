// SPDX-License-Identifier: MIT
/// A small line segment detector after LSD's idea (Grompone von Gioi et al. 2010: regions of equal level-line angle,
/// rectangles about them) on the density of points in a plane: it finds where the points' area begins and ends.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/span.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/segments/plane_projection.hpp"

namespace lecalib {

struct SegmentOptions {
  float min_cell_px = 2;           ///< side of an occupancy cell, px, > 0 ...
  float max_cell_px = 6;           ///< ... it is chosen so that
  float points_per_cell = 2;       ///< a cell of the occupied area holds so many points on average, > 0
  float min_gradient = 0.2F;       ///< of the density's mean over the occupied area, per cell: less is flat
  float min_cosine = 0.85F;        ///< of the angle between a cell's gradient and its region's (0.85: 32 degrees)
  float min_length_px = 12;        ///< px: shorter segments are left out
  float min_aligned_share = 0.4F;  ///< of the rectangle's area that its region covers: less is no straight rim, 0 to 1
};

/// A straight rim of the points' area, in plane coordinates.
struct PlaneSegment {
  PlanePoint a, b;
  float width_px;            ///< of the rectangle across the segment
  float normal_x, normal_y;  ///< unit, towards the points' side
};

struct SegmentStats {
  std::uint32_t segments = 0;
  std::uint32_t too_short = 0;
  std::uint32_t not_straight = 0;
  std::uint32_t dropped = 0;  ///< found no room in the output
};

/// One cell of the density image.
struct DensityCell {
  float density;
  float gradient_x, gradient_y;
};

struct SegmentCapacities {
  std::size_t cells = 8192;  ///< of the density image; larger areas get larger cells
};

struct SegmentWorkspace {
  Span<DensityCell> image;    ///< [cells]
  Span<float> counts;         ///< [cells] points in each cell
  Span<std::uint16_t> order;  ///< [cells] cells by gradient, largest first
  Span<std::uint16_t> queue;  ///< [cells] members of the growing region
  Span<std::uint8_t> taken;   ///< [cells]
};

template <class Carver>
constexpr bool carve(Carver& carver, const SegmentCapacities& capacities, SegmentWorkspace* out) {
  return carver.carve(capacities.cells, &out->image) && carver.carve(capacities.cells, &out->counts) &&
         carver.carve(capacities.cells, &out->order) && carver.carve(capacities.cells, &out->queue) &&
         carver.carve(capacities.cells, &out->taken);
}

/// @param points  at least one
/// @param[out] out, count  the segments
/// @param stats   added to; may be null
/// @return ok | invalid_argument (no points, options out of range, more than 65535 cells) |
///         buffer_too_small (fewer than 64 cells)
Status find_plane_segments(Span<const PlanePoint> points, const SegmentOptions& options,
                           const SegmentWorkspace& workspace, Span<PlaneSegment> out, std::size_t* count,
                           SegmentStats* stats);

}  // namespace lecalib
