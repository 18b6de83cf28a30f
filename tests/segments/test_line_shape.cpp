// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/segments/line_kink.hpp"
#include "lecalib/segments/shape_equations.hpp"
#include "support/dense_algebra.hpp"
#include "support/moving_edges.hpp"

using namespace lecalib;
using namespace lecalib::test;

TEST_CASE("shape equations: the solution and its variance are Eigen's") {
  const auto terms = [](double u, double t) {
    Eigen::VectorXd row(kNumShapeTerms);
    row << 1, u, t, u * t, u * u, t * t, u * t * t, u * u * t, u * u * u, u * u * u * u;
    return row;
  };
  Rng rng(5);
  ShapeEquations equations;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(kNumShapeTerms, kNumShapeTerms);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(kNumShapeTerms);
  for (int i = 0; i < 300; ++i) {
    const double u = rng.uniform(-1, 1);
    const double t = rng.uniform(-1, 1);
    const double r = 0.4 - 2 * u + 3 * t + u * u * u + 0.1 * normal(&rng);
    const double w = rng.uniform(1, 9);
    equations.add(static_cast<float>(u), static_cast<float>(t), static_cast<float>(w), static_cast<float>(r));
    a += w * terms(u, t) * terms(u, t).transpose();
    b += w * r * terms(u, t);
  }
  equations.add_prior(9, 0.05F, 0.3F);
  a(9, 9) += 1 / (0.05 * 0.05);
  b(9) -= 0.3 / (0.05 * 0.05);
  float change[kNumShapeTerms];
  REQUIRE(equations.solve(change));
  const Eigen::VectorXd expected = dense_solve(a, b);
  const Eigen::MatrixXd inverse = dense_inverse(a);
  for (int i = 0; i < kNumShapeTerms; ++i)
    CHECK(static_cast<double>(change[i]) == doctest::Approx(expected(i)).epsilon(1e-3).scale(1));
  for (const double u : {-1.0, 0.3, 1.0}) {
    const Eigen::VectorXd row = terms(u, -1);
    CHECK(static_cast<double>(equations.variance(static_cast<float>(u), -1)) ==
          doctest::Approx(dense_product(row.transpose(), dense_product(inverse, row))(0, 0)).epsilon(1e-3));
    double value = 0;
    for (int i = 0; i < kNumShapeTerms; ++i) value += static_cast<double>(change[i]) * row(i);
    CHECK(static_cast<double>(shape_at(change, static_cast<float>(u), -1)) == doctest::Approx(value).epsilon(1e-4));
  }
  ShapeEquations nothing;
  CHECK_FALSE(nothing.solve(change));
}

namespace {

/// Looks for a kink in a line of 300 px whose events stand at curve(s), one sigma of 0.5 px.
template <class Curve>
bool has_kink(Curve curve, float* at_px) {
  Rng rng(11);
  KinkFinder finder(0, 300);
  for (int i = 0; i < 3000; ++i) {
    const double s = rng.uniform(0, 300);
    finder.add(static_cast<float>(s), static_cast<float>(curve(s) + 0.5 * normal(&rng)), 1);
  }
  return finder.find(KinkOptions{}, 0.25F, at_px);
}

}  // namespace

TEST_CASE("kink: a line that turns off is told from one that bends, and where") {
  float at = -1;
  CHECK_FALSE(has_kink([](double) { return 0.0; }, &at));
  CHECK_FALSE(has_kink([](double s) { return 3e-4 * (s - 150) * (s - 150); }, &at));
  CHECK_FALSE(has_kink([](double s) { return 4e-9 * std::pow(s - 120, 4); }, &at));
  CHECK(at == -1);
  for (const double c : {110.0, 150.0, 200.0}) {
    CAPTURE(c);
    REQUIRE(has_kink([c](double s) { return s > c ? 0.06 * (s - c) : 0.0; }, &at));
    CHECK(std::fabs(static_cast<double>(at) - c) < 25);
  }
  KinkFinder too_short(0, 60);
  for (int i = 0; i < 600; ++i) too_short.add(0.1F * static_cast<float>(i), i > 300 ? 2.0F : 0.0F, 1);
  CHECK_FALSE(too_short.find(KinkOptions{}, 0.25F, &at));
}
