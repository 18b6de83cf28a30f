// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "matcher_bench.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

/// A sheet seen all but frontally: its lines fit cameras of any focal length.
SceneOptions frontal_sheet(std::uint64_t seed) {
  SceneOptions options;
  options.camera = camera_640();
  options.model = rectangle_model(0.3, 0.28);
  options.eye = Vec3(0.15, 0.1, 0.9);
  options.target = Vec3(0.15, 0.14, 0.0);
  options.missing = 0.0;
  options.sway = 0.1;
  options.seed = seed;
  return options;
}

MatchHints focal_hint(double focal_px) {
  MatchHints hints;
  hints.focal_px = focal_px;
  return hints;
}

MatchHints pose_hint(const Pose& pose, const Vec3& turn, double distance) {
  MatchHints hints;
  hints.has_pose = true;
  hints.T_cam_world = make_pose(so3_exp(turn) * rotation_of(pose), distance * translation_of(pose));
  return hints;
}

double turn_between(const Pose& a, const Pose& b) {
  return so3_log(rotation_of(a) * rotation_of(b).transpose()).norm();
}

}  // namespace

TEST_CASE("match_hints: a focal length decides where a frontal sheet leaves it open") {
  int far_off = 0;
  int close = 0;
  constexpr int kSeeds = 8;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    CAPTURE(seed);
    const SceneOptions options = frontal_sheet(seed);
    const Scene scene = make_scene(options);
    Bench blind;
    REQUIRE(blind.init(scene, options) == Status::ok);
    const bool found = blind.run() == Status::ok;
    if (!found || std::abs(blind.matcher.camera().fx / options.camera.fx - 1.0) > 0.2) ++far_off;
    Bench hinted;
    REQUIRE(hinted.init(scene, options, focal_hint(1.05 * options.camera.fx)) == Status::ok);
    if (hinted.run() == Status::ok && std::abs(hinted.matcher.camera().fx / options.camera.fx - 1.0) < 0.15) ++close;
  }
  CHECK(far_off >= kSeeds / 2);
  CHECK(close >= kSeeds - 1);
}

TEST_CASE("match_hints: a rough pose picks one of the labelings of a symmetric object") {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    CAPTURE(seed);
    SceneOptions options;
    options.camera = camera_640();
    options.model = rectangle_model(0.297, 0.21);
    options.eye = Vec3(-0.15, -0.25, 0.4);
    options.target = Vec3(0.15, 0.1, 0.0);
    options.missing = 0.0;
    options.seed = seed;
    const Scene scene = make_scene(options);
    // The sheet's own symmetry: half a turn about its normal through its centre.
    const Mat3 half = so3_exp(Vec3(0, 0, 3.141592653589793));
    const Vec3 centre(0.1485, 0.105, 0.0);
    const Mat3 R = rotation_of(scene.begin[0]) * half;
    const Pose turned =
        make_pose(R, translation_of(scene.begin[0]) + rotation_of(scene.begin[0]) * centre - R * centre);
    for (const Pose& pose : {scene.begin[0], turned}) {
      Bench bench;
      REQUIRE(bench.init(scene, options, pose_hint(pose, Vec3(0.1, -0.1, 0.1), 1.15)) == Status::ok);
      REQUIRE(bench.run() == Status::ok);
      CHECK(bench.matcher.camera().fx == doctest::Approx(options.camera.fx).epsilon(0.06));
      CHECK_FALSE(bench.matcher.stats().against_hint);
      const WindowPoses& first = bench.matcher.poses()[0];
      REQUIRE(first.window == 0);
      CHECK(turn_between(first.begin, pose) < 0.1);
    }
  }
}

TEST_CASE("match_hints: wrong hints do not keep the right camera from being found") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    CAPTURE(seed);
    SceneOptions options;
    options.camera = camera_640();
    options.model = box_model(0.4, 0.3, 0.25);
    options.seed = seed;
    const Scene scene = make_scene(options);
    const Pose& pose = scene.begin[0];
    for (const MatchHints& wrong : {focal_hint(0.6 * options.camera.fx), focal_hint(2.0 * options.camera.fx),
                                    focal_hint(40.0), pose_hint(pose, Vec3(0, 0, 1.6), 1.0),
                                    pose_hint(pose, Vec3(0, 2.0, 0), 0.5), pose_hint(pose, Vec3(0, 0, 0), -1.0)}) {
      Bench bench;
      REQUIRE(bench.init(scene, options, wrong) == Status::ok);
      const Status status = bench.run();
      if (status == Status::no_match) continue;
      REQUIRE(status == Status::ok);
      CHECK(bench.matcher.camera().fx == doctest::Approx(options.camera.fx).epsilon(0.04));
      CHECK(bench.matcher.stats().against_hint);
    }
  }
}

TEST_CASE("match_hints: a hint widens the range of views to itself") {
  SceneOptions options;
  options.camera = camera_640();
  options.camera.fx = options.camera.fy = 2600.0;  // 14 degrees; without a hint 20 are the least
  options.camera.k1 = options.camera.k2 = 0.0;
  options.model = box_model(0.4, 0.3, 0.25);
  options.eye = Vec3(-2.4, -2.8, 3.2);
  options.sway = 0.04;
  options.windows = 16;
  const Scene scene = make_scene(options);
  Bench bench;
  REQUIRE(bench.init(scene, options, focal_hint(2500.0)) == Status::ok);
  REQUIRE(bench.run() == Status::ok);
  CHECK(bench.matcher.camera().fx == doctest::Approx(2600.0).epsilon(0.1));
}

TEST_CASE("match_hints: what cannot be a hint is refused") {
  SceneOptions options;
  options.camera = camera_640();
  options.model = box_model(0.4, 0.3, 0.25);
  options.windows = 2;
  const Scene scene = make_scene(options);
  Bench bench;
  CHECK(bench.init(scene, options, focal_hint(-1.0)) == Status::invalid_argument);
  CHECK(bench.init(scene, options, focal_hint(std::numeric_limits<double>::infinity())) == Status::invalid_argument);
  MatchHints hints = focal_hint(500.0);
  hints.focal_share = 1.0;
  CHECK(bench.init(scene, options, hints) == Status::invalid_argument);
  hints = pose_hint(scene.begin[0], Vec3(0, 0, 0), 1.0);
  hints.T_cam_world.R[4] += 0.1;
  CHECK(bench.init(scene, options, hints) == Status::invalid_argument);
  hints = pose_hint(scene.begin[0], Vec3(0, 0, 0), std::numeric_limits<double>::quiet_NaN());
  CHECK(bench.init(scene, options, hints) == Status::invalid_argument);
  hints = pose_hint(scene.begin[0], Vec3(0, 0, 0), 1.0);
  hints.turn_rad = 0.0;
  CHECK(bench.init(scene, options, hints) == Status::invalid_argument);
}
