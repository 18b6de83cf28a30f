// SPDX-License-Identifier: MIT
#include "lecalib/math/camera_model.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "lecalib/core/rng.hpp"
#include "support/distorted_camera.hpp"

namespace lecalib {
namespace {

using test::make_camera;

double distorted_radius(const Camera& c, double r) {
  const double q = r * r;
  return r * (1.0 + c.k1 * q + c.k2 * q * q + c.k3 * q * q * q);
}

TEST_CASE("project has the formula of design section 4") {
  const Camera c = make_camera(-0.2, 0.05, 1e-3, -2e-3, 0.01);
  const double x = 0.3, y = -0.4;
  const double r2 = x * x + y * y;
  const double radial = 1.0 + c.k1 * r2 + c.k2 * r2 * r2 + c.k3 * r2 * r2 * r2;
  const double xd = x * radial + 2.0 * c.p1 * x * y + c.p2 * (r2 + 2.0 * x * x);
  const double yd = y * radial + c.p1 * (r2 + 2.0 * y * y) + 2.0 * c.p2 * x * y;
  Vec2 pixel;
  REQUIRE(project(c, Vec3(2.0 * x, 2.0 * y, 2.0), &pixel));
  CHECK(pixel(0) == doctest::Approx(c.fx * xd + c.cx).epsilon(1e-15));
  CHECK(pixel(1) == doctest::Approx(c.fy * yd + c.cy).epsilon(1e-15));
  Vec2 behind;
  REQUIRE(project(c, Vec3(-2.0 * x, -2.0 * y, -2.0), &behind));
  CHECK((behind - pixel).norm() == 0.0);
}

TEST_CASE("the Jacobians of project are those of central differences, for all models") {
  Rng rng(8);
  for (int i = 0; i < 300; ++i) {
    Camera c = make_camera(-0.15, 0.03, 2e-3, -1e-3, -0.01);
    c.model = static_cast<DistortionModel>(i % 3);
    const double z = i % 4 == 0 ? -3.0 : 2.0;
    const double px = rng.uniform(-0.7, 0.7);
    const double py = rng.uniform(-0.7, 0.7);
    const Vec3 point(px * z, py * z, z);
    Vec2 pixel;
    Mat23 d_point;
    Mat29 d_intrinsics;
    REQUIRE(project(c, point, &pixel, &d_point, &d_intrinsics));
    for (int k = 0; k < 3; ++k) {
      Vec3 step = Vec3::Zero();
      step(k) = 1e-6;
      Vec2 plus;
      Vec2 minus;
      REQUIRE(project(c, point + step, &plus));
      REQUIRE(project(c, point - step, &minus));
      CHECK(((plus - minus) / 2e-6 - d_point.col(k)).norm() < 1e-6 * (1.0 + d_point.norm()));
    }
    for (std::size_t k = 0; k < kNumIntrinsics; ++k) {
      const double h = k < 4 ? 1e-3 : 1e-6;
      Camera up = c;
      Camera down = c;
      up.*kIntrinsics[k] += h;
      down.*kIntrinsics[k] -= h;
      Vec2 plus;
      Vec2 minus;
      REQUIRE(project(up, point, &plus));
      REQUIRE(project(down, point, &minus));
      CHECK(((plus - minus) / (2.0 * h) - d_intrinsics.col(static_cast<int>(k))).norm() <
            1e-6 * (1.0 + d_intrinsics.norm()));
    }
  }
}

TEST_CASE("valid_radius is where the radial slope first vanishes") {
  CHECK(valid_radius(make_camera(0, 0, 0, 0, 0)) == kUnboundedRadius);
  CHECK(valid_radius(make_camera(0.1, 0.1, 0, 0, 0)) == kUnboundedRadius);
  CHECK(valid_radius(make_camera(-0.1, -0.1, 0, 0, 0)) == doctest::Approx(1.07).epsilon(0.005));
  CHECK(valid_radius(make_camera(-0.3, -0.3, 0, 0, 0)) == doctest::Approx(0.75).epsilon(0.01));
  CHECK(valid_radius(make_camera(-0.5, -0.5, 0, 0, 0)) == doctest::Approx(0.63).epsilon(0.01));
  // 1 + 3 k1 q with k1 = -1/3: q = 1.
  CHECK(valid_radius(make_camera(-1.0 / 3.0, 0, 0, 0, 0)) == doctest::Approx(1.0).epsilon(1e-14));
  // Pulled down by k1 but lifted by k2 in time: 1 - 0.9 q + 0.5 q^2 has no root.
  CHECK(valid_radius(make_camera(-0.3, 0.1, 0, 0, 0)) == kUnboundedRadius);

  Rng rng(9);
  for (int i = 0; i < 300; ++i) {  // against a scan with a fine step
    const double k1 = rng.uniform(-0.6, 0.6);
    const double k2 = rng.uniform(-0.6, 0.6);
    const double k3 = rng.uniform(-0.3, 0.3);
    const Camera c = make_camera(k1, k2, 0, 0, k3);
    double scanned = kUnboundedRadius;
    for (double r = 0.0; r < 8.0; r += 1e-3) {
      const double q = r * r;
      if (1.0 + 3.0 * k1 * q + 5.0 * k2 * q * q + 7.0 * k3 * q * q * q <= 0.0) {
        scanned = r;
        break;
      }
    }
    const double found = valid_radius(c);
    if (scanned < 8.0) {
      CHECK(std::abs(found - scanned) < 1.1e-3);
    } else {
      CHECK(found >= 8.0 - 1e-3);
    }
  }
}

TEST_CASE("unproject inverts project inside 0.98 of the valid radius, with and without tangential terms") {
  Rng rng(10);
  for (int i = 0; i < 2000; ++i) {
    const double k1 = rng.uniform(-0.4, 0.3);
    const double k2 = rng.uniform(-0.2, 0.2);
    const double p1 = i % 2 == 0 ? 0.0 : rng.uniform(-2e-3, 2e-3);
    const double p2 = i % 2 == 0 ? 0.0 : rng.uniform(-2e-3, 2e-3);
    const Camera c = make_camera(k1, k2, p1, p2, 0.0);
    const double r = rng.uniform(0.0, 0.98 * std::min(1.5, valid_radius(c)));
    const double angle = rng.uniform(-3.2, 3.2);
    const Vec2 ideal(r * std::cos(angle), r * std::sin(angle));
    Vec2 pixel;
    Vec2 back(9.0, 9.0);
    REQUIRE(project(c, Vec3(ideal(0), ideal(1), 1.0), &pixel));
    REQUIRE(unproject(c, pixel, &back));
    CHECK((back - ideal).norm() < 1e-11);
  }
}

TEST_CASE("unproject inverts project to 1e-12 over the domain of the inverse models, right to its end") {
  Rng rng(14);
  for (int i = 0; i < 2000; ++i) {
    const double k1 = rng.uniform(-0.5, 0.5);
    const double k2 = i % 2 == 0 ? 0.0 : rng.uniform(-0.2, 0.2);
    Camera c = make_camera(k1, k2, 0.0, 0.0, 0.0);
    c.model = i % 2 == 0 ? DistortionModel::division : DistortionModel::polynomial;
    const double end = valid_radius(c);
    const double r = std::min(3.0, end) * (i % 3 == 0 ? 1.0 - 1e-6 * rng.uniform() : rng.uniform());
    const double angle = rng.uniform(-3.2, 3.2);
    const Vec2 ideal(r * std::cos(angle), r * std::sin(angle));
    Vec2 pixel;
    Vec2 back(9.0, 9.0);
    REQUIRE(project(c, Vec3(ideal(0), ideal(1), 1.0), &pixel));
    REQUIRE(unproject(c, pixel, &back));
    CHECK((back - ideal).norm() < 1e-12 * (1.0 + r));
    if (end < kUnboundedRadius) CHECK_FALSE(project(c, Vec3(1.0001 * end, 0.0, 1.0), &pixel));
  }
}

TEST_CASE("nothing comes back from beyond the fold") {
  const Camera c = make_camera(-0.3, -0.3, 0, 0, 0);
  const double fold = valid_radius(c);
  Vec2 pixel(-1.0, -1.0);
  CHECK_FALSE(project(c, Vec3(1.001 * fold, 0.0, 1.0), &pixel));
  CHECK(pixel == Vec2(-1.0, -1.0));
  CHECK(project(c, Vec3(0.999 * fold, 0.0, 1.0), &pixel));
  const double limit_px = c.fx * distorted_radius(c, fold);
  Vec2 ideal(9.0, 9.0);
  CHECK_FALSE(unproject(c, Vec2(c.cx + limit_px + 0.01, c.cy), &ideal));
  CHECK(ideal == Vec2(9.0, 9.0));
  CHECK(unproject(c, Vec2(c.cx + limit_px - 0.01, c.cy), &ideal));
  CHECK(ideal.norm() <= fold);
  const Camera tangential = make_camera(-0.3, -0.3, 1e-3, 1e-3, 0);
  CHECK_FALSE(unproject(tangential, Vec2(c.cx + limit_px + 5.0, c.cy), &ideal));
}

TEST_CASE("project and unproject refuse what has no image") {
  const Camera c = make_camera(0, 0, 0, 0, 0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Vec2 out;
  CHECK_FALSE(project(c, Vec3(1.0, 1.0, 0.0), &out));
  CHECK_FALSE(project(c, Vec3(1.0, 1.0, 1e-9), &out));
  CHECK_FALSE(project(c, Vec3(nan, 1.0, 1.0), &out));
  CHECK_FALSE(unproject(c, Vec2(nan, 1.0), &out));
}

}  // namespace
}  // namespace lecalib
