// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "lecalib/planes/pca_normals.hpp"
#include "lecalib/planes/plane_moments.hpp"
#include "support/cloud_of.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

struct Normals {
  explicit Normals(const EventCloud& cloud, std::size_t capacity = 100000) : points(capacity) {
    std::size_t count = 0;
    REQUIRE(estimate_normals(cloud, NormalOptions{}, points, &count, &stats) == Status::ok);
    points.resize(count);
  }
  std::vector<SurfacePoint> points;
  NormalStats stats;
};

double angle_deg(const Point3& a, const Point3& b) {
  const double product = std::fabs(double{a.x} * double{b.x} + double{a.y} * double{b.y} + double{a.z} * double{b.z});
  return std::acos(std::fmin(1.0, product)) * 57.29577951308232;
}

}  // namespace

TEST_CASE("plane fit: points of a plane give it back, with the extents as variances") {
  PlaneMoments moments;
  for (int a = -3; a <= 3; ++a) {
    for (int b = -2; b <= 2; ++b) {  // spanned by (0.6, 0.8, 0) and (0, 0, 1), about (10, 20, 30)
      const auto u = static_cast<float>(a);
      const auto v = static_cast<float>(b);
      moments.add(10 + 0.6F * u, 20 + 0.8F * u, 30 + v);
    }
  }
  PlaneFit plane{};
  REQUIRE(fit_plane(moments, &plane));
  CHECK(plane.centre.x == doctest::Approx(10));
  CHECK(plane.centre.z == doctest::Approx(30));
  CHECK(plane.normal.x == doctest::Approx(0.8).epsilon(1e-3));
  CHECK(plane.normal.y == doctest::Approx(-0.6).epsilon(1e-3));
  CHECK(plane.variance[0] < 1e-3F);
  CHECK(plane.variance[1] == doctest::Approx(2).epsilon(1e-3));
  CHECK(plane.variance[2] == doctest::Approx(4).epsilon(1e-3));
  PlaneMoments two;
  two.add(0, 0, 0);
  two.add(1, 0, 0);
  CHECK_FALSE(fit_plane(two, &plane));
}

TEST_CASE("normals: those of a moving edge are its plane's, from sparse to dense windows") {
  SceneOptions scene;
  const MovingEdge edge{{60, 60, 260, 160}, {64, 55, 264, 155}, 1};
  const double length = std::hypot(200.0, 100.0);
  const double nx = 100 / length;
  const double ny = -200 / length;
  // In 8 px of depth the edge moves (4, -5) px: the normal's z balances the motion along (nx, ny).
  const double nz = -(4 * nx - 5 * ny) / 8;
  const double norm = std::sqrt(1 + nz * nz);
  const Point3 truth{static_cast<float>(nx / norm), static_cast<float>(ny / norm), static_cast<float>(nz / norm)};
  for (const double events_per_px : {3.0, 20.0, 300.0}) {
    scene.events_per_px = events_per_px;
    const CloudOf events(scene, make_events({edge}, scene));
    const Normals normals(events.cloud, 3000);
    CHECK(normals.points.size() > 0.9 * normals.stats.queries);
    double sum = 0;
    for (const SurfacePoint& p : normals.points) sum += angle_deg(p.normal, truth);
    CHECK(sum / static_cast<double>(normals.points.size()) < 8);
    for (const SurfacePoint& p : normals.points) CHECK(p.normal.x >= 0);
  }
}

TEST_CASE("normals: noise has none") {
  for (const std::size_t noise : {std::size_t{1000}, std::size_t{20000}}) {
    SceneOptions scene;
    scene.noise_events = noise;
    const CloudOf events(scene, make_events({}, scene));
    const Normals normals(events.cloud);
    CHECK(normals.stats.queries == events.cloud.size());
    CHECK(normals.stats.isolated + normals.stats.not_flat + normals.points.size() == normals.stats.queries);
    CHECK(normals.points.size() < 0.02 * static_cast<double>(events.cloud.size()));
  }
}

TEST_CASE("normals: beyond the capacity events are passed over evenly and counted") {
  SceneOptions scene;
  scene.noise_events = 1000;
  const CloudOf events(scene, make_events({{{20, 20, 320, 240}, {25, 18, 325, 238}}}, scene));
  for (const std::size_t capacity : {events.cloud.size(), events.cloud.size() - 1, std::size_t{10}}) {
    const Normals normals(events.cloud, capacity);
    CHECK(normals.stats.queries <= capacity);
    CHECK(normals.stats.queries + normals.stats.skipped == events.cloud.size());
  }
  for (const SurfacePoint& p : Normals(events.cloud).points) CHECK(p.cell < 2 * events.cloud.cells());
}

TEST_CASE("normals: options are checked") {
  const CloudOf events(SceneOptions{}, {});
  std::vector<SurfacePoint> out(4);
  std::size_t count = 7;
  const auto status = [&](const NormalOptions& options) {
    return estimate_normals(events.cloud, options, out, &count, nullptr);
  };
  CHECK(status({}) == Status::ok);
  CHECK(count == 0);
  NormalOptions options;
  options.neighbourhood.min_count = kMaxNeighbours + 1;
  CHECK(status(options) == Status::invalid_argument);
  options = {};
  options.neighbourhood.max_radius_px = 1;
  CHECK(status(options) == Status::invalid_argument);
  options = {};
  options.min_support = 2;
  CHECK(status(options) == Status::invalid_argument);
  out.clear();
  CHECK(status({}) == Status::buffer_too_small);
}
