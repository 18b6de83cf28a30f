// SPDX-License-Identifier: MIT
/// What lines have to do with each other, through the whole detector: crossings at small angles, and rows with gaps.
#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>
#include <vector>

#include "lecalib/pipeline/line_detector.hpp"
#include "support/guarded_arena.hpp"
#include "support/moving_edges.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

struct Detected {
  std::vector<EventLine> lines;
  DetectorStats stats;
  std::vector<std::vector<LineSample>> samples;
};

Detected detect(const SceneOptions& scene, const std::vector<MovingEdge>& edges) {
  const std::vector<Event> events = make_events(edges, scene);
  DetectorCapacities capacities;
  capacities.events = events.size();
  capacities.surface_points = capacities.regions = 0;
  capacities.lines = 16;
  capacities.samples_per_line = 24;
  capacities.width = scene.width;
  capacities.height = scene.height;
  GuardedArena memory(detector_bytes(capacities));
  DetectorWorkspace workspace;
  REQUIRE(carve(memory.arena(), capacities, &workspace));
  DetectorOptions options;
  options.cloud.width = scene.width;
  options.cloud.height = scene.height;
  Detected found;
  found.lines.resize(16);
  std::size_t count = 0;
  REQUIRE(detect_lines(window_of(scene, events), options, &workspace, found.lines, &count, &found.stats) == Status::ok);
  found.lines.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Span<const LineSample> samples = line_samples(workspace, i);
    found.samples.emplace_back(samples.begin(), samples.end());
  }
  CHECK(line_samples(workspace, 16).empty());
  return found;
}

double length(const Segment& s) { return std::hypot(double{s.x2} - double{s.x1}, double{s.y2} - double{s.y1}); }

}  // namespace

TEST_CASE("relations: two edges of one polarity that cross at 5 degrees are both found whole") {
  SceneOptions scene;
  const MovingEdge a{{30, 120, 310, 120}, {30, 125, 310, 125}, 1};
  const MovingEdge b{{30, 132, 310, 108}, {30, 137, 310, 113}, 1};
  const Detected found = detect(scene, {a, b});
  for (const MovingEdge& edge : {a, b}) {
    bool whole = false;
    for (const EventLine& line : found.lines) {
      const double distance = distance_between(line.begin, edge.begin);
      whole = whole || (distance >= 0 && distance < 1 && length(line.begin) > 0.8 * length(edge.begin));
    }
    CHECK(whole);
  }
}

TEST_CASE("relations: a row of edges is cut at its gap, one without gap is not") {
  SceneOptions scene;
  const MovingEdge whole{{30, 120, 310, 120}, {30, 125, 310, 125}, 1};
  const Detected one = detect(scene, {whole});
  CHECK(one.lines.size() == 1);
  CHECK(one.stats.lines_cut == 0);
  const MovingEdge left{{30, 120, 160, 120}, {30, 125, 160, 125}, 1};
  const MovingEdge right{{172, 120, 310, 120}, {172, 125, 310, 125}, 1};
  CHECK(detect(scene, {left, right}).lines.size() == 2);
}

TEST_CASE("samples: they stand on the line, each at its own time, within their sigma") {
  SceneOptions scene;
  const MovingEdge edge{{40, 60, 300, 190}, {50, 50, 306, 196}, 0};
  const Detected found = detect(scene, {edge});
  REQUIRE(found.lines.size() == 1);
  REQUIRE(found.samples[0].size() > 12);
  CHECK(found.samples[0].size() <= 24);
  double square = 0;
  for (const LineSample& sample : found.samples[0]) {
    CHECK(sample.time >= 0);
    CHECK(sample.time <= 1);
    const auto mix = [&](float a, float b) { return double{a} + double{sample.time} * (double{b} - double{a}); };
    const double x1 = mix(edge.begin.x1, edge.end.x1), y1 = mix(edge.begin.y1, edge.end.y1);
    const double dx = mix(edge.begin.x2, edge.end.x2) - x1, dy = mix(edge.begin.y2, edge.end.y2) - y1;
    const double d = ((double{sample.x} - x1) * dy - (double{sample.y} - y1) * dx) / std::hypot(dx, dy);
    square += d * d / (double{sample.sigma_px} * double{sample.sigma_px});
  }
  const double ratio = std::sqrt(square / static_cast<double>(found.samples[0].size()));
  CHECK(ratio > 0.4);
  CHECK(ratio < 1.6);
}
