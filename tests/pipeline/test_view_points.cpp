// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <vector>

#include "lecalib/pipeline/view_points.hpp"

using namespace lecalib;

namespace {

EventLine make_line(float y) {
  EventLine line{};
  line.begin = {0, y, 100, y};
  line.end = {0, y + 5, 100, y + 5};
  line.bend_px = 4;
  line.sigma_begin_px = 0.3F;
  line.sigma_end_px = 0.6F;
  return line;
}

struct Fixture {
  std::vector<EventLine> lines = {make_line(10), make_line(50)};
  std::array<LineWindow, 3> windows = {{{0, 100, lines}, {100, 200, lines}, {200, 300, lines}}};
  std::vector<LineMatch> matches = {{0, 1, 7, false}, {0, 0, 3, true}, {2, 0, 3, false}};
  std::vector<LinePoint> points = std::vector<LinePoint>(18);
  std::vector<View> views = std::vector<View>(4);
  ViewsMade made = {99, 99};
  Status make(const ViewPointOptions& options = {}) {
    return make_view_points(options, windows, matches, points, views, &made);
  }
};

}  // namespace

TEST_CASE("each matched window gives a view at its begin and one at its end") {
  Fixture f;
  REQUIRE(f.make() == Status::ok);
  REQUIRE(f.made.views == 4);
  REQUIRE(f.made.points == 18);
  const std::int64_t times[] = {0, 100, 200, 300};
  const std::uint32_t firsts[] = {0, 6, 12, 15};
  const std::uint32_t counts[] = {6, 6, 3, 3};
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(f.views[i].t_us == times[i]);
    CHECK(f.views[i].first == firsts[i]);
    CHECK(f.views[i].count == counts[i]);
  }
  CHECK(f.points[0].line == 7);
  CHECK(f.points[3].line == 3);
  CHECK(f.points[9].line == 3);
}

TEST_CASE("the points of a line follow its bend") {
  Fixture f;
  REQUIRE(f.make() == Status::ok);
  // The normal of a line to the right is (0, 1): the middle lies 4 px below the chord.
  const double expected[3][2] = {{0, 50}, {50, 54}, {100, 50}};
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(std::abs(f.points[i].u_px - expected[i][0]) < 1e-12);
    CHECK(std::abs(f.points[i].v_px - expected[i][1]) < 1e-12);
    CHECK(std::abs(f.points[6 + i].v_px - expected[i][1] - 5) < 1e-12);
  }
}

TEST_CASE("however many points stand for a line, it weighs as much as its two ends") {
  for (std::uint32_t n = 3; n <= kMaxPointsPerLine; ++n) {
    Fixture f;
    f.points.resize(6 * n);
    REQUIRE(f.make({n, 0}) == Status::ok);
    double begin = 0;
    double end = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      begin += 1 / (f.points[i].sigma_px * f.points[i].sigma_px);
      end += 1 / (f.points[2 * n + i].sigma_px * f.points[2 * n + i].sigma_px);
    }
    CHECK(begin == doctest::Approx(2 / (0.3 * 0.3)).epsilon(1e-6));
    CHECK(end == doctest::Approx(2 / (0.6 * 0.6)).epsilon(1e-6));
  }
}

TEST_CASE("no line is known better than its events' common delay lets it be") {
  Fixture f;
  ViewPointOptions options;
  options.least_sigma_px = 0.5F;
  REQUIRE(f.make(options) == Status::ok);
  CHECK(f.points[0].sigma_px == doctest::Approx(0.5 * std::sqrt(1.5)).epsilon(1e-6));  // 0.3 by itself
  CHECK(f.points[6].sigma_px == doctest::Approx(0.6 * std::sqrt(1.5)).epsilon(1e-6));
}

TEST_CASE("wrong arguments leave the outputs alone") {
  Fixture f;
  SUBCASE("too few points") { CHECK(f.make({2, 0}) == Status::invalid_argument); }
  SUBCASE("too many points") { CHECK(f.make({kMaxPointsPerLine + 1, 0}) == Status::invalid_argument); }
  SUBCASE("a window that is not there") {
    f.matches[2].window = 3;
    CHECK(f.make() == Status::invalid_argument);
  }
  SUBCASE("a line that is not there") {
    f.matches[2].line = 2;
    CHECK(f.make() == Status::invalid_argument);
  }
  SUBCASE("matches not in order") {
    f.matches[0].window = 2;
    CHECK(f.make() == Status::invalid_argument);
  }
  SUBCASE("one point too few") {
    f.points.pop_back();
    CHECK(f.make() == Status::capacity_exceeded);
  }
  SUBCASE("one view too few") {
    f.views.pop_back();
    CHECK(f.make() == Status::capacity_exceeded);
  }
  CHECK(f.made.points == 99);
  CHECK(f.made.views == 99);
}
