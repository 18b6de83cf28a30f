// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/planes/grid_knn.hpp"
#include "support/cloud_of.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

/// Squared distances of all events of one polarity within the radius, ascending.
std::vector<float> brute_force(const EventCloud& cloud, bool on, const Point3& q, float radius) {
  std::vector<float> distances;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.is_on(i) != on) continue;
    const float dx = cloud.x[i] - q.x;
    const float dy = cloud.y[i] - q.y;
    const float dz = cloud.z(i) - q.z;
    const float d2 = dx * dx + dy * dy + dz * dz;
    if (d2 <= radius * radius) distances.push_back(d2);
  }
  std::sort(distances.begin(), distances.end());
  return distances;
}

CloudOf noise_cloud(std::size_t events, std::uint64_t seed) {
  SceneOptions scene;
  scene.width = 100;
  scene.height = 70;
  scene.noise_events = events;
  return CloudOf(scene, make_events({{{5, 5, 90, 60}, {10, 5, 95, 60}}}, scene, seed));
}

}  // namespace

TEST_CASE("grid knn: the k nearest by distance, as by brute force") {
  std::vector<Neighbour> storage(64);
  for (const std::size_t events : {std::size_t{0}, std::size_t{40}, std::size_t{3000}}) {
    const CloudOf scene = noise_cloud(events, events + 1);
    const EventCloud& cloud = scene.cloud;
    Rng rng(7);
    for (int trial = 0; trial < 200; ++trial) {
      const auto x = static_cast<float>(rng.uniform(-5, 105));
      const auto y = static_cast<float>(rng.uniform(-5, 75));
      const auto z = static_cast<float>(rng.uniform(0, 8));
      const std::size_t k = 1 + rng.below(64);
      const float radius = trial % 2 == 0 ? 6.0F : 300.0F;
      const bool on = rng.below(2) == 1;
      const Point3 query{x, y, z};
      const Span<Neighbour> out(storage.data(), k);
      const std::size_t found = find_nearest(cloud, on ? 1 : 0, query, radius, out);
      const std::vector<float> expected = brute_force(cloud, on, query, radius);
      REQUIRE(found == std::min(k, expected.size()));
      for (std::size_t i = 0; i < found; ++i) {
        CHECK(out[i].distance2 == expected[i]);
        CHECK(cloud.is_on(out[i].index) == on);
      }
    }
  }
}

TEST_CASE("grid knn: an event finds itself, and none is named twice") {
  const CloudOf scene = noise_cloud(500, 3);
  std::vector<Neighbour> out(20);
  for (std::uint32_t i = 0; i < scene.cloud.size(); i += 17) {
    const Point3 query = scene.cloud.point(i);
    const std::size_t found = find_nearest(scene.cloud, scene.cloud.is_on(i) ? 1 : 0, query, 50, out);
    REQUIRE(found == out.size());
    CHECK(out[0].distance2 == 0);
    std::vector<std::uint32_t> indices;
    for (const Neighbour& n : out) indices.push_back(n.index);
    std::sort(indices.begin(), indices.end());
    CHECK(std::adjacent_find(indices.begin(), indices.end()) == indices.end());
  }
}

TEST_CASE("grid knn: all events within a radius while there is room, then an even share") {
  const CloudOf scene = noise_cloud(4000, 5);
  std::vector<std::uint32_t> out(4096);
  Rng rng(9);
  for (int trial = 0; trial < 100; ++trial) {
    const auto x = static_cast<float>(rng.uniform(0, 100));
    const auto y = static_cast<float>(rng.uniform(0, 70));
    const Point3 query{x, y, 4};
    const std::vector<float> expected = brute_force(scene.cloud, true, query, 9);
    std::uint32_t stride = 0;
    CHECK(find_within(scene.cloud, 1, query, 9, out, &stride) == expected.size());
    CHECK(stride == 1);
    const std::size_t some = find_within(scene.cloud, 1, query, 9, Span<std::uint32_t>(out.data(), 40), &stride);
    CHECK(some <= 40);
    CHECK(stride > 1);
    const double share = static_cast<double>(expected.size()) / stride;
    CHECK(static_cast<double>(some) >= 0.5 * share - 3);
    CHECK(static_cast<double>(some) <= 1.5 * share + 3);
  }
}

TEST_CASE(
    "grid knn: a neighbourhood has a floor on its radius where data are dense and k events where they are sparse") {
  NeighbourhoodOptions options;
  std::vector<Neighbour> scratch(options.min_count);
  std::vector<std::uint32_t> out(96);
  const Point3 query{50, 33, 4};
  const auto farthest = [&](const EventCloud& cloud, std::size_t n) {
    float d2 = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const float dx = cloud.x[out[i]] - query.x;
      const float dy = cloud.y[out[i]] - query.y;
      const float dz = cloud.z(out[i]) - query.z;
      d2 = std::max(d2, dx * dx + dy * dy + dz * dz);
    }
    return d2;
  };
  const CloudOf dense = noise_cloud(200000, 11);
  Neighbourhood near = find_neighbourhood(dense.cloud, 1, query, options, scratch, out);
  CHECK(near.count > 15);
  CHECK(near.count <= out.size());
  CHECK(near.stride > 1);
  CHECK(farthest(dense.cloud, near.count) > 25);  // not the nearest ones only: 5 of the 6 px are reached
  CHECK(farthest(dense.cloud, near.count) <= 36);
  CHECK(near.radius_px == options.min_radius_px);
  SceneOptions scene;
  scene.width = 100;
  scene.height = 70;
  scene.noise_events = 900;
  const CloudOf sparse(scene, make_events({}, scene));
  near = find_neighbourhood(sparse.cloud, 1, query, options, scratch, out);
  CHECK(near.stride == 1);
  CHECK(near.count == std::min<std::size_t>(options.min_count, brute_force(sparse.cloud, true, query, 12).size()));
}

TEST_CASE("grid knn: nothing is found in nothing") {
  const CloudOf scene = noise_cloud(100, 1);
  std::uint32_t stride = 0;
  CHECK(find_nearest(scene.cloud, 1, {50, 30, 4}, 10, {}) == 0);
  CHECK(find_within(scene.cloud, 1, {50, 30, 4}, 10, {}, &stride) == 0);
  std::vector<Neighbour> out(4);
  CHECK(find_nearest(EventCloud{}, 1, {50, 30, 4}, 10, out) == 0);
}
