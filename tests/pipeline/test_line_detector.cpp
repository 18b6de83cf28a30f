// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <limits>
#include <type_traits>
#include <vector>

#include "lecalib/pipeline/line_detector.hpp"
#include "support/alloc_counter.hpp"
#include "support/guarded_arena.hpp"
#include "support/moving_edges.hpp"
#include "support/shared_data.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

DetectorCapacities capacities_for(const SceneOptions& scene, std::size_t events) {
  DetectorCapacities capacities;
  capacities.events = events;
  capacities.width = scene.width;
  capacities.height = scene.height;
  return capacities;
}

/// A detector in exactly the memory that it asks for.
struct Detector {
  Detector(const SceneOptions& scene, std::size_t events) : Detector(scene, capacities_for(scene, events)) {}
  Detector(const SceneOptions& scene, LineFinder finder) : Detector(scene, 60000) { options.find_lines = finder; }
  Detector(const SceneOptions& scene, const DetectorCapacities& capacities)
      : memory(detector_bytes(capacities)), lines(64) {
    REQUIRE(carve(memory.arena(), capacities, &workspace));
    CHECK(memory.arena().peak() == detector_bytes(capacities));
    options.cloud.width = scene.width;
    options.cloud.height = scene.height;
  }
  Status detect(const EventWindow& window) { return detect_lines(window, options, &workspace, lines, &count, &stats); }

  GuardedArena memory;
  DetectorWorkspace workspace;
  DetectorOptions options;
  std::vector<EventLine> lines;
  std::size_t count = 0;
  DetectorStats stats;
};

constexpr LineFinder kFinders[] = {fast_detector, reference_detector};

/// The found line that lies on the edge at both ends of the window, or null.
const EventLine* find_edge(const Detector& detector, const MovingEdge& edge, double max_distance_px) {
  for (std::size_t i = 0; i < detector.count; ++i) {
    const EventLine& line = detector.lines[i];
    const double at_begin = distance_between(line.begin, edge.begin);
    const double at_end = distance_between(line.end, edge.end);
    if (at_begin >= 0 && at_end >= 0 && at_begin <= max_distance_px && at_end <= max_distance_px) return &line;
  }
  return nullptr;
}

/// The nine edges of a box that turns and comes nearer; neighbours differ in polarity as bright and dark faces do.
std::vector<MovingEdge> box() {
  const auto edge = [](float x1, float y1, float x2, float y2, std::uint8_t polarity) {
    const auto moved_x = [](float x, float y) { return 173 + 1.03F * (x - 173) - 0.02F * (y - 130) + 4; };
    const auto moved_y = [](float x, float y) { return 130 + 1.03F * (y - 130) + 0.02F * (x - 173) + 3; };
    return MovingEdge{{x1, y1, x2, y2}, {moved_x(x1, y1), moved_y(x1, y1), moved_x(x2, y2), moved_y(x2, y2)}, polarity};
  };
  return {edge(80, 90, 180, 120, 1),  edge(180, 120, 270, 80, 0), edge(80, 90, 165, 60, 1),
          edge(165, 60, 270, 80, 0),  edge(80, 90, 90, 190, 1),   edge(180, 120, 182, 220, 0),
          edge(270, 80, 262, 175, 1), edge(90, 190, 182, 220, 0), edge(182, 220, 262, 175, 1)};
}

}  // namespace

TEST_CASE("detector: every edge of a moving box is found at both ends of the window, and nothing else") {
  for (const LineFinder finder : kFinders) {
    SceneOptions scene;
    scene.noise_events = 1500;
    const std::vector<MovingEdge> edges = box();
    for (const double events_per_px : {3.0, 6.0, 25.0}) {
      scene.events_per_px = events_per_px;
      const std::vector<Event> events = make_events(edges, scene, 3);
      Detector detector(scene, finder);
      REQUIRE(detector.detect(window_of(scene, events)) == Status::ok);
      CHECK(detector.count == edges.size());
      for (const MovingEdge& edge : edges) {
        const EventLine* line = find_edge(detector, edge, 0.4);
        REQUIRE(line != nullptr);
        CHECK(line->polarity == (edge.polarity != 0 ? 1 : -1));
        CHECK(line->sigma_begin_px > 0);
        CHECK(line->sigma_begin_px < 1.25F);  // of edges with 3 events per px it is the systematic part
      }
      const std::size_t accepted = detector.stats.fits[static_cast<std::size_t>(FitOutcome::accepted)];
      CHECK(accepted == detector.count + detector.stats.lines_merged);
    }
  }
}

TEST_CASE("detector: noise alone makes no lines") {
  for (const LineFinder finder : kFinders) {
    for (const std::uint16_t width : {std::uint16_t{240}, std::uint16_t{1280}}) {
      SceneOptions scene;
      scene.width = width;
      scene.height = width == 240 ? 180 : 720;
      for (const std::size_t noise : {std::size_t{500}, std::size_t{5000}, std::size_t{50000}}) {
        scene.noise_events = noise;
        const std::vector<Event> events = make_events({}, scene, noise);
        Detector detector(scene, finder);
        REQUIRE(detector.detect(window_of(scene, events)) == Status::ok);
        CHECK(detector.count == 0);
      }
    }
  }
}

TEST_CASE("detector: the polygon edges of a real recording that move across themselves carry lines") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  for (const LineFinder finder : kFinders) {
    SceneOptions scene;
    scene.width = 240;
    scene.height = 180;
    scene.begin_us = 2117000;
    scene.length_us = 11000;
    std::ifstream file(*data / "real" / "davis240c_shapes" / "events.txt");
    std::vector<Event> events;
    double t_s = 0;
    unsigned x = 0;
    unsigned y = 0;
    unsigned polarity = 0;
    while (file >> t_s >> x >> y >> polarity) {
      const auto t_us = static_cast<std::int64_t>(t_s * 1e6 + 0.5);
      if (t_us < scene.begin_us || t_us >= scene.begin_us + scene.length_us) continue;
      events.push_back(
          {t_us, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), static_cast<std::uint8_t>(polarity)});
    }
    REQUIRE(events.size() > 1000);
    Detector detector(scene, finder);
    REQUIRE(detector.detect(window_of(scene, events)) == Status::ok);
    // Read off a picture of these events: the triangle's sides and the bar's long ones, at mid window.
    const Segment edges[] = {
        {37, 149, 46, 122}, {47, 122, 64, 146}, {38, 149, 63, 147}, {81, 168, 134, 144}, {95, 179, 141, 158}};
    for (const Segment& edge : edges) {
      bool found = false;
      for (std::size_t i = 0; i < detector.count; ++i) {
        const double at_begin = distance_between(detector.lines[i].begin, edge);
        const double at_end = distance_between(detector.lines[i].end, edge);
        found = found || (at_begin >= 0 && at_begin < 4 && at_end >= 0 && at_end < 4);
      }
      INFO("edge from ", edge.x1, " ", edge.y1);
      CHECK(found);
    }
  }
}

TEST_CASE("detector: a window beyond the capacity is thinned, counted, and its lines are found") {
  for (const LineFinder finder : kFinders) {
    SceneOptions scene;
    scene.events_per_px = 60;
    const std::vector<MovingEdge> edges = box();
    const std::vector<Event> events = make_events(edges, scene);
    Detector detector(scene, 10000);
    detector.options.find_lines = finder;
    REQUIRE(detector.detect(window_of(scene, events)) == Status::ok);
    CHECK(detector.stats.cloud.thinned == events.size() - 10000);
    for (const MovingEdge& edge : edges) CHECK(find_edge(detector, edge, 0.4) != nullptr);
  }
}

TEST_CASE("detector: lines that cross are found whole") {
  for (const LineFinder finder : kFinders) {
    SceneOptions scene;
    const std::vector<MovingEdge> edges = {{{30, 40, 310, 210}, {34, 37, 314, 207}, 1},
                                           {{40, 200, 300, 60}, {44, 204, 304, 64}, 1},
                                           {{20, 120, 330, 125}, {20, 125, 330, 130}, 1}};
    const std::vector<Event> events = make_events(edges, scene);
    Detector detector(scene, finder);
    REQUIRE(detector.detect(window_of(scene, events)) == Status::ok);
    CHECK(detector.count == edges.size());
    for (const MovingEdge& edge : edges) {
      const EventLine* line = find_edge(detector, edge, 0.4);
      REQUIRE(line != nullptr);
      const Segment& s = line->begin;
      const Segment& t = edge.begin;
      const float found = std::hypot(s.x2 - s.x1, s.y2 - s.y1);
      CHECK(found > 0.95F * std::hypot(t.x2 - t.x1, t.y2 - t.y1));
    }
  }
}

TEST_CASE("detector: the output holds the strongest lines when it is too small, and the rest is counted") {
  for (const LineFinder finder : kFinders) {
    SceneOptions scene;
    const std::vector<Event> events = make_events(box(), scene);
    Detector all(scene, finder);
    REQUIRE(all.detect(window_of(scene, events)) == Status::ok);
    REQUIRE(all.count == 9);
    for (const std::size_t room : {std::size_t{9}, std::size_t{8}, std::size_t{0}}) {
      Detector detector(scene, finder);
      detector.lines.resize(room);
      REQUIRE(detector.detect(window_of(scene, events)) == Status::ok);
      CHECK(detector.count == room);
      CHECK(detector.stats.lines_dropped == 9 - room);
      for (std::size_t i = 0; i < room; ++i) CHECK(detector.lines[i].events == all.lines[i].events);
    }
  }
}

TEST_CASE("detector: a workspace for fewer regions or lines drops and counts") {
  SceneOptions scene;
  const std::vector<Event> events = make_events(box(), scene);
  DetectorCapacities capacities = capacities_for(scene, 60000);
  capacities.lines = 4;
  Detector few_lines(scene, capacities);
  few_lines.options.find_lines = reference_detector;
  REQUIRE(few_lines.detect(window_of(scene, events)) == Status::ok);
  CHECK(few_lines.count == 4);
  CHECK(few_lines.stats.lines_dropped > 0);
  capacities.regions = 3;
  Detector few_regions(scene, capacities);
  few_regions.options.find_lines = reference_detector;
  REQUIRE(few_regions.detect(window_of(scene, events)) == Status::ok);
  CHECK(few_regions.count <= 3);
  CHECK(few_regions.stats.regions.dropped > 0);
}

TEST_CASE("detector: shifting the window in time changes nothing, and the same bytes give the same bits") {
  for (const LineFinder finder : kFinders) {
    SceneOptions scene;
    scene.noise_events = 1000;
    std::vector<Event> events = make_events(box(), scene);
    Detector first(scene, finder);
    REQUIRE(first.detect(window_of(scene, events)) == Status::ok);
    for (Event& e : events) e.t_us += 913700000000;
    scene.begin_us += 913700000000;
    Detector second(scene, finder);
    REQUIRE(second.detect(window_of(scene, events)) == Status::ok);
    REQUIRE(second.count == first.count);
    for (std::size_t i = 0; i < first.count; ++i) {
      const EventLine& a = first.lines[i];
      const EventLine& b = second.lines[i];
      CHECK(std::memcmp(&a.begin, &b.begin, sizeof(Segment)) == 0);
      CHECK(std::memcmp(&a.end, &b.end, sizeof(Segment)) == 0);
      CHECK(a.events == b.events);
    }
  }
}

TEST_CASE("detector: nothing is allocated, and stages are timed by the given clock") {
  for (const LineFinder finder : kFinders) {
    SceneOptions scene;
    const std::vector<Event> events = make_events(box(), scene);
    Detector detector(scene, finder);
    detector.options.clock_ns = [] {
      static std::uint64_t now = 0;
      return now += 1000;
    };
    const EventWindow window = window_of(scene, events);
    const AllocScope heap;
    const Status status = detector.detect(window);
    const std::size_t allocations = heap.allocations();
    CHECK(status == Status::ok);
    CHECK(allocations == 0);
    for (std::size_t i = 0; i < kNumDetectorStages; ++i) {
      const auto stage = static_cast<DetectorStage>(i);
      const bool of_planes =
          stage == DetectorStage::normals || stage == DetectorStage::planes || stage == DetectorStage::segments;
      const bool of_kind = finder == fast_detector ? !of_planes : stage != DetectorStage::seeds;
      const bool runs = of_kind && stage != DetectorStage::edges;  // not asked for
      CHECK(detector.stats.stage_ns[i] == (runs ? 1000U : 0U));
      CHECK(std::strcmp(to_string(stage), "unknown") != 0);
    }
  }
}

TEST_CASE("detector: the fast one needs no memory for planes, and counts the seeds that find no room") {
  SceneOptions scene;
  scene.noise_events = 1500;
  const std::vector<Event> events = make_events(box(), scene);
  DetectorCapacities capacities = capacities_for(scene, 60000);
  capacities.surface_points = capacities.regions = 0;
  Detector lean(scene, capacities);
  REQUIRE(lean.detect(window_of(scene, events)) == Status::ok);
  CHECK(lean.count == box().size());
  CHECK(lean.stats.guesses_dropped == 0);
  capacities.seeds = lean.stats.guesses - 1;
  Detector short_of_one(scene, capacities);
  REQUIRE(short_of_one.detect(window_of(scene, events)) == Status::ok);
  CHECK(short_of_one.stats.guesses_dropped == 1);
  capacities.lines = 4;
  Detector few_lines(scene, capacities);
  REQUIRE(few_lines.detect(window_of(scene, events)) == Status::ok);
  CHECK(few_lines.count == 4);
  CHECK(few_lines.stats.guesses_dropped > 1);
}

TEST_CASE("detector: bad options, windows and workspaces are told apart") {
  SceneOptions scene;
  const std::vector<Event> events = make_events(box(), scene);
  const EventWindow window = window_of(scene, events);
  Detector detector(scene, reference_detector);
  CHECK(detector.detect({5, 5, {}}) == Status::invalid_argument);
  detector.options.cloud.width = 0;
  CHECK(detector.detect(window) == Status::invalid_argument);
  detector.options.cloud.width = 1280;
  CHECK(detector.detect(window) == Status::buffer_too_small);
  detector.options.cloud.width = scene.width;
  detector.options.normals.min_support = 0;
  CHECK(detector.detect(window) == Status::invalid_argument);
  detector.options.normals.min_support = 8;
  detector.options.regions.reach_px = 0;
  CHECK(detector.detect(window) == Status::invalid_argument);
  detector.options.regions.reach_px = 8;
  detector.options.find_lines = nullptr;
  CHECK(detector.detect(window) == Status::invalid_argument);
  detector.options.find_lines = reference_detector;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto check_refused = [&](auto* option, std::initializer_list<std::remove_pointer_t<decltype(option)>> values) {
    const auto good = *option;
    for (const auto bad : values) {
      CAPTURE(bad);
      *option = bad;
      CHECK(detector.detect(window) == Status::invalid_argument);
    }
    *option = good;
  };
  DetectorOptions& options = detector.options;
  check_refused(&options.growth.band_px, {0, 101, nan});
  check_refused(&options.growth.max_gap_px, {3.9F, 1.1e6F, nan});
  check_refused(&options.growth.gap_events, {-1, nan});
  check_refused(&options.fit.gaps.min_gap_px, {0.9F, 1.1e6F, nan});
  check_refused(&options.fit.gaps.min_surprise, {0, 1001, nan});
  check_refused(&options.crossings.threshold, {0, 2.1F, nan});
  check_refused(&options.crossings.band_px, {0, 101, nan});
  check_refused(&options.crossings.max_gap_px, {0, nan});
  check_refused(&options.crossings.max_gap_us, {799, nan});
  check_refused(&options.crossings.max_events, {0, 256});
  check_refused(&options.crossings.min_crossings, {0});
  const Span<MovingLine> lines = detector.workspace.lines;
  detector.workspace.lines = {};
  CHECK(detector.detect(window) == Status::invalid_argument);
  detector.workspace.lines = lines;
  CHECK(detector.detect(window) == Status::ok);
  CHECK(detector.detect({scene.begin_us, scene.begin_us + 10, {}}) == Status::ok);
  CHECK(detector.count == 0);
  const DetectorCapacities capacities = capacities_for(scene, 60000);
  std::vector<std::byte> bytes(detector_bytes(capacities) + kArenaAlign - 1);
  const auto misalignment = reinterpret_cast<std::uintptr_t>(bytes.data()) % kArenaAlign;
  std::byte* aligned = bytes.data() + (kArenaAlign - misalignment) % kArenaAlign;
  Arena arena({aligned, detector_bytes(capacities) - 1});
  DetectorWorkspace workspace;
  CHECK_FALSE(carve(arena, capacities, &workspace));
}

TEST_CASE("the fast detector takes at most 24 bytes per event and 8 per cell, beside tables that neither adds to") {
  const auto bytes_of = [](std::size_t events, std::uint16_t height) {
    DetectorCapacities capacities;
    capacities.events = events;
    capacities.surface_points = 0;
    capacities.regions = 0;
    capacities.image_cells = 0;
    capacities.width = 1280;
    capacities.height = height;
    return detector_bytes(capacities);
  };
  CHECK(bytes_of(160000, 720) - bytes_of(60000, 720) <= 24 * 100000);
  // Histograms along a line grow with the longest one: at most 8 bytes for every px of the sensor's side.
  const std::size_t more_cells = cloud_cells(1280, 1440) - cloud_cells(1280, 720);
  CHECK(bytes_of(60000, 1440) - bytes_of(60000, 720) <= 8 * more_cells + 8 * 720);
  CHECK(bytes_of(60000, 720) <= 24 * 60000 + 8 * cloud_cells(1280, 720) + 192 * 1024);
}
