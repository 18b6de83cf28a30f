// SPDX-License-Identifier: MIT
#include "lecalib/solve/line_dlt.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

struct Scene {
  Camera camera = test::make_camera(400.0, 420.0, 330.0, 225.0);
  std::vector<ModelLine> model;
  std::vector<ViewLine> lines;
  Mat3 R = so3_exp(Vec3(0.4, -0.5, 0.3));
  Vec3 t = Vec3(0.1, -0.2, 4.0);
  Mat34 M;  // unit norm
};

/// The image lines pass through other points than the images of the model's end points.
Scene make_scene(std::vector<ModelLine> model) {
  Scene s;
  s.model = std::move(model);
  Mat3 K;
  K << s.camera.fx, 0.0, s.camera.cx, 0.0, s.camera.fy, s.camera.cy, 0.0, 0.0, 1.0;
  s.M << K * s.R, K * s.t;
  s.M /= s.M.norm();
  for (std::size_t i = 0; i < s.model.size(); ++i) {
    ViewLine line{};
    line.model_line = static_cast<std::uint16_t>(i);
    for (int e = 0; e < 2; ++e) {
      const double mix = e == 0 ? -0.2 : 0.7;
      Eigen::Vector4d world;
      for (int k = 0; k < 3; ++k) world(k) = (1.0 - mix) * s.model[i].p[k] + mix * s.model[i].q[k];
      world(3) = 1.0;
      const Vec3 image = s.M * world;
      for (int k = 0; k < 2; ++k) (e == 0 ? line.image_p : line.image_q)[k] = image(k) / image(2);
    }
    s.lines.push_back(line);
  }
  return s;
}

double distance_up_to_sign(const Mat34& A, const Mat34& B) { return std::min((A - B).norm(), (A + B).norm()); }

TEST_CASE("noise-free: the projection matrix and its decomposition to 1e-9") {
  Rng rng(3);
  for (int i = 0; i < 10; ++i) {
    const Scene s = make_scene(test::random_lines(rng, 20, 1.0, 1.0, 0.8));
    Mat34 M;
    REQUIRE(solve_line_dlt(s.model, s.lines, &M));
    CHECK(distance_up_to_sign(M, s.M) < 1e-9);
    for (const double sign : {1.0, -1.0}) {
      for (const bool known_centre : {false, true}) {
        Decomposition d{};
        REQUIRE((known_centre ? decompose_projection(sign * M, s.camera.cx, s.camera.cy, &d)
                              : decompose_projection(sign * M, &d)));
        CHECK(d.fx == doctest::Approx(s.camera.fx).epsilon(1e-9));
        CHECK(d.fy == doctest::Approx(s.camera.fy).epsilon(1e-9));
        CHECK(d.cx == doctest::Approx(s.camera.cx).epsilon(1e-9));
        CHECK(d.cy == doctest::Approx(s.camera.cy).epsilon(1e-9));
        CHECK((d.R - s.R).norm() < 1e-9);
        CHECK((d.t - s.t).norm() < 1e-8);
      }
      Pose pose;
      REQUIRE(pose_from_projection(sign * M, s.camera, &pose));
      CHECK((rotation_of(pose) - s.R).norm() < 1e-9);
      CHECK((translation_of(pose) - s.t).norm() < 1e-8);
    }
  }
}

TEST_CASE("six lines in space are enough, five are not") {
  Rng rng(4);
  Scene s = make_scene(test::random_lines(rng, 6, 1.0, 1.0, 0.8));
  Mat34 M = Mat34::Zero();
  REQUIRE(solve_line_dlt(s.model, s.lines, &M));
  CHECK(distance_up_to_sign(M, s.M) < 1e-6);
  s.lines.pop_back();
  Mat34 untouched = Mat34::Zero();
  CHECK_FALSE(solve_line_dlt(s.model, s.lines, &untouched));
  CHECK(untouched == Mat34::Zero());
}

TEST_CASE("noise-free: a plane anywhere in space gives its homography; four lines are enough, three are not") {
  Rng rng(5);
  const Mat3 turn = so3_exp(Vec3(0.3, 0.9, -0.4));
  const Vec3 shift(0.3, -0.2, 0.5);
  for (const int count : {4, 25}) {
    std::vector<ModelLine> model;
    for (const ModelLine& line : test::random_lines(rng, count, 1.0, 0.7, 0.0)) {
      model.push_back(test::make_line(turn * Vec3(line.p[0], line.p[1], 0.0) + shift,
                                      turn * Vec3(line.q[0], line.q[1], 0.0) + shift));
    }
    Scene s = make_scene(model);
    const ModelFrame frame = find_model_frame(s.model, s.lines);
    REQUIRE(frame.shape == ModelShape::planar);
    CHECK((frame.axes * frame.axes.transpose() - Mat3::Identity()).norm() < 1e-14);
    CHECK(frame.axes.determinant() == doctest::Approx(1.0));
    Mat3 H;
    REQUIRE(solve_planar_line_dlt(s.model, s.lines, frame, &H));
    for (const ModelLine& line : s.model) {  // H of plane coordinates is M of world coordinates
      const Vec3 world(line.p[0], line.p[1], line.p[2]);
      const Vec3 plane = frame.axes * (world - frame.origin);
      CHECK(std::abs(plane(2)) < 1e-12);
      const Vec2 expected = (s.M * world.homogeneous()).hnormalized();
      const Vec2 found = (H * Vec3(plane(0), plane(1), 1.0)).hnormalized();
      CHECK((found - expected).norm() < (count == 4 ? 1e-4 : 1e-8));
    }
    s.lines.resize(3);
    CHECK_FALSE(solve_planar_line_dlt(s.model, s.lines, frame, &H));
  }
}

TEST_CASE("model shapes") {
  Rng rng(6);
  const auto shape_of = [](const std::vector<ModelLine>& model) {
    const Scene s = make_scene(model);
    return find_model_frame(s.model, s.lines).shape;
  };
  CHECK(shape_of(test::random_lines(rng, 10, 1.0, 1.0, 0.5)) == ModelShape::non_planar);
  CHECK(shape_of(test::random_lines(rng, 10, 1.0, 1.0, 0.0)) == ModelShape::planar);
  CHECK(shape_of(test::random_lines(rng, 10, 1.0, 1.0, 0.005)) == ModelShape::planar);
  CHECK(shape_of(test::random_lines(rng, 10, 1.0, 0.0, 0.0)) == ModelShape::collinear);
  CHECK(find_model_frame({}, {}).shape == ModelShape::collinear);
}

TEST_CASE("undefined solutions are refused") {
  Rng rng(7);
  // Lines of one plane leave the projection of space undefined.
  const Scene flat = make_scene(test::random_lines(rng, 20, 1.0, 1.0, 0.0));
  Mat34 M;
  CHECK_FALSE(solve_line_dlt(flat.model, flat.lines, &M));
  Decomposition d{};
  CHECK_FALSE(decompose_projection(Mat34::Zero(), &d));
  CHECK_FALSE(decompose_projection(Mat34::Zero(), 320.0, 240.0, &d));
  Pose pose;
  CHECK_FALSE(pose_from_projection(Mat34::Zero(), flat.camera, &pose));
}

TEST_CASE("a line whose end points lie very far away changes neither the model's shape nor the solution") {
  Rng rng(40);
  for (const double depth : {0.0, 1.0}) {
    std::vector<ModelLine> model = test::random_lines(rng, 20, 1.5, 1.2, depth);
    for (int end = 0; end < 2; ++end) {
      ModelLine& line = model[static_cast<std::size_t>(end)];
      for (int k = 0; k < 3; ++k) (end == 0 ? line.q : line.p)[k] += 1e7 * (line.q[k] - line.p[k]);
    }
    Scene s = make_scene(model);
    for (int e = 0; e < 2; ++e) {  // make_scene() takes points between the ends: far out, where rounding rules
      ViewLine& line = s.lines[static_cast<std::size_t>(e)];
      const ModelLine& truth = s.model[static_cast<std::size_t>(e)];
      const double* near = e == 0 ? truth.p : truth.q;
      const double* far = e == 0 ? truth.q : truth.p;
      for (int which = 0; which < 2; ++which) {
        const double mix = which * 1e-7;
        Eigen::Vector4d world(0.0, 0.0, 0.0, 1.0);
        for (int k = 0; k < 3; ++k) world(k) = near[k] + mix * (far[k] - near[k]);
        const Vec3 image = s.M * world;
        for (int k = 0; k < 2; ++k) (which == 0 ? line.image_p : line.image_q)[k] = image(k) / image(2);
      }
    }
    const ModelFrame frame = find_model_frame(s.model, s.lines);
    CHECK(frame.shape == (depth > 0.0 ? ModelShape::non_planar : ModelShape::planar));
    if (depth > 0.0) {
      Mat34 M;
      REQUIRE(solve_line_dlt(s.model, s.lines, &M));
      CHECK(std::min((M - s.M).norm(), (M + s.M).norm()) < 1e-6);
    } else {
      Mat3 H;
      REQUIRE(solve_planar_line_dlt(s.model, s.lines, frame, &H));
    }
  }
}

}  // namespace
}  // namespace lecalib
