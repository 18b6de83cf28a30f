// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "lecalib/host/simulator_renderer.hpp"
#include "lecalib/host/simulator_trajectory.hpp"
#include "lecalib/math/so3.hpp"

using namespace lecalib;
using namespace lecalib::host;

namespace {

const Pose kRig[] = {Pose()};

Camera test_camera() { return {80, 60, 70, 72, 41, 28.5, -0.15, 0.02, 0.001, -0.001, 0}; }

/// A wall in the plane z = 2 that fills the view: radiance 0.8, with a dark half to the left of x = edge.
Scene half_dark_wall(double edge) {
  Scene scene;
  Face wall{Vec3(-10, 10, 2), Vec3::UnitX(), -Vec3::UnitY(), 20, 20, 0.8F, {}};
  const double width = edge + 10;
  wall.figures.push_back({{{0, 0}, {width, 0}, {width, 20}, {0, 20}}, 0.2F});
  scene.faces.push_back(wall);
  scene.target_faces = 1;
  return scene;
}

/// Share of a pixel's kernel, the cubic B-spline, to the left of x: by summing its closed form finely.
double share_left_of(double x) {
  const auto spline = [](double s) {
    const double a = std::abs(s);
    if (a < 1) return 2.0 / 3 - a * a + a * a * a / 2;
    return a < 2 ? (2 - a) * (2 - a) * (2 - a) / 6 : 0.0;
  };
  double sum = 0;
  constexpr double kStep = 1e-3;
  for (double s = -2; s < std::min(x, 2.0); s += kStep) sum += kStep * spline(s + kStep / 2);
  return sum;
}

}  // namespace

TEST_CASE("Renderer: an edge's profile is the integral of the cubic B-spline") {
  const Camera camera{40, 9, 100, 100, 19.5, 4, 0, 0, 0, 0, 0};
  for (const double edge_px : {19.0, 19.3, 20.6}) {
    const Scene scene = half_dark_wall((edge_px - camera.cx) / camera.fx * 2.0);
    Renderer renderer(scene, camera);
    renderer.render(Pose{});
    for (int x = 15; x < 25; ++x) {
      const double dark = share_left_of(edge_px - x);
      const double expected = 0.2 * dark + 0.8 * (1 - dark);
      const double rendered = static_cast<double>(renderer.radiance()[static_cast<std::size_t>(4 * 40 + x)]);
      CHECK(std::abs(rendered - expected) <= 0.6 * 0.5 / 34 + 1e-3);  // half a ray of 34
    }
  }
}

TEST_CASE("Renderer: what moved is rendered as if all were") {
  for (const char* target : {"box:0.4x0.3x0.25", "rectangle:0.297x0.21", "checkerboard:5x4:0.03"}) {
    const Model model = make_target(target).value();
    const Scene scene = make_scene(target, model).value();
    const Camera camera = test_camera();
    const auto trajectory = Trajectory::make(scene, model, camera, kRig, Motion::shake, 1.0, 0.1, 5);
    REQUIRE(trajectory.ok());
    Renderer moving(scene, camera);
    for (int i = 0; i <= 20; ++i) moving.render(trajectory.value().at(0.002 * i));
    Renderer fresh(scene, camera);
    fresh.render(trajectory.value().at(0.04));
    CHECK(std::equal(fresh.radiance().begin(), fresh.radiance().end(), moving.radiance().begin()));
  }
}

TEST_CASE("Renderer: rods are round, hide the room, and move with the camera") {
  Scene scene = half_dark_wall(-20);
  scene.rods.push_back({Vec3(-0.5, 0, 1), Vec3(0.5, 0, 1), 0.03, 0.1F});
  const Camera camera{40, 40, 100, 100, 19.5, 19.5, 0, 0, 0, 0, 0};
  Renderer renderer(scene, camera);
  renderer.render(Pose{});
  const auto at = [&](int y) { return renderer.radiance()[static_cast<std::size_t>(y * 40 + 20)]; };
  // Half-width 3 px around y = 19.5.
  CHECK(at(19) == doctest::Approx(0.1F));
  CHECK(at(12) == doctest::Approx(0.8F));
  Renderer moved(scene, camera);
  Pose up;
  up.t[1] = -0.1;
  renderer.render(up);
  moved.render(up);
  CHECK(std::equal(moved.radiance().begin(), moved.radiance().end(), renderer.radiance().begin()));
  CHECK(at(9) == doctest::Approx(0.1F));
}

TEST_CASE("Renderer: pixels without a ray stay dark") {
  Camera camera{80, 60, 40, 40, 39.5, 29.5, -0.5, 0, 0, 0, 0};  // folds at radius 0.54 of 1.2
  const Scene scene = half_dark_wall(-20);
  Renderer renderer(scene, camera);
  renderer.render(Pose{});
  CHECK(renderer.radiance()[0] == kVoidRadiance);
  CHECK(renderer.radiance()[30 * 80 + 40] == doctest::Approx(0.8F));
}

TEST_CASE("Trajectory: rotations are rotations, the motion is smooth and keeps the target in view") {
  const char* target = "box:0.4x0.3x0.25";
  const Model model = make_target(target).value();
  const Scene scene = make_scene(target, model).value();
  for (const Motion motion : {Motion::shake, Motion::sweep, Motion::rotate}) {
    const auto made = Trajectory::make(scene, model, test_camera(), kRig, motion, 1.0, 0.5, 11);
    REQUIRE(made.ok());
    Mat3 before = rotation_of(made.value().at(0));
    for (int i = 1; i <= 50; ++i) {
      const Pose pose = made.value().at(0.01 * i);
      const Mat3 R = rotation_of(pose);
      CHECK((R * R.transpose() - Mat3::Identity()).norm() < 1e-12);
      CHECK(R.determinant() == doctest::Approx(1));
      CHECK((R - before).norm() < 0.1);
      before = R;
      const Vec3 center = R * scene.center + translation_of(pose);
      CHECK(center(2) > 0.3);
    }
  }
}

TEST_CASE("make_scene: nothing to draw is an error, any lines are drawn") {
  CHECK_FALSE(make_scene("file:none", Model{}).ok());
  Model flat = make_target("rectangle:0.3x0.2").value();
  const auto board = make_scene("file:flat", flat);
  REQUIRE(board.ok());
  CHECK(board.value().rods.empty());
  CHECK(board.value().faces[0].figures.size() == 4);
  const auto rods = make_scene("file:solid", make_target("box:0.3x0.2x0.1").value());
  REQUIRE(rods.ok());
  CHECK(rods.value().target_faces == 0);
  CHECK(rods.value().rods.size() == 12);
}
