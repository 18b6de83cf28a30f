// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_split.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "support/cloud_of.hpp"
#include "support/guarded_arena.hpp"
#include "support/moving_edges.hpp"

using namespace lecalib;
using namespace lecalib::test;

TEST_CASE("line_split: a row of edges is cut into its pieces, and those without room are counted") {
  const SceneOptions scene;
  std::vector<MovingEdge> row;
  for (const float x : {30.0F, 130.0F, 230.0F}) row.push_back({{x, 120, x + 80, 120}, {x, 125, x + 80, 125}, 1});
  const std::vector<Event> events = make_events(row, scene, 1);
  const CloudOf cloud(scene, events);
  MovingLine whole;
  REQUIRE(line_between({30, 120, 310, 120}, {30, 125, 310, 125}, &whole));
  whole.events = static_cast<std::uint32_t>(events.size());
  whole.polarities = 2;
  whole.thickness_px = scene.noise_px > 0 ? static_cast<float>(scene.noise_px) : 1.0F;
  whole.has_gap = true;

  const LineCapacities capacities{events.size(), scene.width, scene.height};
  ArenaMeter meter;
  LineWorkspace workspace;
  REQUIRE(carve(meter, capacities, &workspace));
  GuardedArena memory(meter.peak());
  REQUIRE(carve(memory.arena(), capacities, &workspace));
  for (const std::size_t room : {std::size_t{3}, std::size_t{2}, std::size_t{1}, std::size_t{0}}) {
    CAPTURE(room);
    std::vector<MovingLine> lines(1 + room);
    lines[0] = whole;
    std::size_t count = 1;
    std::uint32_t dropped = 0;
    const std::size_t cuts = split_lines(cloud.cloud, {}, workspace, lines, &count, &dropped);
    CHECK(count == std::max<std::size_t>(1, room));
    CHECK(cuts == count - 1);
    CHECK(dropped == (room > 0 ? 3 - room : 0));
    if (room == 0) CHECK(lines[0].events == whole.events);
    if (room < 3) continue;
    float low = whole.highest();
    float high = whole.lowest();
    std::uint32_t held = 0;
    for (const MovingLine& line : Span<const MovingLine>(lines).first(count)) {
      low = std::min(low, line.lowest());
      high = std::max(high, line.highest());
      held += line.events;
    }
    CHECK(low == whole.lowest());
    CHECK(high == whole.highest());
    CHECK(held > 0.95 * static_cast<double>(events.size()));
  }
}
