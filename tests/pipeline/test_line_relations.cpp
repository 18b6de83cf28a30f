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

Detected detect(const SceneOptions& scene, const std::vector<MovingEdge>& edges, std::uint64_t seed = 1) {
  const std::vector<Event> events = make_events(edges, scene, seed);
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

TEST_CASE("relations: edges of one polarity that cross at 5 to 9 degrees are found whole, where they are") {
  SceneOptions scene;
  scene.width = 640;
  scene.height = 480;
  scene.events_per_px = 9;
  scene.noise_events = 2000;
  std::uint64_t seed = 1;
  std::size_t edges_whole = 0;
  std::size_t lines_found = 0;
  for (const double scatter_px : {0.4, 1.0}) {
    scene.noise_px = scatter_px;
    for (const double degrees : {5.0, 6.0, 7.5, 9.0}) {
      for (const double crossing : {0.35, 0.5, 0.65}) {  // where along the shorter edge
        const MovingEdge a{{80, 240, 540, 240}, {80, 252, 540, 252}, 1};
        const double rise = 170 * std::sin(degrees * 0.017453292519943295);
        const auto y1 = static_cast<float>(240 - crossing * rise);
        const auto y2 = static_cast<float>(240 + (1 - crossing) * rise);
        const MovingEdge b{{240, y1, 410, y2}, {240, y1 + 9, 410, y2 + 14}, 1};
        const std::vector<EventLine> lines = detect(scene, {a, b}, seed++).lines;
        lines_found += lines.size();
        for (const MovingEdge& edge : {a, b}) {
          bool whole = false;
          for (const EventLine& line : lines) {
            const double begin = distance_between(line.begin, edge.begin);
            const double end = distance_between(line.end, edge.end);
            whole = whole || (begin >= 0 && end >= 0 && std::fmax(begin, end) < 0.5 + 0.5 * scatter_px &&
                              length(line.begin) > 0.9 * length(edge.begin));
          }
          edges_whole += whole ? 1 : 0;
        }
      }
    }
  }
  CHECK(edges_whole >= 46);  // of 48
  CHECK(lines_found <= 50);
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
