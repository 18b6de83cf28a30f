// SPDX-License-Identifier: MIT
#include "lecalib/math/radial_curve.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "lecalib/core/rng.hpp"
#include "support/numeric_jacobian.hpp"

namespace lecalib {
namespace {

Camera make_lens(DistortionModel model, double k1, double k2 = 0, double k3 = 0) {
  Camera camera;
  camera.fx = camera.fy = 400.0;
  camera.model = model;
  camera.k1 = k1;
  camera.k2 = k2;
  camera.k3 = k3;
  return camera;
}

Camera random_lens(Rng& rng, int i) {
  const auto model = static_cast<DistortionModel>(i % 3);
  const double k1 = rng.uniform(-0.5, 0.5);
  if (model == DistortionModel::division) return make_lens(model, k1);
  const double k2 = rng.uniform(-0.3, 0.3);
  const double k3 = rng.uniform(-0.1, 0.1);
  return make_lens(model, k1, k2, i % 2 == 0 ? 0.0 : k3);
}

/// The model's own equation: 0 where the ideal radius r is seen at r_d.
double equation(const Camera& c, double r, double r_d) {
  const auto polynomial = [&c](double x) {
    const double q = x * x;
    return x * (1.0 + c.k1 * q + c.k2 * q * q + c.k3 * q * q * q);
  };
  switch (c.model) {
    case DistortionModel::brown: return r_d - polynomial(r);
    case DistortionModel::polynomial: return r - polynomial(r_d);
    case DistortionModel::division: break;
  }
  return r * (1.0 + c.k1 * r_d * r_d) - r_d;
}

double seen_at(const Camera& c, double r) { return r * radial_at(c, r * r).value; }

TEST_CASE("radial curve: each model obeys its equation out to its end, also right before it") {
  Rng rng(81);
  for (int i = 0; i < 3000; ++i) {
    const Camera c = random_lens(rng, i);
    const double end = std::min(valid_radius(c), 3.0);
    const double share = rng.uniform();
    const double r = end * (i % 5 == 0 ? 1.0 - 1e-9 * share : share);
    CHECK(std::abs(equation(c, r, seen_at(c, r))) < 1e-13 * (1.0 + r));
  }
}

TEST_CASE("radial curve: r_d grows with r out to the end, and the end is where it stops to") {
  Rng rng(82);
  int ended = 0;
  for (int i = 0; i < 600; ++i) {
    const Camera c = random_lens(rng, i);
    const double end = valid_radius(c);
    const double reach = std::min(end, 5.0);
    double last = 0.0;
    for (int k = 1; k <= 200; ++k) {
      const double r_d = seen_at(c, reach * k / 200.0 * (1.0 - 1e-12));
      CHECK(r_d > last);
      last = r_d;
    }
    if (!(end < 5.0)) continue;
    ++ended;
    if (c.model == DistortionModel::brown) {
      CHECK(seen_at(c, 1.001 * end) < seen_at(c, end));
    } else {  // no distorted radius, however large, is the image of a radius beyond
      double farthest = 0.0;
      for (double r_d = 0.0; r_d < 2.0 * last; r_d += 1e-3 * last) {
        farthest = std::max(
            farthest, -equation(c, 0.0, r_d) / (c.model == DistortionModel::division ? 1.0 + c.k1 * r_d * r_d : 1.0));
        if (equation(c, farthest, r_d) > 1e-3) break;  // the polynomial turns back: what follows is the folded branch
      }
      CHECK(farthest <= end * (1.0 + 1e-12));
      CHECK(farthest > 0.999 * end);
    }
  }
  CHECK(ended > 200);
}

TEST_CASE("radial curve: undistort_radius inverts it to 1e-12, also near its end") {
  Rng rng(83);
  for (int i = 0; i < 3000; ++i) {
    const Camera c = random_lens(rng, i);
    const double limit = valid_radius(c);
    const double end = std::min(limit, 3.0);
    // Near Brown's fold r_d says little about r, near the end of an inverse curve r says little about r_d.
    const bool forward = c.model == DistortionModel::brown;
    const double r = end * (forward ? 0.99 : 1.0 - 1e-9) * rng.uniform();
    CHECK(std::abs(undistort_radius(c, seen_at(c, r), limit) - r) < 1e-12 * (1.0 + r));
    const double r_d = seen_at(c, 0.999 * end);
    CHECK(std::abs(seen_at(c, undistort_radius(c, r_d, limit)) - r_d) < 1e-12 * (1.0 + r_d));
    if (limit < 3.0) CHECK(undistort_radius(c, 1.001 * seen_at(c, limit), limit) == limit);
  }
}

TEST_CASE("radial curve: derivatives are those of central differences") {
  Rng rng(84);
  for (int i = 0; i < 600; ++i) {
    const Camera c = random_lens(rng, i);
    // Where the slope is 4 or 1/4 differences of step 1e-4 still tell the derivative to 1e-7.
    const double q = std::pow(rng.uniform(0.05, 1.0) * std::min(radius_of_slope(c, 0.25), 1.5), 2.0);
    const auto value = [](const Camera& lens, double at) { return radial_at(lens, at).value; };
    using Vec1 = Eigen::Matrix<double, 1, 1>;
    const auto by_q = test::numeric_jacobian<1, 1>([&](const Vec1& x) { return Vec1(value(c, x(0))); }, Vec1(q), 1e-5);
    CHECK(std::abs(by_q(0) - radial_at(c, q).by_q) < 1e-7 * (1.0 + std::abs(by_q(0))));
    const auto by_k = test::numeric_jacobian<1, 3>(
        [&](const Vec3& k) {
          Camera moved = c;
          moved.k1 = k(0);
          moved.k2 = k(1);
          moved.k3 = k(2);
          return Vec1(value(moved, q));
        },
        Vec3(c.k1, c.k2, c.k3), 1e-5);
    CHECK(test::jacobian_error(radial_gradient(c, q).transpose(), by_k) < 1e-6);
  }
}

TEST_CASE("radial curve: radius_of_slope is where the slope first gets there, from the knee on it goes straight") {
  Rng rng(85);
  for (int i = 0; i < 600; ++i) {
    const Camera c = random_lens(rng, i);
    constexpr double kSlope = 0.1;
    const double knee = radius_of_slope(c, kSlope);
    const auto slope = [&](double r) {
      const RadialFactor f = radial_at(c, r * r);
      return f.value + 2.0 * r * r * f.by_q;
    };
    const double reach = std::min(knee, 4.0);
    for (int k = 1; k < 200; ++k) {
      CHECK(slope(reach * k / 200.0) > kSlope);
      if (c.model != DistortionModel::brown) CHECK(slope(reach * k / 200.0) < 1.0 / kSlope);
    }
    if (!(knee < 4.0)) continue;
    const double at_knee = slope(knee);
    CHECK(std::min(std::abs(at_knee - kSlope) / kSlope, std::abs(at_knee * kSlope - 1.0)) < 1e-9);
    for (const double beyond : {1.0 + 1e-9, 1.2, 3.0}) {
      const double r = beyond * knee;
      const RadialFactor straight = radial_at(c, r * r, knee);
      CHECK(r * straight.value == doctest::Approx(seen_at(c, knee) + at_knee * (r - knee)).epsilon(1e-12));
      CHECK(straight.value + 2.0 * r * r * straight.by_q == doctest::Approx(at_knee).epsilon(1e-9));
    }
  }
}

TEST_CASE("radial curve: values at hand") {
  // 1 - 4 k1 q = 4 at k1 = -3, q = 1/4: r_d = 2 r / 3.
  CHECK(radial_at(make_lens(DistortionModel::division, -3.0), 0.25).value == doctest::Approx(2.0 / 3.0).epsilon(1e-15));
  CHECK(valid_radius(make_lens(DistortionModel::division, 0.25)) == doctest::Approx(1.0).epsilon(1e-14));
  CHECK(valid_radius(make_lens(DistortionModel::division, -0.5)) == kUnboundedRadius);
  // r_d - r_d^3 / 3 turns back at r_d = 1, where r = 2/3.
  CHECK(valid_radius(make_lens(DistortionModel::polynomial, -1.0 / 3.0)) == doctest::Approx(2.0 / 3.0).epsilon(1e-14));
  CHECK(valid_radius(make_lens(DistortionModel::polynomial, 0.4, 0.1)) == kUnboundedRadius);
  // r = r_d + r_d^3 at r_d = 1/2.
  CHECK(seen_at(make_lens(DistortionModel::polynomial, 1.0), 0.625) == doctest::Approx(0.5).epsilon(1e-15));
}

}  // namespace
}  // namespace lecalib
