// SPDX-License-Identifier: MIT
#include "lecalib/solve/next_view.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "lecalib/math/line_projection.hpp"
#include "lecalib/math/so3.hpp"
#include "support/dense_algebra.hpp"

using namespace lecalib;

namespace {

Camera camera() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = 500;
  camera.fy = 510;
  camera.cx = 330;
  camera.cy = 235;
  camera.k1 = -0.1;
  camera.p1 = 0.001;
  return camera;
}

std::vector<ModelLine> sheet() {
  return {
      {{0, 0, 0}, {0.3, 0, 0}}, {{0.3, 0, 0}, {0.3, 0.2, 0}}, {{0.3, 0.2, 0}, {0, 0.2, 0}}, {{0, 0.2, 0}, {0, 0, 0}}};
}

/// The sheet's centre at a distance on the axis, turned.
Pose sheet_pose(const Vec3& turn, double distance) {
  const Mat3 R = so3_exp(turn);
  return make_pose(R, Vec3(0, 0, distance) - R * Vec3(0.15, 0.1, 0));
}

/// Of a fixed pixel from the line's image, by the camera's nine parameters and the pose's six.
double distance_of(const Camera& at, const ModelLine& line, const Pose& pose, const Vec2& pixel,
                   const Eigen::VectorXd& step) {
  Camera moved = at;
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) moved.*kIntrinsics[i] += step(static_cast<Eigen::Index>(i));
  const Mat3 turn = so3_exp(step.segment<3>(9));
  const CameraLine seen = line_in_camera(turn * rotation_of(pose), turn * translation_of(pose) + step.tail<3>(), line);
  LineFoot foot;
  REQUIRE(find_foot(moved, valid_radius(moved), seen, pixel, &foot));
  return foot.normal.dot(pixel - foot.pixel);
}

Mat9 known_camera() {
  Mat9 information = Mat9::Identity();
  information(0, 0) = information(1, 1) = 1e-4;
  information(2, 2) = information(3, 3) = 1e-3;
  for (int i = 6; i < 9; ++i) information(i, i) = 1e6;
  return information;
}

constexpr bool kNoneHeld[9] = {};

}  // namespace

TEST_CASE("next_view: a view's information is that of finite differences with the pose marginalised") {
  const Pose pose = sheet_pose(Vec3(0.4, -0.3, 0.2), 0.5);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(15, 15);
  for (const ModelLine& line : sheet()) {
    for (const double s : {1 / 6.0, 0.5, 5 / 6.0}) {
      const Vec3 x = (1 - s) * Eigen::Map<const Vec3>(line.p) + s * Eigen::Map<const Vec3>(line.q);
      Vec2 pixel;
      REQUIRE(project(camera(), rotation_of(pose) * x + translation_of(pose), &pixel));
      Eigen::MatrixXd row(15, 1);
      for (int i = 0; i < 15; ++i) {
        const double h = i < 4 ? 1e-3 : 1e-6;
        const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(15, i);
        row(i) = (distance_of(camera(), line, pose, pixel, step) - distance_of(camera(), line, pose, pixel, -step)) /
                 (2 * h);
      }
      normal += test::dense_product(row, row.transpose()) / (0.2 * 0.2);
    }
  }
  const Eigen::MatrixXd by_pose = test::dense_solve(normal.bottomRightCorner(6, 6), normal.bottomLeftCorner(6, 9));
  const Eigen::MatrixXd expected =
      normal.topLeftCorner(9, 9) - test::dense_product(normal.topRightCorner(9, 6), by_pose);
  Mat9 information = Mat9::Zero();
  CHECK(add_view_information(camera(), sheet(), pose, 0.2, &information) == 4);
  for (int i = 0; i < 9; ++i) {
    for (int j = 0; j < 9; ++j) {
      CHECK(std::abs(information(i, j) - expected(i, j)) <= 1e-3 * std::sqrt(expected(i, i) * expected(j, j)) + 1e-9);
    }
  }
}

TEST_CASE("next_view: what the image does not show tells nothing") {
  Mat9 information = Mat9::Zero();
  CHECK(add_view_information(camera(), sheet(), sheet_pose(Vec3(0, 0, 0), -1), 0.1, &information) == 0);
  Pose beside = sheet_pose(Vec3(0, 0, 0), 1);
  beside.t[0] += 5;
  CHECK(add_view_information(camera(), sheet(), beside, 0.1, &information) == 0);
  std::vector<ModelLine> three = sheet();
  three.pop_back();
  CHECK(add_view_information(camera(), three, sheet_pose(Vec3(0.3, 0, 0), 0.5), 0.1, &information) == 3);
  CHECK(information == Mat9::Zero());
}

TEST_CASE("next_view: a sheet seen frontally is to be tilted, for the focal length") {
  Mat9 information = known_camera();
  const Pose frontal = sheet_pose(Vec3(0, 0, 0), 0.5);
  for (int view = 0; view < 10; ++view) add_view_information(camera(), sheet(), frontal, 0.1, &information);
  MoveForecast forecast{};
  REQUIRE(forecast_moves(camera(), sheet(), information, kNoneHeld, frontal, 0, &forecast));
  const double tilted = forecast.sigma[static_cast<std::size_t>(ViewMove::tilt)];
  CHECK(tilted < 0.5 * forecast.sigma[static_cast<std::size_t>(ViewMove::stay)]);
  for (const double sigma : forecast.sigma) CHECK(tilted <= sigma);

  // What it promises is what four such views bring.
  Mat9 tilting = information;
  for (int view = 0; view < 4; ++view) {
    add_view_information(camera(), sheet(), sheet_pose(Vec3(0, 0.4363, 0), 0.5), 0.1, &tilting);
  }
  CHECK(tilted <= std::sqrt(test::dense_inverse(tilting)(0, 0)) * 1.001);
}

TEST_CASE("next_view: a move that loses the object promises nothing, and open information is refused") {
  const Pose far_left = sheet_pose(Vec3(0.3, 0.2, 0), 0.16);
  MoveForecast forecast{};
  REQUIRE(forecast_moves(camera(), sheet(), known_camera(), kNoneHeld, far_left, 0, &forecast));
  CHECK(forecast.sigma[static_cast<std::size_t>(ViewMove::closer)] == doctest::Approx(100.0));
  CHECK_FALSE(forecast_moves(camera(), sheet(), Mat9::Zero(), kNoneHeld, far_left, 0, &forecast));
}
