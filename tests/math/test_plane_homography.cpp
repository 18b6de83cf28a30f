// SPDX-License-Identifier: MIT
#include "lecalib/math/plane_homography.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "lecalib/core/rng.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

struct PlaneScene {
  Camera camera;
  Mat3 R;
  Vec3 t;
  Mat3 H;  // unit norm
};

PlaneScene make_scene(const Vec3& rotation, double fx, double fy) {
  PlaneScene s;
  s.camera.fx = fx;
  s.camera.fy = fy;
  s.camera.cx = 330.0;
  s.camera.cy = 225.0;
  s.R = so3_exp(rotation);
  s.t = Vec3(-0.3, 0.2, 4.0);
  Mat3 K;
  K << fx, 0.0, s.camera.cx, 0.0, fy, s.camera.cy, 0.0, 0.0, 1.0;
  Mat3 G;
  G << s.R.col(0), s.R.col(1), s.t;
  s.H = K * G;
  s.H /= s.H.norm();
  return s;
}

Vec2 image_of(const Mat3& H, const Vec2& p) { return (H * Vec3(p(0), p(1), 1.0)).hnormalized(); }

/// The image points lie on the model line but are not the images of model_p and model_q.
PlaneLinePair make_pair(const PlaneScene& s, Rng& rng) {
  PlaneLinePair pair;
  for (int k = 0; k < 2; ++k) pair.model_p(k) = rng.uniform(-1.0, 1.0);
  for (int k = 0; k < 2; ++k) pair.model_q(k) = rng.uniform(-1.0, 1.0);
  const Vec2 d = pair.model_q - pair.model_p;
  pair.image_p = image_of(s.H, pair.model_p + 0.8 * d);
  pair.image_q = image_of(s.H, pair.model_p - 0.1 * d);
  return pair;
}

double distance_up_to_sign(const Mat3& A, const Mat3& B) { return std::min((A - B).norm(), (A + B).norm()); }

TEST_CASE("four lines give the homography in closed form and by least squares") {
  Rng rng(14);
  for (int i = 0; i < 50; ++i) {
    const PlaneScene s = make_scene(Vec3(0.4, -0.5, 0.3), 400.0, 420.0);
    PlaneLinePair pairs[4];
    for (PlaneLinePair& pair : pairs) pair = make_pair(s, rng);
    Mat3 closed;
    Mat3 least_squares;
    REQUIRE(homography_from_four_lines(pairs, &closed));
    CHECK(distance_up_to_sign(closed, s.H) < 1e-7);
    if (homography_from_lines(pairs, &least_squares)) CHECK(distance_up_to_sign(least_squares, s.H) < 1e-5);
  }
}

TEST_CASE("25 lines give the homography, both focal lengths and the pose to 1e-9") {
  Rng rng(15);
  const PlaneScene s = make_scene(Vec3(0.4, -0.5, 0.3), 400.0, 420.0);
  PlaneLinePair pairs[25];
  for (PlaneLinePair& pair : pairs) pair = make_pair(s, rng);
  Mat3 H;
  REQUIRE(homography_from_lines(pairs, &H));
  CHECK(distance_up_to_sign(H, s.H) < 1e-9);
  double fx = 0.0;
  double fy = 0.0;
  REQUIRE(focal_lengths_from_homography(H, s.camera.cx, s.camera.cy, &fx, &fy));
  CHECK(fx == doctest::Approx(400.0).epsilon(1e-9));
  CHECK(fy == doctest::Approx(420.0).epsilon(1e-9));
  for (const double sign : {1.0, -1.0}) {
    const Pose pose = pose_from_homography(sign * H, s.camera, Vec2(0.0, 0.0));
    CHECK((rotation_of(pose) - s.R).norm() < 1e-9);
    CHECK((translation_of(pose) - s.t).norm() < 1e-8);
  }
}

TEST_CASE("one shared focal length is found where two are not determined") {
  const PlaneScene tilted = make_scene(Vec3(0.5, 0.0, 0.0), 400.0, 400.0);  // about the x axis: fx is not in H
  double f = 0.0;
  double fy = 0.0;
  REQUIRE(focal_length_from_homography(tilted.H, tilted.camera.cx, tilted.camera.cy, &f));
  CHECK(f == doctest::Approx(400.0).epsilon(1e-9));
  const PlaneScene frontal = make_scene(Vec3(0.0, 0.0, 0.3), 400.0, 400.0);
  CHECK_FALSE(focal_lengths_from_homography(frontal.H, frontal.camera.cx, frontal.camera.cy, &f, &fy));
  CHECK(f == doctest::Approx(400.0).epsilon(1e-9));
}

TEST_CASE("degenerate line sets are refused") {
  Rng rng(16);
  const PlaneScene s = make_scene(Vec3(0.4, -0.5, 0.3), 400.0, 420.0);
  PlaneLinePair pairs[6];
  Mat3 H = Mat3::Identity();
  for (PlaneLinePair& pair : pairs) pair = make_pair(s, rng);
  CHECK_FALSE(homography_from_lines(Span<const PlaneLinePair>(pairs, 3), &H));

  const Vec2 centre(0.2, 0.1);  // all through one point
  for (int i = 0; i < 6; ++i) {
    pairs[i].model_p = centre;
    pairs[i].model_q = centre + Vec2(std::cos(0.5 * i), std::sin(0.5 * i));
    pairs[i].image_p = image_of(s.H, pairs[i].model_p);
    pairs[i].image_q = image_of(s.H, pairs[i].model_q);
  }
  CHECK_FALSE(homography_from_lines(pairs, &H));
  const PlaneLinePair four[4] = {pairs[0], pairs[1], pairs[2], pairs[3]};
  CHECK_FALSE(homography_from_four_lines(four, &H));

  for (int i = 0; i < 6; ++i) {  // all parallel
    pairs[i].model_p = Vec2(0.0, 0.2 * i);
    pairs[i].model_q = Vec2(1.0, 0.2 * i);
    pairs[i].image_p = image_of(s.H, pairs[i].model_p);
    pairs[i].image_q = image_of(s.H, pairs[i].model_q);
  }
  CHECK_FALSE(homography_from_lines(pairs, &H));

  for (PlaneLinePair& pair : pairs) pair.model_p = pair.model_q = pair.image_p = pair.image_q = Vec2(1.0, 1.0);
  CHECK_FALSE(homography_from_lines(pairs, &H));
  CHECK(H == Mat3::Identity());
}

}  // namespace
}  // namespace lecalib
