// SPDX-License-Identifier: MIT
#include "lecalib/math/smallest_eigenvector.hpp"

#include <doctest/doctest.h>

#include <limits>

#include "lecalib/core/rng.hpp"
#include "support/dense_algebra.hpp"

namespace lecalib {
namespace {

/// A symmetric matrix with these eigenvalues; its first eigenvector goes to *first.
Mat9 with_eigenvalues(Rng& rng, const Vec9& values, Vec9* first) {
  // Reflections by random vectors, one for each dimension.
  Mat9 Q = Mat9::Identity();
  for (int i = 0; i < 9; ++i) {
    Vec9 v;
    for (Eigen::Index k = 0; k < 9; ++k) v(k) = rng.uniform(-1.0, 1.0);
    const Vec9 Qv = Q * v;
    Q -= (2.0 / v.squaredNorm()) * Qv * v.transpose();
  }
  *first = Q.col(0);
  const Mat9 a = test::dense_product(Q * values.asDiagonal(), Q.transpose());
  return 0.5 * (a + a.transpose());
}

TEST_CASE("smallest_eigenvector: is found over gaps of all sizes, zero eigenvalues included") {
  Rng rng(3);
  for (int i = 0; i < 200; ++i) {
    Vec9 values;
    for (Eigen::Index k = 0; k < 9; ++k) values(k) = rng.uniform(0.1, 10.0);
    const double smallest[] = {0.0, 1e-12, 1e-6, 1e-3, 0.02, 0.09};
    values(0) = smallest[i % 6];
    values(1) = values(0) + (i % 4 == 0 ? 1e-5 : 0.05);
    Vec9 truth;
    const Mat9 a = with_eigenvalues(rng, values, &truth);
    Vec9 x = Vec9::Zero();
    REQUIRE(smallest_eigenvector(a, 1e-12, &x));
    CHECK(x.norm() == doctest::Approx(1.0).epsilon(1e-12));
    CHECK(1.0 - std::abs(x.dot(truth)) < 1e-13);
  }
}

TEST_CASE("smallest_eigenvector: the proof fails where another eigenvalue is as small, whatever the start found") {
  Rng rng(4);
  for (int i = 0; i < 50; ++i) {
    Vec9 values;
    for (Eigen::Index k = 0; k < 9; ++k) values(k) = rng.uniform(0.1, 10.0);
    values(0) = values(1) = i % 2 == 0 ? 0.0 : 0.05;
    Vec9 truth;
    const Mat9 a = with_eigenvalues(rng, values, &truth);
    Vec9 x = Vec9::Zero();
    CHECK_FALSE(detail::prove_smallest_eigenvector(a, &x));
    CHECK(x == Vec9::Zero());
    if (i % 2 == 0) CHECK_FALSE(smallest_eigenvector(a, 1e-12, &x));
  }
  // The vector is orthogonal to the one that the iteration starts from: rounding finds it, or nothing is proven.
  Mat3 a = 4.0 * Mat3::Identity();
  a(0, 1) = a(1, 0) = 3.0;  // (1, -1, 0) has eigenvalue 1
  Vec3 x = Vec3::Zero();
  REQUIRE(smallest_eigenvector(a, 1e-12, &x));
  CHECK(std::abs(x(0) + x(1)) < 1e-8);
  CHECK(std::abs(x(2)) < 1e-8);
}

TEST_CASE("smallest_eigenvector: a zero matrix and values that are not finite have none") {
  Vec3 x = Vec3::Zero();
  CHECK_FALSE(smallest_eigenvector(Mat3(Mat3::Zero()), 1e-12, &x));
  Mat3 a = Mat3::Identity();
  a(1, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(smallest_eigenvector(a, 1e-12, &x));
  CHECK(x == Vec3::Zero());
}

}  // namespace
}  // namespace lecalib
