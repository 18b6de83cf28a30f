// SPDX-License-Identifier: MIT
/// First guesses of moving lines from sums over grid cells, without neighbours or normals: one visit per event.
///
/// In a block of 2 x 2 cells, x and y are regressed on time; the covariance of what is left is that of the edge at
/// rest. Its smaller eigenvalue is the edge's thickness squared, its larger one the spread along the edge, and both
/// come from a 2 x 2 problem in closed form. That is the plane of [Liu24] eq. 1, exact for noise in x and y alone, and
/// needs no c_z.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/segments/moving_line.hpp"

namespace lecalib {

struct SeedOptions {
  std::uint32_t min_events = 10;     ///< of a block, >= 4
  float min_score = 6;               ///< elongation times sqrt(events), see CellSeed::score
  float max_variance_px2 = 2;        ///< of the events' distance from the edge: more is texture
  float min_elongation = 4;          ///< variance along the edge over that across it
  float min_share = 0.25F;           ///< of the block's free events that must lie on the edge, 0 to 1
  float min_over_background = 1.5F;  ///< events on the edge over those that its area should hold by chance
};

/// A block that looks like an edge.
struct CellSeed {
  float score;          ///< (variance along - across) / (across + 1/4 px^2) * sqrt(events)
  std::uint32_t block;  ///< its upper left cell, plus the number of cells if ON
};

/// Sums over the events of a cell: coordinates from the cell's centre, tau from -1 to 1.
struct CellMoments {
  float n, x, y, t, xx, xy, yy, xt, yt, tt;
};

struct SeedCapacities {
  std::size_t seeds = 4096;
  std::uint16_t width = 0, height = 0;
};

struct SeedWorkspace {
  Span<CellSeed> seeds;
  // Rows are done with before the first growth fails: they share their bytes with the marks.
  Span<CellMoments> rows;       ///< two rows of cells
  Span<std::uint8_t> failures;  ///< [(2 * cells + 7) / 8] bits: growths that failed there
};

template <class Carver>
constexpr bool carve(Carver& carver, const SeedCapacities& capacities, SeedWorkspace* out) {
  const std::size_t columns = (std::size_t{capacities.width} + kCloudCellPx - 1) >> kCloudCellShift;
  if (!carver.carve(capacities.seeds, &out->seeds)) return false;
  const std::size_t shared = carver.mark();
  if (!carver.carve(2 * columns, &out->rows)) return false;
  const std::size_t rows_end = carver.mark();
  carver.rewind(shared);
  if (!carver.carve((2 * cloud_cells(capacities.width, capacities.height) + 7) / 8, &out->failures)) return false;
  // Whoever carves next must come after the longer part.
  Span<std::byte> rest;
  return rows_end <= carver.mark() || carver.carve(rows_end - carver.mark(), &rest);
}

/// Finds the blocks that look like edges.
/// @return how many stand in workspace.seeds, best first
/// @param[out] dropped seeds beyond the capacity, the worst ones
std::size_t rank_seeds(const EventCloud& cloud, const SeedOptions& options, const SeedWorkspace& workspace,
                       std::uint32_t* dropped);

/// The moving line in a seed's block, from the events there that no line has taken yet.
/// @param owner [events] as in LineWorkspace
/// @return false, *out unchanged, when what is free there is no edge
bool refine_seed(const EventCloud& cloud, const SeedOptions& options, const CellSeed& seed,
                 Span<const std::uint8_t> owner, MovingLine* out);

/// Growths that failed leave a mark on the block's cells; seeds in marked cells are not worth another try.
bool has_failed(const EventCloud& cloud, const SeedWorkspace& workspace, const CellSeed& seed);
void mark_failed(const EventCloud& cloud, const SeedWorkspace& workspace, const CellSeed& seed);

}  // namespace lecalib
