// SPDX-License-Identifier: MIT
#include "lecalib/math/so3.hpp"

#include <doctest/doctest.h>

#include "lecalib/core/rng.hpp"
#include "lecalib/math/trigonometry.hpp"

namespace lecalib {
namespace {

Vec3 random_vector(Rng& rng) {
  const double x = rng.uniform(-1.0, 1.0);
  const double y = rng.uniform(-1.0, 1.0);
  const double z = rng.uniform(-1.0, 1.0);
  return {x, y, z};
}

TEST_CASE("so3_exp gives rotations and so3_log inverts it, from 1e-12 rad to pi") {
  Rng rng(5);
  for (const double angle : {1e-12, 1e-9, 1e-6, 0.99e-4, 1.01e-4, 1e-3, 0.5, 2.0, 3.0, 3.1415, kPi - 1e-9}) {
    for (int i = 0; i < 20; ++i) {
      const Vec3 w = angle * random_vector(rng).normalized();
      const Mat3 R = so3_exp(w);
      CHECK((R * R.transpose() - Mat3::Identity()).norm() < 1e-14);
      CHECK(R.determinant() == doctest::Approx(1.0).epsilon(1e-14));
      CHECK((so3_log(R) - w).norm() < 1e-14 + 1e-14 * angle);
      CHECK((R * w - w).norm() < 1e-14 * (1.0 + angle));
    }
  }
}

TEST_CASE("so3_exp agrees with Eigen's AngleAxis") {
  Rng rng(6);
  for (int i = 0; i < 50; ++i) {
    const Vec3 w = 3.0 * random_vector(rng);
    const Mat3 oracle = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
    CHECK((so3_exp(w) - oracle).norm() < 1e-14);
  }
}

TEST_CASE("hat is the cross product") {
  const Vec3 a(1.0, -2.0, 3.0);
  const Vec3 b(0.5, 4.0, -1.0);
  CHECK((hat(a) * b - a.cross(b)).norm() == 0.0);
}

TEST_CASE("nearest_rotation keeps rotations, undoes noise and beats its neighbours") {
  Rng rng(7);
  for (int i = 0; i < 30; ++i) {
    const Mat3 R = so3_exp(3.0 * random_vector(rng));
    CHECK((nearest_rotation(2.5 * R) - R).norm() < 1e-14);
    Mat3 A = R;
    for (int k = 0; k < 3; ++k) A.col(k) += 0.3 * random_vector(rng);
    const Mat3 nearest = nearest_rotation(A);
    CHECK(nearest.determinant() == doctest::Approx(1.0).epsilon(1e-14));
    for (int k = 0; k < 20; ++k) {
      const Mat3 neighbour = so3_exp(1e-3 * random_vector(rng)) * nearest;
      CHECK((A - nearest).norm() <= (A - neighbour).norm());
    }
  }
}

TEST_CASE("a pose keeps its rotation and translation") {
  const Mat3 R = so3_exp(Vec3(0.1, -0.7, 0.4));
  const Pose pose = make_pose(R, Vec3(1.0, 2.0, 3.0));
  CHECK(pose.R[1] == R(0, 1));
  CHECK((rotation_of(pose) - R).norm() == 0.0);
  CHECK((translation_of(pose) - Vec3(1.0, 2.0, 3.0)).norm() == 0.0);
}

}  // namespace
}  // namespace lecalib
