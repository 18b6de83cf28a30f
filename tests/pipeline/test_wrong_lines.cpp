// SPDX-License-Identifier: MIT
/// Some lines belong elsewhere: the solver finds which, and answers as if they had not been there.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "support/solver_run.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

using test::SyntheticViews;
using Run = test::SolverRun;

/// 25 lines, of which the first `wrong` are replaced by random ones.
SyntheticViews spoilt_view(double depth, int wrong, std::uint64_t seed) {
  Rng rng(seed);
  SyntheticViews s;
  s.camera = test::make_camera(400.0, 410.0, 322.0, 236.0, -0.1, 0.03);
  s.model = test::random_lines(rng, 25, 1.5, 1.2, depth);
  s.add_view(test::slanted_pose(), 2, 0.5, 0.5, rng);
  for (LinePoint& point : s.points) {
    if (point.line >= wrong) continue;
    point.u_px = rng.uniform(0.0, 640.0);
    point.v_px = rng.uniform(0.0, 480.0);
  }
  return s;
}

/// The same without the replaced lines.
SyntheticViews cleaned(SyntheticViews s, int wrong) {
  const auto is_wrong = [&](const LinePoint& point) { return point.line < wrong; };
  s.points.erase(std::remove_if(s.points.begin(), s.points.end(), is_wrong), s.points.end());
  s.views[0].count = static_cast<std::uint32_t>(s.points.size());
  return s;
}

TEST_CASE("with 30 % of wrong lines the answer is that of the right ones, in a plane and in space") {
  constexpr int kWrong = 8;
  constexpr int kTrials = 100;
  for (const double depth : {0.0, 1.0}) {
    int same = 0;
    for (std::uint64_t seed = 0; seed < kTrials; ++seed) {
      const SyntheticViews s = spoilt_view(depth, kWrong, 200 + seed);
      const Run spoilt(s.data());
      const SyntheticViews right = cleaned(s, kWrong);
      const Run clean(right.data());
      REQUIRE(clean.status == Status::ok);
      if (spoilt.status != Status::ok) continue;
      bool near = true;
      for (std::size_t i = 0; i < 6; ++i) {
        const double difference = spoilt.result().camera.*kIntrinsics[i] - clean.result().camera.*kIntrinsics[i];
        near = near && std::abs(difference) <= 0.2 * clean.result().sigma[i];
      }
      same += near ? 1 : 0;
    }
    CHECK(same >= kTrials - 3);  // a random line may lie where a right one could
  }
}

TEST_CASE("a wrong line near its place is found, though it spoils the spread by which lines are judged") {
  int found = 0;
  constexpr int kTrials = 20;
  for (std::uint64_t seed = 0; seed < kTrials; ++seed) {
    SyntheticViews s = spoilt_view(0.0, 6, 300 + seed);
    REQUIRE(s.points[12].line == 6);
    REQUIRE(s.points[13].line == 6);
    const Vec2 along(s.points[13].u_px - s.points[12].u_px, s.points[13].v_px - s.points[12].v_px);
    for (std::size_t i = 12; i < 14; ++i) {  // across the line, 10 sigma, before the solution gives way
      s.points[i].u_px -= 5.0 * along(1) / along.norm();
      s.points[i].v_px += 5.0 * along(0) / along.norm();
    }
    const Run run(s.data());
    if (run.status == Status::ok && run.solver.left_out().size() == s.points.size() && run.result().lines_left_out == 7)
      ++found;
  }
  CHECK(found >= kTrials - 2);
}

TEST_CASE("wrong lines are marked and counted, right data are not touched") {
  const SyntheticViews s = spoilt_view(1.0, 5, 230);
  const Run run(s.data());
  REQUIRE(run.status == Status::ok);
  CHECK(run.result().lines_left_out == 5);
  REQUIRE(run.solver.left_out().size() == s.points.size());
  for (std::size_t i = 0; i < s.points.size(); ++i) CHECK((run.solver.left_out()[i] != 0) == (s.points[i].line < 5));
  CHECK(run.result().points == 40);
  CHECK(run.result().views[0].lines == 20);

  const SyntheticViews clean = spoilt_view(1.0, 0, 231);
  const Run untouched(clean.data());
  REQUIRE(untouched.status == Status::ok);
  CHECK(untouched.result().lines_left_out == 0);
  CHECK(untouched.solver.left_out().empty());
}

TEST_CASE("without rejection the same lines are trusted, and the answer is refused") {
  const SyntheticViews s = spoilt_view(1.0, 8, 232);
  MonoSolverOptions options;
  options.reject_lines = false;
  CHECK(is_error(Run(s.data(), options).status));
}

TEST_CASE("the same seed gives the same bits") {
  const SyntheticViews s = spoilt_view(0.0, 8, 233);
  const Run first(s.data());
  const Run second(s.data());
  CHECK(std::memcmp(&first.result().camera, &second.result().camera, sizeof(Camera)) == 0);
  CHECK(first.steps == second.steps);
}

TEST_CASE("some wrong lines in each of several views, others in each") {
  Rng rng(234);
  SyntheticViews s;
  s.camera = test::make_camera(400.0, 410.0, 330.0, 230.0, -0.2, 0.05);
  s.model = test::random_lines(rng, 16, 1.2, 0.9, 0.0);
  for (int v = 0; v < 5; ++v) s.add_view(test::looking_pose(rng, 3.0, 0.6), 3, 0.3, 0.3, rng);
  std::size_t wrong = 0;
  for (std::size_t v = 0; v < s.views.size(); ++v) {
    for (std::size_t i = s.views[v].first; i < s.views[v].first + s.views[v].count; ++i) {
      LinePoint& point = s.points[i];
      if ((point.line + v) % 4 != 0) continue;
      if (i == s.views[v].first || s.points[i - 1].line != point.line) ++wrong;
      point.u_px = rng.uniform(0.0, 640.0);
      point.v_px = rng.uniform(0.0, 480.0);
    }
  }
  const Run run(s.data());
  REQUIRE(run.status == Status::ok);
  CHECK(run.result().lines_left_out == wrong);
  CHECK(run.result().views_left_out == 0);
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(std::abs(run.result().camera.*kIntrinsics[i] - s.camera.*kIntrinsics[i]) < 5.0 * run.result().sigma[i]);
  }
}

TEST_CASE("wrong points cost themselves, not their lines") {
  Rng rng(235);
  SyntheticViews s;
  s.camera = test::make_camera(400.0, 410.0, 330.0, 230.0, -0.2, 0.05);
  s.model = test::random_lines(rng, 12, 1.2, 0.9, 0.0);
  for (int v = 0; v < 6; ++v) s.add_view(test::looking_pose(rng, 3.0, 0.6), 5, 0.3, 0.3, rng);
  std::uint32_t wrong = 0;
  for (std::size_t i = 0; i < s.points.size(); i += 10, ++wrong) s.points[i].v_px += i % 20 == 0 ? 40.0 : -40.0;
  const Run run(s.data());
  REQUIRE(run.status == Status::ok);
  CHECK(run.result().points + wrong >= s.points.size());  // a shift along the line leaves a point on it
  CHECK(run.result().lines_left_out == 0);
  CHECK(std::abs(run.result().camera.fx - s.camera.fx) < 5.0 * run.result().sigma[0]);
}

}  // namespace
}  // namespace lecalib
