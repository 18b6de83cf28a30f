// SPDX-License-Identifier: MIT
#include "lecalib/math/trigonometry.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "lecalib/core/rng.hpp"

namespace lecalib {
namespace {

TEST_CASE("sin_cos is within 4e-16 of the C library up to 1e5 rad") {
  Rng rng(3);
  double worst = 0.0;
  for (int i = 0; i < 200000; ++i) {
    const double range = i % 2 == 0 ? 7.0 : 1e5;
    const double angle = rng.uniform(-range, range);
    double s = 0.0;
    double c = 0.0;
    sin_cos(angle, &s, &c);
    worst = std::max({worst, std::abs(s - std::sin(angle)), std::abs(c - std::cos(angle))});
  }
  CHECK(worst < 4e-16);
}

TEST_CASE("sin_cos of zero is exact and of nonsense is not a number") {
  double s = 1.0;
  double c = 0.0;
  sin_cos(0.0, &s, &c);
  CHECK(s == 0.0);
  CHECK(c == 1.0);
  sin_cos(1e10, &s, &c);
  CHECK(std::isnan(s));
  CHECK(std::isnan(c));
}

TEST_CASE("arc_tan2 is within 1e-15 of the C library in all quadrants and on the axes") {
  Rng rng(4);
  double worst = 0.0;
  for (int i = 0; i < 200000; ++i) {
    const double x = rng.uniform(-1.0, 1.0);
    const double y = rng.uniform(-1.0, 1.0) * (i % 3 == 0 ? 1e-6 : 1.0);
    worst = std::max(worst, std::abs(arc_tan2(y, x) - std::atan2(y, x)));
  }
  CHECK(worst < 1e-15);
  CHECK(arc_tan2(0.0, 0.0) == 0.0);
  CHECK(arc_tan2(0.0, -1.0) == doctest::Approx(kPi).epsilon(1e-15));
  CHECK(arc_tan2(1.0, 0.0) == doctest::Approx(kPi / 2).epsilon(1e-15));
  CHECK(arc_tan2(-1.0, 0.0) == doctest::Approx(-kPi / 2).epsilon(1e-15));
}

TEST_CASE("tangent of 45 degrees is one") { CHECK(tangent(deg_to_rad(45.0)) == doctest::Approx(1.0).epsilon(1e-15)); }

}  // namespace
}  // namespace lecalib
