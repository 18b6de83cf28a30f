// SPDX-License-Identifier: MIT
/// Neighbours of a point among the events of one polarity, by the cloud's own grid ([Liu24] section 3.1: KNN).
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/core/span.hpp"

namespace lecalib {

struct Neighbour {
  float distance2;      ///< px^2, in (x, y, z)
  std::uint32_t index;  ///< into the cloud
};

/// The k = out.size() events nearest to `query` and not farther than max_radius_px, exactly: rings of cells are read
/// until no cell left can hold a nearer one. The query itself, if it is an event, is its own nearest neighbour.
/// @param polarity  0 or 1: which events to search
/// @param[out] out  sorted by distance; of several at the same distance any may be kept
/// @return how many were found, at most out.size()
/// Complexity O(events in the cells read * k) at worst, about O(events read + k^2) on even data.
std::size_t find_nearest(const EventCloud& cloud, int polarity, const Point3& query, float max_radius_px,
                         Span<Neighbour> out);

/// Events within radius_px of `query`, evenly thinned where cells are crowded: of the events in the cells that the ball
/// touches about every n-th is looked at, so that at most `out.size()` are, however dense the data.
/// @param[out] out     indices into the cloud, in its order
/// @param[out] stride  n; 1 when nothing was thinned
/// @return how many were found, at most out.size()
std::size_t find_within(const EventCloud& cloud, int polarity, const Point3& query, float radius_px,
                        Span<std::uint32_t> out, std::uint32_t* stride);

struct NeighbourhoodOptions {
  /// The radius' floor, px, > 0. With k neighbours alone a dense window's neighbourhoods shrink to where the pixel grid
  /// and the noise decide the normal.
  float min_radius_px = 6;
  float max_radius_px = 12;      ///< px, >= min_radius_px: farther events say nothing about a point's surface
  std::uint32_t min_count = 16;  ///< k: where the floor holds fewer, the k nearest within max_radius_px are taken
};

/// What a neighbourhood's events stand for.
struct Neighbourhood {
  std::size_t count = 0;     ///< events found
  float radius_px = 0;       ///< within which they lie
  std::uint32_t stride = 1;  ///< each stands for so many
};

/// The neighbourhood of a point: all events within the floor radius, evenly thinned to out.size(), or the k nearest
/// where those are fewer than k.
/// @param scratch  [>= min_count]
/// @param[out] out  indices into the cloud, at most out.size()
Neighbourhood find_neighbourhood(const EventCloud& cloud, int polarity, const Point3& query,
                                 const NeighbourhoodOptions& options, Span<Neighbour> scratch, Span<std::uint32_t> out);

}  // namespace lecalib
