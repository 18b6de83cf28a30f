// SPDX-License-Identifier: MIT
/// Points come ordered by cell, so a table of each cell's first point finds the neighbours of a point. The regions'
/// members stand one after the other in one array; the part that belongs to the growing region is the queue of points
/// whose neighbours are still to be read, so nothing recurses and a region given up is undone by moving its end back.
#include "lecalib/planes/region_growing.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

constexpr std::size_t kVarianceBins = 64;
/// From so many points on the region's own plane replaces its seed's.
constexpr float kMinPointsForPlane = 6;
constexpr float kRefitGrowth = 1.25F;

float dot(const Point3& a, const Point3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Point3 minus(const Point3& a, const Point3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

/// Distance from the plane through `centre`.
float plane_distance(const Point3& p, const Point3& centre, const Point3& normal) {
  return std::fabs(dot(minus(p, centre), normal));
}

void index_cells(Span<const SurfacePoint> points, Span<std::uint32_t> cell_start) {
  std::size_t i = 0;
  for (std::size_t cell = 0; cell < cell_start.size(); ++cell) {
    while (i < points.size() && points[i].cell < cell) ++i;
    cell_start[cell] = static_cast<std::uint32_t>(i);
  }
}

/// Indices of the points, flattest first: a counting sort over the variance in steps of 1/64 of its largest value.
void order_by_variance(Span<const SurfacePoint> points, Span<std::uint32_t> order) {
  float largest = 0;
  for (const SurfacePoint& p : points) largest = std::max(largest, p.variance);
  const float scale = largest > 0 ? static_cast<float>(kVarianceBins - 1) / largest : 0;
  std::uint32_t start[kVarianceBins + 1] = {};
  for (const SurfacePoint& p : points) ++start[static_cast<std::size_t>(p.variance * scale) + 1];
  for (std::size_t b = 0; b < kVarianceBins; ++b) start[b + 1] += start[b];
  for (std::size_t i = 0; i < points.size(); ++i) {
    order[start[static_cast<std::size_t>(points[i].variance * scale)]++] = static_cast<std::uint32_t>(i);
  }
}

class Grower {
 public:
  Grower(const EventCloud& cloud, Span<const SurfacePoint> points, const RegionOptions& options,
         const RegionWorkspace& workspace)
      : cloud_(cloud), points_(points), options_(options), ws_(workspace) {}

  /// Grows one region from a free point; its members follow at ws.members[first].
  Region grow(std::uint32_t seed, std::uint32_t first) {
    const SurfacePoint& point = points_[seed];
    Region region;
    region.origin = region.centre = point.position;
    region.normal = point.normal;
    region.variance = point.variance;
    region.min_x = region.max_x = point.position.x;
    region.min_y = region.max_y = point.position.y;
    region.first = first;
    region.polarity = point.cell >= cloud_.cells() ? 1 : 0;
    next_fit_ = kMinPointsForPlane;
    add(seed, &region);
    for (std::uint32_t head = first; head < first + region.count; ++head) visit_neighbours(ws_.members[head], &region);
    fit(&region);
    return region;
  }

  void undo(const Region& region) {
    for (std::uint32_t i = region.first; i < region.first + region.count; ++i) ws_.taken[ws_.members[i]] = 0;
  }

 private:
  void add(std::uint32_t index, Region* region) {
    ws_.taken[index] = 1;
    ws_.members[region->first + region->count++] = index;
    const Point3& p = points_[index].position;
    const Point3 relative = minus(p, region->origin);
    region->moments.add(relative.x, relative.y, relative.z);
    region->min_x = std::min(region->min_x, p.x);
    region->max_x = std::max(region->max_x, p.x);
    region->min_y = std::min(region->min_y, p.y);
    region->max_y = std::max(region->max_y, p.y);
    if (region->moments.n < next_fit_) return;
    next_fit_ = region->moments.n * kRefitGrowth;
    fit(region);
  }

  static void fit(Region* region) {
    PlaneFit plane{};
    if (region->moments.n < kMinPointsForPlane || !fit_plane(region->moments, &plane)) return;
    region->centre = {region->origin.x + plane.centre.x, region->origin.y + plane.centre.y,
                      region->origin.z + plane.centre.z};
    region->normal = plane.normal;
    region->variance = plane.variance[0];
  }

  void visit_neighbours(std::uint32_t index, Region* region) {
    const Point3 from = points_[index].position;
    const std::size_t base = region->polarity != 0 ? cloud_.cells() : 0;
    const auto cell = static_cast<int>(points_[index].cell - base);
    const int row = cell / cloud_.cols;
    const int col = cell % cloud_.cols;
    const int last_row = std::min(row + 1, cloud_.rows - 1);
    const int first_col = std::max(col - 1, 0);
    const int last_col = std::min(col + 1, cloud_.cols - 1);
    for (int r = std::max(row - 1, 0); r <= last_row; ++r) {
      const std::size_t row_base = base + static_cast<std::size_t>(r) * cloud_.cols;
      const std::uint32_t end = ws_.cell_start[row_base + static_cast<std::size_t>(last_col) + 1];
      for (std::uint32_t i = ws_.cell_start[row_base + static_cast<std::size_t>(first_col)]; i < end; ++i) {
        if (ws_.taken[i] == 0 && belongs(points_[i], from, *region)) add(i, region);
      }
    }
  }

  [[nodiscard]] bool belongs(const SurfacePoint& point, const Point3& from, const Region& region) const {
    if (std::fabs(dot(point.normal, region.normal)) < options_.min_cosine) return false;
    if (plane_distance(point.position, region.centre, region.normal) > options_.max_distance_px) return false;
    const Point3 step = minus(point.position, from);
    return dot(step, step) <= options_.reach_px * options_.reach_px;
  }

  const EventCloud& cloud_;
  Span<const SurfacePoint> points_;
  const RegionOptions& options_;
  const RegionWorkspace& ws_;
  float next_fit_ = 0;
};

bool are_parts_of_one_plane(const Region& a, const Region& b, const RegionOptions& o) {
  return a.polarity == b.polarity && a.min_x - b.max_x <= o.merge_gap_px && b.min_x - a.max_x <= o.merge_gap_px &&
         a.min_y - b.max_y <= o.merge_gap_px && b.min_y - a.max_y <= o.merge_gap_px &&
         std::fabs(dot(a.normal, b.normal)) >= o.merge_cosine &&
         plane_distance(b.centre, a.centre, a.normal) <= o.merge_distance_px &&
         plane_distance(a.centre, b.centre, b.normal) <= o.merge_distance_px;
}

std::uint32_t root_of(Span<const Region> regions, std::uint32_t r) {
  while (regions[r].parent != r) r = regions[r].parent;
  return r;
}

/// Joins each region to the largest one of its plane. @return how many were joined
std::uint32_t merge_regions(Span<Region> regions, const RegionOptions& options) {
  std::uint32_t merged = 0;
  for (std::uint32_t a = 0; a < regions.size(); ++a) {
    for (std::uint32_t b = a + 1; b < regions.size(); ++b) {
      if (!are_parts_of_one_plane(regions[a], regions[b], options)) continue;
      const std::uint32_t root_a = root_of(regions, a);
      const std::uint32_t root_b = root_of(regions, b);
      if (root_a == root_b) continue;
      const bool a_is_larger = regions[root_a].moments.n >= regions[root_b].moments.n;
      regions[a_is_larger ? root_b : root_a].parent = a_is_larger ? root_a : root_b;
      ++merged;
    }
  }
  return merged;
}

/// Writes the planes of the merged regions with their points.
std::size_t write_planes(Span<const Region> regions, Span<const std::uint32_t> members, Span<const SurfacePoint> points,
                         Span<EventPlane> planes, Span<Point3> plane_points, std::uint32_t* dropped) {
  std::size_t count = 0;
  std::uint32_t written = 0;
  for (std::uint32_t root = 0; root < regions.size(); ++root) {
    if (regions[root].parent != root) continue;
    if (count == planes.size()) {
      ++*dropped;
      continue;
    }
    const Point3 origin = regions[root].origin;
    PlaneMoments moments;
    const std::uint32_t first = written;
    for (std::uint32_t r = 0; r < regions.size(); ++r) {
      if (root_of(regions, r) != root) continue;
      for (const std::uint32_t i : members.subspan(regions[r].first, regions[r].count)) {
        const Point3 relative = minus(points[i].position, origin);
        moments.add(relative.x, relative.y, relative.z);
        plane_points[written++] = points[i].position;
      }
    }
    PlaneFit fit{};
    if (!fit_plane(moments, &fit)) continue;
    planes[count++] = {{origin.x + fit.centre.x, origin.y + fit.centre.y, origin.z + fit.centre.z},
                       fit.normal,
                       std::sqrt(fit.variance[0]),
                       first,
                       written - first,
                       regions[root].polarity};
  }
  return count;
}

bool valid(const RegionOptions& o) { return o.reach_px > 0 && o.max_distance_px > 0 && o.min_points >= 3; }

}  // namespace

Status grow_planes(const EventCloud& cloud, Span<const SurfacePoint> points, const RegionOptions& options,
                   const RegionWorkspace& workspace, Span<EventPlane> planes, Span<Point3> plane_points,
                   std::size_t* count, RegionStats* stats) {
  RegionStats unused;
  if (stats == nullptr) stats = &unused;
  *stats = {};
  if (!valid(options)) return Status::invalid_argument;
  const std::size_t table = 2 * cloud.cells() + 1;
  if (workspace.order.size() < points.size() || workspace.members.size() < points.size() ||
      workspace.taken.size() < points.size() || workspace.cell_start.size() < table ||
      plane_points.size() < points.size()) {
    return Status::buffer_too_small;
  }

  index_cells(points, workspace.cell_start.first(table));
  order_by_variance(points, workspace.order);
  std::fill(workspace.taken.begin(), workspace.taken.begin() + points.size(), std::uint8_t{0});
  Grower grower(cloud, points, options, workspace);
  std::uint32_t num_members = 0;
  std::uint32_t num_regions = 0;
  for (const std::uint32_t seed : workspace.order.first(points.size())) {
    if (workspace.taken[seed] != 0) continue;
    Region region = grower.grow(seed, num_members);
    if (region.count < options.min_points) {
      grower.undo(region);
      ++stats->too_small;
      continue;
    }
    if (num_regions == workspace.regions.size()) {
      ++stats->dropped;  // its points stay taken: grown again from another seed it would find no room either
      continue;
    }
    region.parent = num_regions;
    num_members += region.count;
    workspace.regions[num_regions++] = region;
  }

  const Span<Region> regions = workspace.regions.first(num_regions);
  stats->merged = merge_regions(regions, options);
  *count = write_planes(regions, workspace.members, points, planes, plane_points, &stats->dropped);
  stats->planes = static_cast<std::uint32_t>(*count);
  // Heap sort, as it needs neither memory nor recursion.
  const auto more_points = [](const EventPlane& a, const EventPlane& b) { return a.count > b.count; };
  std::make_heap(planes.begin(), planes.begin() + *count, more_points);
  std::sort_heap(planes.begin(), planes.begin() + *count, more_points);
  return Status::ok;
}

}  // namespace lecalib
