// SPDX-License-Identifier: MIT
#include "lecalib/math/plane_homography.hpp"

#include <doctest/doctest.h>

#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// The homography of the plane z = 0, principal point at the origin, coordinates in units of 100 px.
Mat3 homography(const Vec3& rotation, const Vec3& t, double fx, double fy) {
  const Mat3 R = so3_exp(rotation);
  Mat3 H;
  H << R.col(0), R.col(1), t;
  H.row(0) *= fx;
  H.row(1) *= fy;
  return H;
}

struct Stack {
  Eigen::Matrix2d AtA = Eigen::Matrix2d::Zero();
  Vec2 Atc = Vec2::Zero();
  void add(const Mat3& H) { add_focal_equations(H, &AtA, &Atc); }
};

TEST_CASE("line_through: both points lie on it, the normal is of unit length, equal points make no line") {
  const Vec3 l = line_through(Vec2(3.0, -1.0), Vec2(10.0, 7.0));
  CHECK(l.head<2>().norm() == doctest::Approx(1.0).epsilon(1e-15));
  CHECK(std::abs(l.dot(Vec3(3.0, -1.0, 1.0))) < 1e-14);
  CHECK(std::abs(l.dot(Vec3(10.0, 7.0, 1.0))) < 1e-14);
  CHECK(line_through(Vec2(1.0, 1.0), Vec2(1.0, 1.0)) == Vec3::Zero());
}

TEST_CASE("one view gives both focal lengths, several views too, whatever the scale of each homography") {
  const Vec3 t(-0.3, 0.2, 4.0);
  double fx = 0.0;
  double fy = 0.0;
  Stack one;
  one.add(homography(Vec3(0.4, -0.5, 0.3), t, 4.0, 4.2));
  REQUIRE(solve_focal_lengths(one.AtA, one.Atc, &fx, &fy));
  CHECK(fx == doctest::Approx(4.0).epsilon(1e-9));
  CHECK(fy == doctest::Approx(4.2).epsilon(1e-9));
  Stack several;
  several.add(-3.0 * homography(Vec3(0.5, 0.0, 0.0), t, 4.0, 4.2));
  several.add(0.01 * homography(Vec3(0.0, 0.6, 0.2), t, 4.0, 4.2));
  REQUIRE(solve_focal_lengths(several.AtA, several.Atc, &fx, &fy));
  CHECK(fx == doctest::Approx(4.0).epsilon(1e-9));
  CHECK(fy == doctest::Approx(4.2).epsilon(1e-9));
}

TEST_CASE("one shared focal length is found where two are not determined, and none where the plane is frontal") {
  double f = 7.0;
  double fy = 7.0;
  Stack tilted;  // about the x axis: only fy is in H
  tilted.add(homography(Vec3(0.5, 0.0, 0.0), Vec3(0.0, 0.0, 4.0), 4.0, 4.0));
  CHECK_FALSE(solve_focal_lengths(tilted.AtA, tilted.Atc, &f, &fy));
  CHECK(f == 7.0);
  REQUIRE(solve_focal_length(tilted.AtA, tilted.Atc, &f));
  CHECK(f == doctest::Approx(4.0).epsilon(1e-9));
  Stack frontal;
  frontal.add(homography(Vec3(0.0, 0.0, 0.3), Vec3(0.0, 0.0, 4.0), 4.0, 4.0));
  CHECK_FALSE(solve_focal_lengths(frontal.AtA, frontal.Atc, &f, &fy));
}

TEST_CASE("the pose of a plane, on the side where the visible point is") {
  Camera camera;
  camera.fx = 400.0;
  camera.fy = 420.0;
  camera.cx = 330.0;
  camera.cy = 225.0;
  const Vec3 t(-0.3, 0.2, 4.0);
  Mat3 H = homography(Vec3(0.4, -0.5, 0.3), t, camera.fx, camera.fy);
  H.row(0) += camera.cx * H.row(2);
  H.row(1) += camera.cy * H.row(2);
  for (const double scale : {1.0, -0.2}) {
    const Pose pose = pose_from_homography(scale * H, camera, Vec2::Zero());
    CHECK((rotation_of(pose) - so3_exp(Vec3(0.4, -0.5, 0.3))).norm() < 1e-9);
    CHECK((translation_of(pose) - t).norm() < 1e-8);
  }
}

}  // namespace
}  // namespace lecalib
