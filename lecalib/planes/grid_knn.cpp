// SPDX-License-Identifier: MIT
#include "lecalib/planes/grid_knn.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

/// Inclusive range of cells; empty when first > last.
struct CellRange {
  int first_col, last_col, first_row, last_row;
};

int clamp_cell(float px, int count) {
  const int cell = static_cast<int>(px) >> kCloudCellShift;
  return px < 0 ? 0 : std::min(cell, count - 1);
}

CellRange cells_around(const EventCloud& cloud, const Point3& query, float radius_px) {
  return {clamp_cell(query.x - radius_px, cloud.cols), clamp_cell(query.x + radius_px, cloud.cols),
          clamp_cell(query.y - radius_px, cloud.rows), clamp_cell(query.y + radius_px, cloud.rows)};
}

float distance2(const EventCloud& cloud, std::uint32_t i, const Point3& query) {
  const float dx = static_cast<float>(cloud.x[i]) - query.x;
  const float dy = static_cast<float>(cloud.y[i]) - query.y;
  const float dz = cloud.z(i) - query.z;
  return dx * dx + dy * dy + dz * dz;
}

/// The k best so far, sorted, in the caller's storage.
class NearestList {
 public:
  NearestList(Span<Neighbour> storage, float max_distance2) : storage_(storage), worst_(max_distance2) {}

  void offer(float d2, std::uint32_t index) {
    if (d2 > worst_ || (count_ == storage_.size() && d2 >= worst_)) return;
    std::size_t place = count_ < storage_.size() ? count_++ : count_ - 1;
    while (place > 0 && storage_[place - 1].distance2 > d2) {
      storage_[place] = storage_[place - 1];
      --place;
    }
    storage_[place] = {d2, index};
    if (count_ == storage_.size()) worst_ = storage_[count_ - 1].distance2;
  }
  [[nodiscard]] std::size_t count() const { return count_; }
  /// No event farther than this can enter the list any more.
  [[nodiscard]] float worst() const { return worst_; }

 private:
  Span<Neighbour> storage_;
  std::size_t count_ = 0;
  float worst_;
};

class RingSearch {
 public:
  RingSearch(const EventCloud& cloud, int polarity, const Point3& query, NearestList* list)
      : cloud_(cloud), first_cell_(polarity != 0 ? cloud.cells() : 0), query_(query), list_(list) {}

  /// Reads the cells at Chebyshev distance `ring` of the query's cell, inside of `range`.
  void read_ring(int col, int row, int ring, const CellRange& range) {
    const int top = std::max(row - ring, range.first_row);
    const int bottom = std::min(row + ring, range.last_row);
    for (int r = top; r <= bottom; ++r) {
      if (r == row - ring || r == row + ring) {
        read_row(r, std::max(col - ring, range.first_col), std::min(col + ring, range.last_col));
        continue;
      }
      if (col - ring >= range.first_col) read_row(r, col - ring, col - ring);
      if (col + ring <= range.last_col) read_row(r, col + ring, col + ring);
    }
  }

 private:
  void read_row(int row, int first_col, int last_col) {
    if (first_col > last_col) return;
    const std::size_t base = first_cell_ + static_cast<std::size_t>(row) * cloud_.cols;
    const std::uint32_t end = cloud_.cell_start[base + static_cast<std::size_t>(last_col) + 1];
    for (std::uint32_t i = cloud_.cell_start[base + static_cast<std::size_t>(first_col)]; i < end; ++i) {
      list_->offer(distance2(cloud_, i, query_), i);
    }
  }

  const EventCloud& cloud_;
  std::size_t first_cell_;
  Point3 query_;
  NearestList* list_;
};

/// Distance from the query to the nearest point outside of the square of cells with the given ring.
float distance_beyond(const Point3& query, int col, int row, int ring) {
  // Event coordinates are integers, so the cell [c * 8, c * 8 + 8) ends before c * 8 + 8.
  const auto left = static_cast<float>((col - ring) * kCloudCellPx);
  const auto right = static_cast<float>((col + ring + 1) * kCloudCellPx);
  const auto top = static_cast<float>((row - ring) * kCloudCellPx);
  const auto bottom = static_cast<float>((row + ring + 1) * kCloudCellPx);
  const float x = std::min(query.x - left, right - query.x);
  const float y = std::min(query.y - top, bottom - query.y);
  return std::max(0.0F, std::min(x, y));
}

}  // namespace

std::size_t find_nearest(const EventCloud& cloud, int polarity, const Point3& query, float max_radius_px,
                         Span<Neighbour> out) {
  if (out.empty() || cloud.size() == 0) return 0;
  NearestList list(out, max_radius_px * max_radius_px);
  RingSearch search(cloud, polarity, query, &list);
  const CellRange range = cells_around(cloud, query, max_radius_px);
  const int col = clamp_cell(query.x, cloud.cols);
  const int row = clamp_cell(query.y, cloud.rows);
  const int last_ring = std::max(std::max(col - range.first_col, range.last_col - col),
                                 std::max(row - range.first_row, range.last_row - row));
  for (int ring = 0; ring <= last_ring; ++ring) {
    search.read_ring(col, row, ring, range);
    const float beyond = distance_beyond(query, col, row, ring);
    if (list.count() == out.size() && beyond * beyond >= list.worst()) break;
  }
  return list.count();
}

std::size_t find_within(const EventCloud& cloud, int polarity, const Point3& query, float radius_px,
                        Span<std::uint32_t> out, std::uint32_t* stride) {
  *stride = 1;
  if (out.empty() || cloud.size() == 0) return 0;
  const CellRange range = cells_around(cloud, query, radius_px);
  const std::size_t first_cell = polarity != 0 ? cloud.cells() : 0;
  const auto row_events = [&](int row, std::uint32_t* begin, std::uint32_t* end) {
    const std::size_t base = first_cell + static_cast<std::size_t>(row) * cloud.cols;
    *begin = cloud.cell_start[base + static_cast<std::size_t>(range.first_col)];
    *end = cloud.cell_start[base + static_cast<std::size_t>(range.last_col) + 1];
  };
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
  std::size_t candidates = 0;
  for (int row = range.first_row; row <= range.last_row; ++row) {
    row_events(row, &begin, &end);
    candidates += end - begin;
  }
  *stride = static_cast<std::uint32_t>(candidates / out.size() + 1);  // so that no more are looked at than out holds
  const float radius2 = radius_px * radius_px;
  std::size_t count = 0;
  std::uint32_t phase = 0;
  for (int row = range.first_row; row <= range.last_row; ++row) {
    row_events(row, &begin, &end);
    std::uint32_t i = begin + phase;
    for (; i < end; i += *stride) {
      if (distance2(cloud, i, query) <= radius2) out[count++] = i;
    }
    phase = i - end;
  }
  return count;
}

Neighbourhood find_neighbourhood(const EventCloud& cloud, int polarity, const Point3& query,
                                 const NeighbourhoodOptions& options, Span<Neighbour> scratch,
                                 Span<std::uint32_t> out) {
  Neighbourhood result;
  result.radius_px = options.min_radius_px;
  result.count = find_within(cloud, polarity, query, options.min_radius_px, out, &result.stride);
  if (result.count >= options.min_count || result.stride > 1) return result;
  const Span<Neighbour> nearest = scratch.first(std::min(std::size_t{options.min_count}, out.size()));
  result.count = find_nearest(cloud, polarity, query, options.max_radius_px, nearest);
  for (std::size_t i = 0; i < result.count; ++i) out[i] = nearest[i].index;
  if (result.count == 0) return result;
  result.radius_px =
      result.count == nearest.size() ? std::sqrt(nearest[result.count - 1].distance2) : options.max_radius_px;
  return result;
}

}  // namespace lecalib
