// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "lecalib/planes/region_growing.hpp"
#include "support/cloud_of.hpp"
#include "support/guarded_arena.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

struct Planes {
  explicit Planes(const EventCloud& cloud, std::size_t regions = 64) : points(cloud.size() + 1), planes(regions) {
    std::size_t num_points = 0;
    REQUIRE(estimate_normals(cloud, NormalOptions{}, points, &num_points, nullptr) == Status::ok);
    points.resize(num_points);
    plane_points.resize(num_points);
    const RegionCapacities capacities{num_points, regions, cloud.width, cloud.height};
    ArenaMeter meter;
    REQUIRE(carve(meter, capacities, &workspace));
    GuardedArena memory(meter.peak());
    REQUIRE(carve(memory.arena(), capacities, &workspace));
    std::size_t count = 0;
    REQUIRE(grow_planes(cloud, points, RegionOptions{}, workspace, planes, plane_points, &count, &stats) == Status::ok);
    planes.resize(count);
    workspace = {};
  }
  std::vector<SurfacePoint> points;
  std::vector<Point3> plane_points;
  std::vector<EventPlane> planes;
  RegionWorkspace workspace;
  RegionStats stats;
};

/// rms distance of an edge's space-time corners from a plane, px: near 0 when the plane is that edge's.
double corner_distance(const EventPlane& plane, const MovingEdge& edge, float depth_px) {
  const Point3 corners[4] = {{edge.begin.x1, edge.begin.y1, 0},
                             {edge.begin.x2, edge.begin.y2, 0},
                             {edge.end.x1, edge.end.y1, depth_px},
                             {edge.end.x2, edge.end.y2, depth_px}};
  double sum = 0;
  for (const Point3& c : corners) {
    const float d = (c.x - plane.centre.x) * plane.normal.x + (c.y - plane.centre.y) * plane.normal.y +
                    (c.z - plane.centre.z) * plane.normal.z;
    sum += double{d} * double{d};
  }
  return std::sqrt(sum / 4);
}

}  // namespace

TEST_CASE("regions: crossing edges, and parallel ones that lie close, each become one plane") {
  SceneOptions scene;
  scene.events_per_px = 12;
  scene.noise_events = 1000;
  const std::vector<MovingEdge> edges = {{{40, 40, 300, 200}, {44, 37, 304, 197}, 1},  // crosses the next
                                         {{40, 210, 300, 60}, {44, 214, 304, 64}, 1},  //
                                         {{60, 20, 300, 30}, {60, 24, 300, 34}, 0},  // parallel to the next, 10 px away
                                         {{60, 30, 300, 40}, {60, 34, 300, 44}, 0},  //
                                         {{62, 33, 302, 43}, {62, 37, 302, 47}, 1}};  // the other polarity, 3 px beside
  const CloudOf events(scene, make_events(edges, scene));
  const Planes found(events.cloud);
  std::size_t expected_points = 0;
  for (const MovingEdge& edge : edges) {
    const EventPlane* best = nullptr;
    for (const EventPlane& plane : found.planes) {
      if (plane.polarity == edge.polarity && corner_distance(plane, edge, events.cloud.depth_px) < 1 &&
          (best == nullptr || plane.count > best->count)) {
        best = &plane;
      }
    }
    REQUIRE(best != nullptr);
    const double length =
        std::hypot(double{edge.begin.x2} - double{edge.begin.x1}, double{edge.begin.y2} - double{edge.begin.y1});
    CHECK(best->count > 0.7 * length * scene.events_per_px);
    CHECK(best->thickness_px < 0.8F);
    expected_points += best->count;
  }
  // Hardly any point lies in a plane that is no edge's.
  CHECK(static_cast<double>(expected_points) > 0.9 * static_cast<double>(found.points.size()));
}

TEST_CASE("regions: planes come in order of size and their points lie on them") {
  SceneOptions scene;
  const CloudOf events(
      scene,
      make_events({{{40, 40, 300, 60}, {40, 44, 300, 64}, 1}, {{40, 140, 140, 160}, {40, 144, 140, 164}, 0}}, scene));
  const Planes found(events.cloud);
  REQUIRE(found.planes.size() >= 2);
  CHECK(found.stats.planes == found.planes.size());
  for (std::size_t i = 0; i < found.planes.size(); ++i) {
    const EventPlane& plane = found.planes[i];
    if (i > 0) CHECK(plane.count <= found.planes[i - 1].count);
    CHECK(std::hypot(std::hypot(plane.normal.x, plane.normal.y), plane.normal.z) == doctest::Approx(1).epsilon(1e-4));
    double sum = 0;
    for (std::uint32_t k = plane.first; k < plane.first + plane.count; ++k) {
      const Point3& p = found.plane_points[k];
      const float d = (p.x - plane.centre.x) * plane.normal.x + (p.y - plane.centre.y) * plane.normal.y +
                      (p.z - plane.centre.z) * plane.normal.z;
      sum += double{d} * double{d};
    }
    CHECK(std::sqrt(sum / plane.count) == doctest::Approx(double{plane.thickness_px}).epsilon(0.02));
  }
}

TEST_CASE("regions: without room for all planes the rest is counted") {
  SceneOptions scene;
  const CloudOf events(
      scene,
      make_events({{{40, 40, 300, 60}, {40, 44, 300, 64}, 1}, {{40, 140, 140, 160}, {40, 144, 140, 164}, 0}}, scene));
  const std::size_t all = Planes(events.cloud).planes.size();
  REQUIRE(all >= 2);
  const Planes one(events.cloud, 1);
  CHECK(one.planes.size() == 1);
  CHECK(one.stats.dropped > 0);
}

TEST_CASE("regions: arguments are checked") {
  const CloudOf events(SceneOptions{}, {});
  std::size_t count = 7;
  std::vector<SurfacePoint> points(1);
  RegionWorkspace workspace;
  CHECK(grow_planes(events.cloud, points, {}, workspace, {}, {}, &count, nullptr) == Status::buffer_too_small);
  RegionOptions options;
  options.max_distance_px = 0;
  CHECK(grow_planes(events.cloud, points, options, workspace, {}, {}, &count, nullptr) == Status::invalid_argument);
  CHECK(count == 7);
}
