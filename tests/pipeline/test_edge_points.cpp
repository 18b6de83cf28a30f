// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/edge_points.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <vector>

#include "lecalib/segments/line_crossings.hpp"

using namespace lecalib;

namespace {

/// A horizontal edge at y, 100 px long, 3 events per crossing; its normal (-dy, dx) is (0, 1).
EventLine make_line(float y, std::int8_t polarity, float speed = 500) {
  EventLine line{};
  line.polarity = polarity;
  LineEdge& edge = line.edge;
  for (int time = 0; time < 2; ++time) {
    for (int i = 0; i < 3; ++i) {
      edge.x[time][i] = 60 + 50 * static_cast<float>(i - 1);
      edge.y[time][i] = y + static_cast<float>(time);
    }
  }
  for (int i = 0; i < 3; ++i) edge.sigma_px[i] = 0.06F / std::sqrt(kEdgePlaceWeights[i]);
  edge.scatter_px = 0.1F;
  edge.events_per_crossing = 3;
  edge.speed_px_per_s = speed;
  edge.crossings = 300;
  return line;
}

struct Fixture {
  std::vector<EventLine> lines = {make_line(10, 1), make_line(50, -1)};
  std::vector<LineWindow> windows = {{1000, 2000, {}}, {2000, 4000, {}}};
  std::vector<LineMatch> matches = {{0, 0, 5, false}, {0, 1, 6, true}, {1, 1, 6, false}};
  std::vector<LinePoint> points = std::vector<LinePoint>(36);
  std::vector<EdgePoint> edges = std::vector<EdgePoint>(36);
  std::vector<View> views = std::vector<View>(4);
  EdgePointOptions options;
  EdgePointStats stats;
  ViewsMade made = {99, 99};
  Status make() {
    for (LineWindow& window : windows) window.lines = lines;
    return make_edge_points(options, windows, matches, {points, edges, views}, &made, &stats);
  }
};

}  // namespace

TEST_CASE("edge points: each matched window gives two views about its middle, each edge three points in each") {
  Fixture f;
  REQUIRE(f.make() == Status::ok);
  REQUIRE(f.made.views == 4);
  REQUIRE(f.made.points == 18);
  const std::int64_t times[] = {1320, 1680, 2640, 3360};  // 0.36 of half a window
  const std::uint32_t counts[] = {6, 6, 3, 3};
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(std::abs(f.views[i].t_us - times[i]) <= 1);
    CHECK(f.views[i].count == counts[i]);
  }
  CHECK(f.points[0].line == 5);
  CHECK(f.points[3].line == 6);
  CHECK(f.points[0].u_px == 10.0);
  CHECK(f.points[8].u_px == 110.0);
  CHECK(f.points[6].v_px == 11.0);
  // Weighted by their own sigmas, the three place the edge as well as it says.
  double precision = 0;
  for (std::size_t i = 0; i < 3; ++i) precision += 1 / (f.points[i].sigma_px * f.points[i].sigma_px);
  CHECK(1 / std::sqrt(precision) == doctest::Approx(0.06));
  CHECK(f.stats.lines == 3);
  CHECK(f.stats.flanks == 0);
}

TEST_CASE("edge points: ON is where the edge moves into the dark") {
  Fixture f;
  REQUIRE(f.make() == Status::ok);
  CHECK(f.edges[0].normal_x == doctest::Approx(0));
  CHECK(f.edges[0].normal_y == doctest::Approx(1));
  CHECK(f.edges[0].polarity == 1);
  CHECK(f.edges[0].dark == 1);
  CHECK(f.edges[0].model_side == 1);
  CHECK(f.edges[3].dark == -1);       // OFF
  CHECK(f.edges[3].model_side == 1);  // the match is flipped
  CHECK(f.edges[12].model_side == -1);
  CHECK(double{f.edges[0].along} == doctest::Approx(-0.387).epsilon(0.01));
  CHECK(double{f.edges[3].along} == doctest::Approx(0.387).epsilon(0.01));
  f.lines[0].edge.speed_px_per_s = -500;
  REQUIRE(f.make() == Status::ok);
  CHECK(f.edges[0].dark == -1);
}

TEST_CASE("edge points: blurred edges and missing ones are left out, faint ones too where others suffice") {
  Fixture f;
  f.lines[0].edge.crossings = 0;
  f.lines[1].edge.scatter_px = 0.3F;
  REQUIRE(f.make() == Status::ok);
  CHECK(f.made.points == 0);
  CHECK(f.made.views == 4);
  CHECK(f.stats.without_edge == 1);
  CHECK(f.stats.blurred == 2);

  f.lines = {make_line(10, 1), make_line(50, 1), make_line(90, 1)};
  f.lines[2].edge.events_per_crossing = 1.2F;
  f.windows.resize(1);
  f.matches = {{0, 0, 5, false}, {0, 1, 6, false}, {0, 2, 7, false}};
  REQUIRE(f.make() == Status::ok);
  CHECK(f.made.points == 18);
  CHECK(f.points[6].sigma_px > 2 * f.points[3].sigma_px);  // but less is trusted to them
  f.options.strong_lines = 2;
  REQUIRE(f.make() == Status::ok);
  CHECK(f.made.points == 12);
  CHECK(f.stats.faint == 1);
}

TEST_CASE("edge points: each place has its own speed") {
  Fixture f;
  f.lines[0].edge.y[1][0] += 1;  // 2, 1 and 1 px in 0.36 of 1000 us
  REQUIRE(f.make() == Status::ok);
  CHECK(double{f.edges[0].speed_px_per_s} == doctest::Approx(2 / 360e-6).epsilon(1e-3));
  CHECK(double{f.edges[1].speed_px_per_s} == doctest::Approx(1 / 360e-6).epsilon(1e-3));
}

TEST_CASE("edge points: where all edges scatter more, as out of focus, more is allowed, up to a limit") {
  Fixture f;
  const EdgePointOptions& o = f.options;
  f.lines.assign(30, make_line(10, 1));
  f.windows.resize(1);
  f.matches.clear();
  for (std::uint16_t i = 0; i < 30; ++i) f.matches.push_back({0, i, 5, false});
  f.points.resize(180);
  f.edges.resize(180);
  const auto blurred_of = [&](float usual, float last, std::size_t lines) {
    f.matches.resize(lines);
    for (EventLine& line : f.lines) line.edge.scatter_px = usual;
    f.lines[0].edge.scatter_px = last;
    REQUIRE(f.make() == Status::ok);
    return f.stats.blurred;
  };
  CHECK(blurred_of(0.10F, 0.95F * o.max_scatter_px, 30) == 0);
  CHECK(blurred_of(0.10F, 1.05F * o.max_scatter_px, 30) == 1);
  CHECK(blurred_of(0.20F, 0.95F * o.scatter_over_usual * 0.20F, 30) == 0);
  CHECK(blurred_of(0.20F, 1.05F * o.scatter_over_usual * 0.20F, 30) == 1);
  CHECK(blurred_of(0.30F, 1.05F * o.max_usual_scatter_px, 30) == 1);
  CHECK(blurred_of(0.20F, 0.20F, 10) == 10);  // too few to tell what is usual
  f.matches.assign(30, f.matches.front());
  for (std::uint16_t i = 0; i < 30; ++i) f.matches[i].line = i;
  f.options.max_scatter_px = 0.5F;  // a limit above that of the usual holds
  CHECK(blurred_of(0.20F, 0.45F, 30) == 0);
}

TEST_CASE("edge points: a drawn line has two flanks, dark between them") {
  Fixture f;
  f.windows.resize(1);
  f.matches = {{0, 0, 5, false}};
  // Moving down, the line at 10 is OFF: it is dark above. So it is the lower flank, and ON comes behind it.
  f.lines = {make_line(10, -1), make_line(7, 1), make_line(5, 1), make_line(12, 1), make_line(9, -1)};
  REQUIRE(f.make() == Status::ok);
  REQUIRE(f.made.points == 12);
  CHECK(f.points[3].line == 5);
  CHECK(f.points[3].v_px == 7.0);  // the nearest of those on that side
  CHECK(f.edges[0].model_side == -1);
  CHECK(f.edges[3].model_side == 1);
  CHECK(f.stats.flanks == 1);

  f.points.resize(11);  // room for what is matched alone
  REQUIRE(f.make() == Status::ok);
  CHECK(f.made.points == 9);
  CHECK(f.stats.flanks == 1);
  CHECK(f.stats.flanks_dropped == 1);
  f.points.resize(36);

  f.matches.push_back({0, 1, 6, false});  // it has a line of its own
  REQUIRE(f.make() == Status::ok);
  CHECK(f.points[3].v_px == 5.0);
  f.matches.pop_back();
  f.lines.resize(2);
  f.lines[1].edge.speed_px_per_s = -500;  // it moves the other way
  REQUIRE(f.make() == Status::ok);
  CHECK(f.made.points == 6);
  f.lines[1] = make_line(1, 1);  // it is too far away
  REQUIRE(f.make() == Status::ok);
  CHECK(f.made.points == 6);
}

TEST_CASE("edge points: what does not fit or is out of order is refused, and nothing is told") {
  Fixture f;
  f.points.resize(17);
  CHECK(f.make() == Status::capacity_exceeded);
  f.points.resize(18);
  f.edges.resize(17);
  CHECK(f.make() == Status::capacity_exceeded);
  f.edges.resize(18);
  f.views.resize(3);
  CHECK(f.make() == Status::capacity_exceeded);
  f.views.resize(4);
  f.matches[2].line = 2;
  CHECK(f.make() == Status::invalid_argument);
  f.matches[2] = {2, 0, 6, false};
  CHECK(f.make() == Status::invalid_argument);
  f.matches = {{1, 0, 5, false}, {0, 0, 5, false}};
  CHECK(f.make() == Status::invalid_argument);
  CHECK(f.made.points == 99);
  CHECK(f.made.views == 99);
}
