// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/mono_solver.hpp"

#include <doctest/doctest.h>

#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "support/guarded_arena.hpp"
#include "support/shared_data.hpp"
#include "support/solver_run.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

using test::SyntheticViews;

using Run = test::SolverRun;
using test::capacities_for;

double relative_error(const Camera& a, const Camera& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    const double scale = i < 4 ? b.*kIntrinsics[i] : 1.0;
    worst = std::max(worst, std::abs(a.*kIntrinsics[i] - b.*kIntrinsics[i]) / scale);
  }
  return worst;
}

/// No prior at all, so that noise-free data give the truth to rounding.
MonoSolverOptions without_priors() {
  MonoSolverOptions options;
  options.policy.focal_sd = 0.0;
  options.policy.planar_centre_sd = 0.0;
  options.policy.spatial_centre_sd = 0.0;
  options.policy.radial_sd = options.policy.higher_radial_sd = 0.0;
  return options;
}

SyntheticViews spatial_view(double noise_px, std::uint64_t seed, int lines = 25) {
  Rng rng(seed);
  SyntheticViews s;
  s.camera = test::make_camera(400.0, 410.0, 322.0, 236.0, -0.1, 0.03);
  s.model = test::random_lines(rng, lines, 1.5, 1.2, 1.0);
  s.add_view(test::looking_pose(rng, 4.0, 0.5), 2, noise_px, 1.0, rng);
  return s;
}

SyntheticViews planar_views(int count, double noise_px, std::uint64_t seed) {
  Rng rng(seed);
  SyntheticViews s;
  s.camera = test::make_camera(400.0, 410.0, 330.0, 230.0, -0.2, 0.05);
  s.model = test::random_lines(rng, 12, 1.2, 0.9, 0.0);
  for (int v = 0; v < count; ++v) s.add_view(test::looking_pose(rng, 3.0, 0.6), 5, noise_px, 1.0, rng);
  return s;
}

TEST_CASE("noise-free: one spatial view gives all intrinsics and the pose to 1e-9") {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const SyntheticViews s = spatial_view(0.0, seed);
    const Run run(s.data(), without_priors());
    REQUIRE(run.status == Status::ok);
    CHECK(relative_error(run.result().camera, s.camera) < 1e-9);
    CHECK((rotation_of(run.result().views[0].T_cam_world) - rotation_of(s.poses[0])).norm() < 1e-9);
    CHECK((translation_of(run.result().views[0].T_cam_world) - translation_of(s.poses[0])).norm() < 1e-8);
    CHECK(run.result().rms_px < 1e-9);
  }
}

TEST_CASE("noise-free: planar views give all intrinsics to 1e-9") {
  const SyntheticViews s = planar_views(6, 0.0, 3);
  MonoSolverOptions options = without_priors();
  options.policy.tangential_sd = 1e6;
  const Run run(s.data(), options);
  REQUIRE(run.status == Status::ok);
  CHECK(relative_error(run.result().camera, s.camera) < 1e-9);
}

TEST_CASE("noise-free: the default priors move nothing by more than a tenth of its sigma") {
  const SyntheticViews s = spatial_view(0.0, 1);
  const Run run(s.data());
  REQUIRE(run.status == Status::ok);
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(std::abs(run.result().camera.*kIntrinsics[i] - s.camera.*kIntrinsics[i]) < 0.1 * run.result().sigma[i]);
  }
}

TEST_CASE("noise: errors stay within five reported sigmas, and one planar view lists its centre as assumed") {
  int beyond_two = 0;
  for (std::uint64_t seed = 10; seed < 20; ++seed) {
    const SyntheticViews s = planar_views(6, 0.5, seed);
    const Run run(s.data());
    REQUIRE(run.status == Status::ok);
    for (std::size_t i = 0; i < 6; ++i) {
      const double error = std::abs(run.result().camera.*kIntrinsics[i] - s.camera.*kIntrinsics[i]);
      CHECK(error < 5.0 * run.result().sigma[i]);
      beyond_two += error > 2.0 * run.result().sigma[i] ? 1 : 0;
      if (i < 4) CHECK_FALSE(run.result().assumed[i]);
    }
  }
  CHECK(beyond_two <= 10);  // of 60; 3 expected

  Rng rng(40);
  SyntheticViews one = planar_views(0, 0.0, 21);
  one.camera = test::make_camera(400.0, 410.0, 322.0, 238.0, -0.1, 0.03);
  one.add_view(make_pose(so3_exp(Vec3(0.5, -0.6, 0.1)), Vec3(0.1, 0.0, 2.5)), 7, 0.2, 0.2, rng);
  const Run run(one.data());
  REQUIRE(run.status == Status::ok);
  CHECK(std::abs(run.result().camera.fx - 400.0) < 5.0 * run.result().sigma[0]);
  CHECK(run.result().assumed[2]);
  CHECK(run.result().assumed[3]);
  CHECK(run.result().assumed[8]);
  CHECK_FALSE(run.result().assumed[0]);
}

TEST_CASE("a start from elsewhere leads to the same answer") {
  const SyntheticViews s = planar_views(4, 0.3, 5);
  const Run own(s.data());
  REQUIRE(own.status == Status::ok);
  std::vector<Pose> poses = s.poses;
  for (Pose& pose : poses) pose.t[2] *= 1.1;
  const MonoStart start{test::make_camera(450.0, 450.0, 319.5, 239.5), poses};
  const Run given(s.data(), {}, &start);
  REQUIRE(given.status == Status::ok);
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    const double difference = given.result().camera.*kIntrinsics[i] - own.result().camera.*kIntrinsics[i];
    CHECK(std::abs(difference) <= 0.01 * own.result().sigma[i]);
  }
}

TEST_CASE("a tenth of wrong points moves the answer less, the more robust the loss is") {
  SyntheticViews s = planar_views(6, 0.3, 6);
  const Run clean(s.data());
  Rng rng(50);
  for (std::size_t i = 0; i < s.points.size(); i += 10) s.points[i].v_px += 20.0 * rng.uniform(-1.0, 1.0);
  const auto error_with = [&](Loss loss) {
    MonoSolverOptions options;
    options.reject_lines = false;
    options.loss = loss;
    const Run run(s.data(), options);
    REQUIRE(run.status == Status::ok);
    return std::abs(run.result().camera.fx - clean.result().camera.fx);
  };
  REQUIRE(clean.status == Status::ok);
  const double squared = error_with(Loss::squared);
  const double huber = error_with(Loss::huber);
  const double geman = error_with(Loss::geman);
  CHECK(huber < squared);
  CHECK(geman < huber);
  CHECK(geman < 2.0 * clean.result().sigma[0]);
}

TEST_CASE("the same data give the same bits, on memory of any content and in any order of views") {
  const SyntheticViews s = planar_views(5, 0.3, 7);
  const Run first(s.data());
  const Run second(s.data());
  CHECK(std::memcmp(&first.result().camera, &second.result().camera, sizeof(Camera)) == 0);
  SyntheticViews reversed = s;
  std::reverse(reversed.views.begin(), reversed.views.end());
  const Run third(reversed.data());
  CHECK(relative_error(third.result().camera, first.result().camera) < 1e-6);
}

TEST_CASE("capacities: exactly enough works, one less of anything is refused") {
  const SyntheticViews s = planar_views(3, 0.1, 8);
  const CalibrationData data = s.data();
  const MonoSolverCapacities enough = capacities_for(data);
  const auto init_with = [&](const MonoSolverCapacities& capacities) {
    test::GuardedArena memory(required_bytes(capacities));
    MonoSolverWorkspace workspace;
    REQUIRE(carve(memory.arena(), capacities, &workspace));
    CHECK(memory.arena().peak() == required_bytes(capacities));
    MonoSolver solver;
    return solver.init(data, {}, workspace);
  };
  CHECK(init_with(enough) == Status::ok);
  CHECK(init_with({enough.views - 1, enough.points, enough.model_lines}) == Status::capacity_exceeded);
  CHECK(init_with({enough.views, enough.points - 1, enough.model_lines}) == Status::capacity_exceeded);
  CHECK(init_with({enough.views, enough.points, enough.model_lines - 1}) == Status::capacity_exceeded);
  MonoSolverWorkspace workspace;
  test::GuardedArena short_by_one(required_bytes(enough) - 1);
  CHECK_FALSE(carve(short_by_one.arena(), enough, &workspace));
}

TEST_CASE("capacities: a workspace that lacks one element of one array is refused") {
  const SyntheticViews s = planar_views(3, 0.1, 8);
  CalibrationData data = s.data();
  std::vector<EdgePoint> edges(data.points.size());
  for (EdgePoint& edge : edges) edge.normal_x = 1;
  const MonoStart start{s.camera, s.poses};
  for (const bool on_edges : {false, true}) {
    if (on_edges) data.edges = edges;
    const MonoSolverCapacities capacities = capacities_for(data);
    test::GuardedArena memory(required_bytes(capacities));
    MonoSolverWorkspace whole;
    REQUIRE(carve(memory.arena(), capacities, &whole));
    MonoSolver solver;
    const auto init = [&](const MonoSolverWorkspace& workspace) {
      return on_edges ? solver.init_on_edges(data, {}, workspace, start) : solver.init(data, {}, workspace, start);
    };
    CHECK(init(whole) == Status::ok);
    const int arrays = on_edges ? 23 : 13;
    for (int shortened = 0; shortened < arrays; ++shortened) {
      CAPTURE(shortened);
      MonoSolverWorkspace less = whole;
      int index = 0;
      const auto shorten = [&](auto&... array) {
        ((array = array.first(array.size() - (index++ == shortened ? 1 : 0))), ...);
      };
      shorten(less.guess.sums, less.guess.lines, less.guess.linear, less.guess.focal_lengths, less.guess.views,
              less.residuals, less.sorted_residuals, less.feet, less.results, less.line_results, less.left_out,
              less.chosen, less.responses);
      EdgeOffsetWorkspace& offsets = less.offsets;
      shorten(less.corrected, less.wrong_edges, offsets.value, offsets.sigma, offsets.slot, offsets.active,
              offsets.matrix, offsets.gradient, offsets.by_camera, offsets.by_pose);
      CHECK(init(less) == Status::capacity_exceeded);
    }
  }
}

TEST_CASE("wrong use is refused") {
  const SyntheticViews s = planar_views(3, 0.1, 8);
  MonoSolver idle;
  CHECK(idle.step() == Status::wrong_state);
  const MonoStart short_start{s.camera, Span<const Pose>(s.poses).first(2)};
  CHECK(Run(s.data(), {}, &short_start).status == Status::invalid_argument);
  MonoSolverOptions options;
  options.max_attempts = 0;
  CHECK(Run(s.data(), options).status == Status::invalid_argument);
  SyntheticViews broken = s;
  broken.points[3].sigma_px = 0.0;
  CHECK(Run(broken.data()).status == Status::invalid_argument);
}

TEST_CASE("views with too few lines are left out and counted") {
  SyntheticViews s = planar_views(5, 0.2, 10);
  s.views[2].count = 10;  // two lines of five points
  const Run run(s.data());
  REQUIRE(run.status == Status::ok);
  CHECK(run.result().views_left_out == 1);
  CHECK_FALSE(run.result().views[2].used);
  CHECK(run.result().views[2].lines == 2);
  CHECK(run.result().views[1].used);
  CHECK(run.result().views[1].lines == 12);
}

// ----------------------------------------------------------------- a real camera

/// The 27 views of a chessboard; solves the views with index % step == first.
SyntheticViews read_chessboard(const std::filesystem::path& folder, int first, int step) {
  SyntheticViews s;
  s.camera = test::make_camera(0, 0, 0, 0);
  std::map<std::string, std::uint16_t> names;
  std::string row;
  for (std::ifstream file(folder / "model.txt"); std::getline(file, row);) {
    if (row.empty() || row[0] == '#') continue;
    std::istringstream in(row);
    ModelLine line{};
    std::string name;
    for (double& x : line.p) in >> x;
    for (double& x : line.q) in >> x;
    in >> name;
    names[name] = static_cast<std::uint16_t>(s.model.size());
    s.model.push_back(line);
  }
  std::string view_name;
  int index = -1;
  std::ifstream file(folder / "observations.csv");
  std::getline(file, row);
  while (std::getline(file, row)) {
    std::istringstream in(row);
    std::string view, line, u, v;
    std::getline(in, view, ',');
    std::getline(in, line, ',');
    std::getline(in, u, ',');
    std::getline(in, v, ',');
    if (view != view_name) {
      view_name = view;
      if (++index % step == first) s.views.push_back({index, static_cast<std::uint32_t>(s.points.size()), 0});
    }
    if (index % step != first) continue;
    s.points.push_back({std::stod(u), std::stod(v), 1.0, names.at(line)});
    ++s.views.back().count;
  }
  return s;
}

TEST_CASE("gen3_chessboard: within 1 % and 2 px of the published camera, sigma below 0.5 %, halves agree") {
  const auto data = test::shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  MonoSolverOptions options;
  options.covariance.trust_sigma = false;
  const SyntheticViews all = read_chessboard(*data / "real" / "gen3_chessboard", 0, 1);
  REQUIRE(all.views.size() == 27);
  const Run run(all.data(), options);
  REQUIRE(run.status == Status::ok);
  const Camera& c = run.result().camera;
  CHECK(std::abs(c.fx - 327.485) < 0.01 * 327.485);
  CHECK(std::abs(c.fy - 327.554) < 0.01 * 327.554);
  CHECK(std::abs(c.cx - 318.535) < 2.0);
  CHECK(std::abs(c.cy - 230.964) < 2.0);
  CHECK(run.result().sigma[0] < 0.005 * c.fx);
  CHECK(run.result().views_left_out == 0);
  const SyntheticViews odd = read_chessboard(*data / "real" / "gen3_chessboard", 1, 2);
  const SyntheticViews even = read_chessboard(*data / "real" / "gen3_chessboard", 0, 2);
  const Run odd_run(odd.data(), options);
  const Run even_run(even.data(), options);
  REQUIRE(odd_run.status == Status::ok);
  REQUIRE(even_run.status == Status::ok);
  const double sigma = std::hypot(odd_run.result().sigma[0], even_run.result().sigma[0]);
  CHECK(std::abs(odd_run.result().camera.fx - even_run.result().camera.fx) < 4.0 * sigma);
}

}  // namespace
}  // namespace lecalib
