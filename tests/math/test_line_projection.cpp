// SPDX-License-Identifier: MIT
#include "lecalib/math/line_projection.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "lecalib/core/rng.hpp"
#include "lecalib/math/so3.hpp"
#include "support/distorted_camera.hpp"

namespace lecalib {
namespace {

using test::make_camera;

struct Scene {
  Camera camera;
  Mat3 R;
  Vec3 t;
  ModelLine line;
  Vec2 pixel;  // near the line's image
};

double draw(Rng& rng, double low, double high) { return rng.uniform(low, high); }

/// A line whose two defining points have the given depths; negative ones put them behind the camera.
Scene random_scene(Rng& rng, double depth_p, double depth_q, double distance_px,
                   DistortionModel model = DistortionModel::brown) {
  Scene s;
  s.camera = make_camera(-0.12, 0.02, 1e-3, -5e-4, 0.003);
  s.camera.model = model;
  Vec3 w;
  for (int k = 0; k < 3; ++k) w(k) = draw(rng, -1.0, 1.0);
  s.R = so3_exp(w);
  for (int k = 0; k < 3; ++k) s.t(k) = draw(rng, -1.0, 1.0);
  Vec2 ends[2];
  for (Vec2& end : ends) {
    for (int k = 0; k < 2; ++k) end(k) = draw(rng, -0.6, 0.6);
  }
  const double depths[2] = {depth_p, depth_q};
  for (int e = 0; e < 2; ++e) {
    const Vec3 world = s.R.transpose() * (Vec3(ends[e](0), ends[e](1), 1.0) * depths[e] - s.t);
    for (int k = 0; k < 3; ++k) (e == 0 ? s.line.p : s.line.q)[k] = world(k);
  }
  const double mix = draw(rng, 0.0, 1.0);
  const Vec2 on_line = ends[0] + mix * (ends[1] - ends[0]);
  REQUIRE(project(s.camera, Vec3(on_line(0), on_line(1), 1.0), &s.pixel));
  s.pixel(0) += draw(rng, -distance_px, distance_px);
  s.pixel(1) += draw(rng, -distance_px, distance_px);
  return s;
}

/// The distance from s.pixel to the image of the line, by a fine scan of the line's points followed by a ternary
/// search.
double scanned_distance(const Scene& s) {
  const auto distance = [&](double mix) {
    Vec3 world;
    for (int k = 0; k < 3; ++k) world(k) = s.line.p[k] + mix * (s.line.q[k] - s.line.p[k]);
    Vec2 pixel;
    if (!project(s.camera, s.R * world + s.t, &pixel)) return 1e9;
    return (pixel - s.pixel).norm();
  };
  double best = -2.0;
  for (double mix = -2.0; mix <= 3.0; mix += 1e-3) {
    if (distance(mix) < distance(best)) best = mix;
  }
  double low = best - 1e-3;
  double high = best + 1e-3;
  for (int i = 0; i < 100; ++i) {
    const double a = low + (high - low) / 3.0;
    const double b = high - (high - low) / 3.0;
    (distance(a) < distance(b) ? high : low) = distance(a) < distance(b) ? b : a;
  }
  return distance(0.5 * (low + high));
}

TEST_CASE("the residual is the distance to the line's image, for all models") {
  Rng rng(11);
  for (int i = 0; i < 90; ++i) {
    const Scene s = random_scene(rng, 4.0, 6.0, 5.0, static_cast<DistortionModel>(i % 3));
    LineResidual residual;
    const CameraLine line = line_in_camera(s.R, s.t, s.line);
    REQUIRE(line_residual(s.camera, valid_radius(s.camera), line, s.pixel, &residual));
    CHECK(std::abs(residual.value_px()) == doctest::Approx(scanned_distance(s)).epsilon(1e-7));
    LineFoot foot;
    REQUIRE(find_foot(s.camera, valid_radius(s.camera), line, s.pixel, &foot));
    CHECK(foot.normal.norm() == doctest::Approx(1.0).epsilon(1e-14));
    CHECK(foot.normal.dot(s.pixel - foot.pixel) == doctest::Approx(residual.value_px()).epsilon(1e-12));
    CHECK(std::abs(line.moment.dot(Vec3(foot.ideal(0), foot.ideal(1), 1.0))) < 1e-12 * line.moment.norm());
  }
}

TEST_CASE("the derivatives are those of central differences, in front of and behind the camera, for all models") {
  Rng rng(12);
  for (int i = 0; i < 300; ++i) {
    const double depth_q = i % 3 == 0 ? -6.0 : 6.0;
    const Scene s = random_scene(rng, i % 5 == 0 ? -4.0 : 4.0, depth_q, 2.0, static_cast<DistortionModel>(i / 100));
    const double limit = valid_radius(s.camera);
    LineResidual residual;
    REQUIRE(line_residual(s.camera, limit, line_in_camera(s.R, s.t, s.line), s.pixel, &residual));
    const auto value = [&](const Camera& camera, const Vec3& w, const Vec3& v) {
      LineResidual moved;
      const Mat3 turn = so3_exp(w);
      REQUIRE(line_residual(camera, limit, line_in_camera(turn * s.R, turn * s.t + v, s.line), s.pixel, &moved));
      return moved.value_px();
    };
    for (int k = 0; k < 6; ++k) {
      Vec3 step = Vec3::Zero();
      step(k % 3) = 1e-6;
      const Vec3 none = Vec3::Zero();
      const double plus = k < 3 ? value(s.camera, step, none) : value(s.camera, none, step);
      const double minus = k < 3 ? value(s.camera, -step, none) : value(s.camera, none, -step);
      CHECK(std::abs((plus - minus) / 2e-6 - residual.d_pose()(k)) < 1e-5 * (1.0 + residual.d_pose().norm()));
    }
    for (std::size_t k = 0; k < kNumIntrinsics; ++k) {
      const double h = k < 4 ? 1e-3 : 1e-6;
      Camera up = s.camera;
      Camera down = s.camera;
      up.*kIntrinsics[k] += h;
      down.*kIntrinsics[k] -= h;
      const double difference =
          (value(up, Vec3::Zero(), Vec3::Zero()) - value(down, Vec3::Zero(), Vec3::Zero())) / (2.0 * h);
      CHECK(std::abs(difference - residual.d_intrinsics()(static_cast<int>(k))) <
            1e-5 * (1.0 + residual.d_intrinsics().norm()));
    }
  }
}

TEST_CASE("a point on the line has no residual, wherever the line's end points are") {
  Rng rng(13);
  for (const double depth_q : {6.0, -6.0}) {
    for (int i = 0; i < 50; ++i) {
      const Scene s = random_scene(rng, 4.0, depth_q, 0.0);
      LineResidual residual;
      REQUIRE(line_residual(s.camera, valid_radius(s.camera), line_in_camera(s.R, s.t, s.line), s.pixel, &residual));
      CHECK(std::abs(residual.value_px()) < 1e-9);
    }
  }
}

TEST_CASE("pixels beyond the image of the fold stay finite and lines outside of the valid radius have no foot") {
  const Camera camera = make_camera(-0.3, -0.3, 0.0, 0.0, 0.0);
  const double limit = valid_radius(camera);
  const ModelLine radial = {{0.0, 0.01, 1.0}, {0.4, 0.01, 1.0}};
  const CameraLine line = line_in_camera(Mat3::Identity(), Vec3::Zero(), radial);
  LineFoot foot;
  REQUIRE(find_foot(camera, limit, line, Vec2(camera.cx + 600.0, camera.cy), &foot));
  CHECK(foot.ideal.norm() < limit);
  LineResidual residual;
  REQUIRE(line_residual(camera, limit, line, Vec2(camera.cx + 600.0, camera.cy), &residual));
  CHECK(std::isfinite(residual.value_px()));
  CHECK(residual.d_intrinsics().allFinite());

  const ModelLine far = {{1.1 * limit, -1.0, 1.0}, {1.1 * limit, 1.0, 1.0}};
  CHECK_FALSE(find_foot(camera, limit, line_in_camera(Mat3::Identity(), Vec3::Zero(), far), Vec2(600.0, 200.0), &foot));
  const ModelLine at_infinity = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}};  // in the plane z = 0: its image is at infinity
  CHECK_FALSE(line_residual(camera, limit, line_in_camera(Mat3::Identity(), Vec3::Zero(), at_infinity), Vec2(1.0, 2.0),
                            &residual));
}

}  // namespace
}  // namespace lecalib
