// SPDX-License-Identifier: MIT
#include "lecalib/host/protocol_errors.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>
#include <limits>

#include "lecalib/core/rng.hpp"
#include "lecalib/math/camera_model.hpp"
#include "lecalib/math/so3.hpp"

using namespace lecalib;
using namespace lecalib::host;

namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

Trial some_trial() { return draw_trial(default_trial(Protocol::physical), 7); }

/// The trial's pose turned about an axis of the world, in front of its own columns.
Pose turned(const Trial& trial, const Vec3& axis, double angle) {
  return make_pose(rotation_of(trial.T_cam_world) * so3_exp(angle * axis.normalized()),
                   translation_of(trial.T_cam_world));
}

}  // namespace

TEST_CASE("protocol errors: the truth has none") {
  const Trial trial = some_trial();
  for (const double error : errors_of(trial.camera, trial.T_cam_world, trial)) CHECK(error == 0);
}

TEST_CASE("protocol errors: R is the largest angle of a column, exact for small and for large ones") {
  const Trial trial = some_trial();
  for (const double angle : {1e-9, 1e-3, 0.5, 3.0}) {
    const auto error = [&](const Vec3& axis) {
      return errors_of(trial.camera, turned(trial, axis, angle), trial)[0] * kDegree;
    };
    // A column at the angle b from the axis moves by cos = 1 - (1 - cos angle) sin^2 b.
    CHECK(error(Vec3::UnitZ()) == doctest::Approx(angle).epsilon(1e-6));
    const double half = std::asin(std::sin(0.5 * angle) * std::sqrt(2.0 / 3.0));
    CHECK(error(Vec3::Ones()) == doctest::Approx(2 * half).epsilon(1e-6));
  }
}

TEST_CASE("protocol errors: T is relative to the true translation, the intrinsics as in the paper") {
  const Trial trial = some_trial();
  Pose pose = trial.T_cam_world;
  const Vec3 t = translation_of(pose);
  pose.t[1] += 0.03 * t.norm();
  Camera camera = trial.camera;
  camera.fx *= 1.02;
  camera.fy *= 0.99;
  camera.cx += 3.2;
  camera.cy -= 2.4;
  camera.k1 += 0.004;
  camera.k2 -= 0.3;
  const TrialErrors errors = errors_of(camera, pose, trial);
  const TrialErrors expected = {0, 3, 2, 1, 1, 1, 4, 300};
  for (std::size_t i = 0; i < kNumErrors; ++i) {
    INFO(kErrorNames[i]);
    CHECK(errors[i] == doctest::Approx(expected[i]).epsilon(1e-9));
  }
}

TEST_CASE("protocol errors: a camera that is not finite is none, and none is larger than any error") {
  const Trial trial = some_trial();
  Camera camera = trial.camera;
  camera.k2 = std::numeric_limits<double>::quiet_NaN();
  CHECK(errors_of(camera, trial.T_cam_world, trial) == no_answer());
  for (const double error : no_answer()) CHECK(error > 1e300);
  CHECK_FALSE(is_good(no_answer()));
}

TEST_CASE("protocol errors: good is below 5 degrees and below 5 percent") {
  CHECK(is_good({4.999, 4.999, 90, 90, 90, 90, 900, 900}));
  CHECK_FALSE(is_good({5, 0, 0, 0, 0, 0, 0, 0}));
  CHECK_FALSE(is_good({0, 5, 0, 0, 0, 0, 0, 0}));
}

TEST_CASE("protocol errors: both poses of a plane give the same image, and the one with the origin ahead is taken") {
  const Trial trial = some_trial();
  const Pose& ahead = trial.T_cam_world;
  REQUIRE(ahead.t[2] > 0);
  Mat3 R = rotation_of(ahead);
  R.col(0) = -R.col(0);
  R.col(1) = -R.col(1);
  CHECK(R.determinant() == doctest::Approx(1));
  const Pose behind = make_pose(R, -translation_of(ahead));
  Rng rng(1);
  for (int i = 0; i < 20; ++i) {
    const double x = rng.uniform(-1, 1);
    const double y = rng.uniform(-1, 1);
    Vec2 pixels[2];
    for (const bool is_ahead : {false, true}) {
      const Pose& pose = is_ahead ? ahead : behind;
      REQUIRE(project(trial.camera, rotation_of(pose) * Vec3(x, y, 0) + translation_of(pose), &pixels[is_ahead]));
    }
    CHECK((pixels[0] - pixels[1]).norm() < 1e-9);
  }
  for (const Pose& pose : {ahead, behind}) {
    for (const double error : errors_of(trial.camera, with_origin_ahead(pose), trial)) CHECK(error == 0);
  }
}
