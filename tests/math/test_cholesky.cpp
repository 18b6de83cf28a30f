// SPDX-License-Identifier: MIT
#include "lecalib/math/cholesky.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "lecalib/core/rng.hpp"

namespace lecalib {
namespace {

Mat6 random_definite(Rng& rng) {
  Mat6 A;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) A(i, j) = rng.uniform(-1.0, 1.0);
  }
  Mat6 scale = Mat6::Zero();
  for (int i = 0; i < 6; ++i) scale(i, i) = i % 2 == 0 ? 1e4 : 1e-4;  // mixed units
  return scale * (A * A.transpose() + 0.1 * Mat6::Identity()) * scale;
}

TEST_CASE("solutions of badly scaled systems leave no residual") {
  Rng rng(1);
  for (int i = 0; i < 50; ++i) {
    const Mat6 A = random_definite(rng);
    Cholesky<6> factor;
    REQUIRE(factor.factor(A));
    const Mat6 product = A * factor.solve(Mat6(Mat6::Identity()));
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c < 6; ++c) {
        const double scale = std::sqrt(A(r, r) / A(c, c));
        CHECK(std::abs(product(r, c) - (r == c ? 1.0 : 0.0)) < 1e-11 * std::max(1.0, scale));
      }
    }
  }
}

TEST_CASE("the inverse is the solution for the unit matrix, and symmetric") {
  Rng rng(4);
  for (int i = 0; i < 50; ++i) {
    const Mat6 A = random_definite(rng);
    Cholesky<6> factor;
    REQUIRE(factor.factor(A));
    const Mat6 inverse = factor.inverse();
    const Mat6 solved = factor.solve(Mat6(Mat6::Identity()));
    CHECK(inverse == inverse.transpose());
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c < 6; ++c) {
        CHECK(std::abs(inverse(r, c) - solved(r, c)) < 1e-11 * std::sqrt(solved(r, r) * solved(c, c)));
      }
    }
  }
}

TEST_CASE("whitened vectors have the squared norm of the inverse's form") {
  Rng rng(3);
  for (int i = 0; i < 50; ++i) {
    const Mat6 A = random_definite(rng);
    Cholesky<6> factor;
    REQUIRE(factor.factor(A));
    Eigen::Matrix<double, 6, 1> b;
    for (int k = 0; k < 6; ++k) b(k) = rng.uniform(-1.0, 1.0) * std::sqrt(A(k, k));
    CHECK(factor.whiten(b).squaredNorm() == doctest::Approx(b.dot(factor.solve(b))).epsilon(1e-12));
  }
}

TEST_CASE("matrices that are not positive definite are refused") {
  Rng rng(2);
  Cholesky<6> factor;
  Mat6 A = random_definite(rng);
  A.col(3) = A.col(1);
  A.row(3) = A.row(1);
  CHECK_FALSE(factor.factor(A, 1e-11));
  A = random_definite(rng);
  A(2, 2) = -1.0;
  CHECK_FALSE(factor.factor(A));
  A(2, 2) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(factor.factor(A));
}

}  // namespace
}  // namespace lecalib
