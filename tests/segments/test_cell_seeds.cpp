// SPDX-License-Identifier: MIT
#include "lecalib/segments/cell_seeds.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <initializer_list>
#include <vector>

#include "support/cloud_of.hpp"
#include "support/guarded_arena.hpp"
#include "support/moving_edges.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

/// A line through the middle of the image that moves by (4, 3) px: the window's begin to its end.
const MovingEdge kEdge = {{60, 50, 260, 200}, {64, 53, 264, 203}, 1};

struct Seeds {
  Seeds(const SceneOptions& scene, const EventCloud& cloud, std::size_t room = 4096)
      : memory(bytes({room, scene.width, scene.height})), owner(cloud.size()) {
    REQUIRE(carve(memory.arena(), {room, scene.width, scene.height}, &workspace));
    count = rank_seeds(cloud, {}, workspace, &dropped);
  }
  static std::size_t bytes(const SeedCapacities& capacities) {
    ArenaMeter meter;
    SeedWorkspace ignored;
    (void)carve(meter, capacities, &ignored);
    return meter.peak();
  }
  GuardedArena memory;
  SeedWorkspace workspace;
  std::vector<std::uint8_t> owner;
  std::size_t count = 0;
  std::uint32_t dropped = 0;
};

/// Distance of a point from the edge's line at tau.
double distance(const MovingEdge& edge, float tau, double x, double y) {
  const double mix = 0.5 * (static_cast<double>(tau) + 1);
  const auto at = [&](float a, float b) { return (1 - mix) * static_cast<double>(a) + mix * static_cast<double>(b); };
  const double x1 = at(edge.begin.x1, edge.end.x1);
  const double y1 = at(edge.begin.y1, edge.end.y1);
  const double dx = at(edge.begin.x2, edge.end.x2) - x1;
  const double dy = at(edge.begin.y2, edge.end.y2) - y1;
  return std::abs((x - x1) * dy - (y - y1) * dx) / std::sqrt(dx * dx + dy * dy);
}

}  // namespace

TEST_CASE("seeds: of two parallel edges in one block one is taken, not the middle between them") {
  SceneOptions scene;
  scene.events_per_px = 10;
  for (const float apart : {3.5F, 5.0F, 7.0F}) {
    const MovingEdge one = {{60, 50, 260, 60}, {60, 55, 260, 65}, 1};
    MovingEdge other = one;
    for (Segment* end : {&other.begin, &other.end}) {
      end->y1 += apart;
      end->y2 += apart;
    }
    const std::vector<Event> events = make_events({one, other}, scene);
    CloudOf cloud(scene, events);
    Seeds seeds(scene, cloud.cloud);
    REQUIRE(seeds.count >= 20);
    std::size_t lines = 0;
    std::size_t wrong = 0;
    for (const CellSeed& seed : seeds.workspace.seeds.first(seeds.count)) {
      MovingLine line;
      if (!refine_seed(cloud.cloud, {}, seed, seeds.owner, &line)) continue;
      ++lines;
      const auto x = static_cast<double>(line.x(0, line.offset(0, 0)));
      const auto y = static_cast<double>(line.y(0, line.offset(0, 0)));
      wrong += std::min(distance(one, 0, x, y), distance(other, 0, x, y)) < 1.0 ? 0U : 1U;
    }
    CHECK(lines >= 65);  // the edges cross 100 blocks, of which some hold only the rim of one
    CHECK(wrong * 10 <= lines);
  }
}

TEST_CASE("seeds: the best blocks lie on the edge, and refining them gives its place and motion") {
  SceneOptions scene;
  scene.noise_events = 1000;
  scene.events_per_px = 10;
  const std::vector<Event> events = make_events({kEdge}, scene);
  CloudOf cloud(scene, events);
  Seeds seeds(scene, cloud.cloud);
  REQUIRE(seeds.count >= 10);
  const auto* first = seeds.workspace.seeds.begin();
  CHECK(std::is_sorted(first, first + seeds.count,
                       [](const CellSeed& a, const CellSeed& b) { return a.score > b.score; }));
  for (std::size_t i = 0; i < 10; ++i) {
    MovingLine line;
    REQUIRE(refine_seed(cloud.cloud, {}, first[i], seeds.owner, &line));
    CHECK(line.polarities == 2);
    for (const float tau : {-1.0F, 0.0F, 1.0F}) {
      for (const float s : {-8.0F, 8.0F}) {
        const float d = line.offset(s, tau);
        CHECK(distance(kEdge, tau, static_cast<double>(line.x(s, d)), static_cast<double>(line.y(s, d))) < 1.0);
      }
    }
  }
}

TEST_CASE("seeds: sums over rows of cells agree with brute force over each block") {
  SceneOptions scene;
  scene.noise_events = 3000;
  const std::vector<Event> events = make_events({kEdge}, scene);
  CloudOf cloud(scene, events);
  const EventCloud& c = cloud.cloud;
  Seeds seeds(scene, c);
  for (std::size_t i = 0; i < seeds.count; ++i) {
    const CellSeed& seed = seeds.workspace.seeds[i];
    // x and y regressed on tau, then the eigenvalues of the rest, in double from the events themselves.
    double n = 0, m[3] = {}, q[3][3] = {};
    for (const std::size_t cell : {std::size_t{seed.block}, std::size_t{seed.block} + c.cols}) {
      for (std::uint32_t e = c.cell_start[cell]; e < c.cell_start[cell + 2]; ++e) {
        const double v[3] = {static_cast<double>(c.x[e]), static_cast<double>(c.y[e]), static_cast<double>(c.tau(e))};
        n += 1;
        for (int a = 0; a < 3; ++a) {
          m[a] += v[a];
          for (int b = 0; b < 3; ++b) q[a][b] += v[a] * v[b];
        }
      }
    }
    const auto cov = [&](int a, int b) { return q[a][b] / n - m[a] * m[b] / (n * n); };
    const double tt = cov(2, 2) + 1e-3;
    const double xx = cov(0, 0) - cov(0, 2) * cov(0, 2) / tt;
    const double xy = cov(0, 1) - cov(0, 2) * cov(1, 2) / tt;
    const double yy = cov(1, 1) - cov(1, 2) * cov(1, 2) / tt;
    const double root = std::sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy);
    const double across = 0.5 * (xx + yy) - root;
    const double score = 2 * root / (across + 0.25) * std::sqrt(n);
    CHECK(static_cast<double>(seed.score) == doctest::Approx(score).epsilon(1e-3));
  }
}

TEST_CASE("seeds: of more than find room the best are kept and the rest counted") {
  SceneOptions scene;
  const std::vector<Event> events = make_events({kEdge}, scene);
  CloudOf cloud(scene, events);
  const Seeds all(scene, cloud.cloud);
  REQUIRE(all.count > 5);
  CHECK(all.dropped == 0);
  const Seeds exactly(scene, cloud.cloud, all.count);
  CHECK(exactly.dropped == 0);
  const Seeds few(scene, cloud.cloud, 5);
  CHECK(few.count == 5);
  CHECK(few.dropped == all.count - 5);
  for (std::size_t i = 0; i < 5; ++i) CHECK(few.workspace.seeds[i].block == all.workspace.seeds[i].block);
}

TEST_CASE("seeds: events that a line holds, and cells where growing failed, are left alone") {
  SceneOptions scene;
  const std::vector<Event> events = make_events({kEdge}, scene);
  CloudOf cloud(scene, events);
  Seeds seeds(scene, cloud.cloud);
  REQUIRE(seeds.count > 0);
  const CellSeed& best = seeds.workspace.seeds[0];
  CHECK_FALSE(has_failed(cloud.cloud, seeds.workspace, best));
  mark_failed(cloud.cloud, seeds.workspace, best);
  CHECK(has_failed(cloud.cloud, seeds.workspace, best));
  // Neither fewer nor more than the blocks that share a cell with it.
  const std::uint32_t cols = cloud.cloud.cols;
  for (std::uint32_t block = 0; block + cols + 1 < 2 * cloud.cloud.cells(); ++block) {
    const auto distance = static_cast<std::int64_t>(block) - static_cast<std::int64_t>(best.block);
    bool shares = false;
    for (const std::int64_t dy : {-1, 0, 1}) shares = shares || std::abs(distance - dy * cols) <= 1;
    CHECK(has_failed(cloud.cloud, seeds.workspace, {1, block}) == shares);
  }
  MovingLine line;
  line.cx = -77;
  std::fill(seeds.owner.begin(), seeds.owner.end(), std::uint8_t{1});
  CHECK_FALSE(refine_seed(cloud.cloud, {}, best, seeds.owner, &line));
  CHECK(line.cx == -77);
}

TEST_CASE("seeds: of noise alone fewer than one block in twenty looks like an edge") {
  SceneOptions scene;
  scene.noise_events = 20000;
  const std::vector<Event> events = make_events({}, scene);
  CloudOf cloud(scene, events);
  Seeds seeds(scene, cloud.cloud);
  std::size_t refined = 0;
  for (std::size_t i = 0; i < seeds.count; ++i) {
    MovingLine line;
    if (refine_seed(cloud.cloud, {}, seeds.workspace.seeds[i], seeds.owner, &line)) ++refined;
  }
  CHECK(20 * refined < 2 * cloud.cloud.cells());
}
