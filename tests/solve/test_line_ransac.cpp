// SPDX-License-Identifier: MIT
#include "lecalib/solve/line_ransac.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

struct Search {
  explicit Search(const test::SyntheticViews& s)
      : sums(s.model.size()), lines(s.model.size()), chosen(s.model.size()), left_out(s.points.size(), 7) {}

  Status run(const test::SyntheticViews& s, const LineRansacOptions& options = {}) {
    const Status ready = ransac.init(s.data(), options, {sums, lines, chosen}, left_out);
    if (ready != Status::ok) return ready;
    Status status = Status::in_progress;
    while (status == Status::in_progress) {
      status = ransac.step();
      ++steps;
    }
    return status;
  }

  std::vector<LineSums> sums;
  std::vector<ViewLine> lines, chosen;
  std::vector<std::uint8_t> left_out;
  LineRansac ransac;
  int steps = 0;
};

/// Views in which each line with (line + view) % period == 0 is replaced by a random one. period 0: none.
test::SyntheticViews make_views(double depth, int views, std::size_t period, std::uint64_t seed) {
  Rng rng(seed);
  test::SyntheticViews s;
  s.camera = test::make_camera(400.0, 400.0, 319.5, 239.5, -0.15, 0.02);
  s.model = test::random_lines(rng, 20, 1.5, 1.2, depth);
  for (int v = 0; v < views; ++v) s.add_view(test::looking_pose(rng, 4.0, 0.5), 2, 0.5, 1.0, rng);
  for (std::size_t v = 0; v < s.views.size(); ++v) {
    for (std::size_t i = s.views[v].first; i < s.views[v].first + s.views[v].count; ++i) {
      if (period == 0 || (s.points[i].line + v) % period != 0) continue;
      s.points[i].u_px = rng.uniform(0.0, 640.0);
      s.points[i].v_px = rng.uniform(0.0, 480.0);
    }
  }
  return s;
}

bool is_replaced(const test::SyntheticViews& s, std::size_t view, std::size_t point, std::size_t period) {
  return period != 0 && (s.points[point].line + view) % period == 0;
}

TEST_CASE("random lines are left out and right ones kept, in a plane and in space, with distortion and noise") {
  for (const double depth : {0.0, 1.0}) {
    const std::size_t period = 4;
    std::size_t right = 0;
    std::size_t right_kept = 0;
    std::size_t wrong_kept = 0;
    for (std::uint64_t seed = 1; seed < 8; ++seed) {
      const auto s = make_views(depth, 2, period, seed);
      Search search(s);
      REQUIRE(search.run(s) == Status::ok);
      for (std::size_t v = 0; v < s.views.size(); ++v) {
        for (std::size_t i = s.views[v].first; i < s.views[v].first + s.views[v].count; ++i) {
          const bool kept = search.left_out[i] == 0;
          const bool replaced = is_replaced(s, v, i, period);
          right += replaced ? 0 : 1;
          right_kept += !replaced && kept ? 1 : 0;
          wrong_kept += replaced && kept ? 1 : 0;
        }
      }
    }
    CHECK(right_kept >= right * 95 / 100);  // the reach need not cover the last bit of distortion
    CHECK(wrong_kept <= right / 50);
  }
}

TEST_CASE("the same seed marks the same points") {
  const auto s = make_views(1.0, 2, 3, 20);
  Search first(s);
  Search second(s);
  CHECK(first.run(s) == second.run(s));
  CHECK(first.left_out == second.left_out);
  CHECK(first.steps == second.steps);
}

TEST_CASE("work is bounded by the samples allowed") {
  const auto s = make_views(1.0, 3, 2, 21);
  Search search(s);
  LineRansacOptions options;
  options.max_samples = 10;
  (void)search.run(s, options);
  CHECK(search.steps <= 3 * 5 * (10 + 1) + 1);  // views, straightenings, samples and what ends each
}

TEST_CASE("a view whose lines do not agree is left out whole, and none left is an error") {
  auto s = make_views(0.0, 2, 0, 22);
  Rng rng(23);
  for (std::size_t i = s.views[1].first; i < s.points.size(); ++i) {
    s.points[i].u_px = rng.uniform(0.0, 640.0);
    s.points[i].v_px = rng.uniform(0.0, 480.0);
  }
  Search search(s);
  REQUIRE(search.run(s) == Status::ok);
  for (std::size_t i = s.views[1].first; i < s.points.size(); ++i) CHECK(search.left_out[i] != 0);
  s.views[0].count = 8;  // four lines: any four agree
  Search none(s);
  CHECK(none.run(s) == Status::degenerate_geometry);
}

TEST_CASE("wrong options and short memory are refused") {
  const auto s = make_views(0.0, 1, 0, 24);
  for (int k = 0; k < 5; ++k) {
    LineRansacOptions options;
    if (k == 0) options.max_samples = 0;
    if (k == 1) options.failure = 0.0;
    if (k == 2) options.failure = 1.0;
    if (k == 3) options.reach_share = 0.0;
    if (k == 4) options.min_right_share = 1.5;
    CHECK(Search(s).run(s, options) == Status::invalid_argument);
  }
  Search few(s);
  few.chosen.pop_back();
  CHECK(few.run(s) == Status::capacity_exceeded);
  Search fewer(s);
  fewer.left_out.pop_back();
  CHECK(fewer.run(s) == Status::capacity_exceeded);
}

}  // namespace
}  // namespace lecalib
