// SPDX-License-Identifier: MIT
#include "lecalib/math/packed_cholesky.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "lecalib/core/rng.hpp"
#include "support/dense_algebra.hpp"

namespace lecalib {
namespace {

std::vector<double> packed(const Eigen::MatrixXd& a) {
  std::vector<double> out;
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) out.push_back(a(i, j));
  }
  return out;
}

TEST_CASE("packed Cholesky: solves as a dense decomposition does") {
  Rng rng(2);
  for (const int n : {1, 2, 5, 24, 60}) {
    Eigen::MatrixXd half(n, n + 3);
    Eigen::VectorXd right(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      right(i) = rng.uniform(-1.0, 1.0);
      for (Eigen::Index j = 0; j < n + 3; ++j) half(i, j) = rng.uniform(-1.0, 1.0);
    }
    const Eigen::MatrixXd matrix = test::dense_product(half, half.transpose());
    std::vector<double> factor = packed(matrix);
    std::vector<double> x(right.data(), right.data() + n);
    const auto size = static_cast<std::size_t>(n);
    REQUIRE(factor_packed(factor, size));
    solve_packed(factor, size, x);
    const Eigen::VectorXd expected = test::dense_solve(matrix, right);
    const Eigen::Map<const Eigen::VectorXd> found(x.data(), n);
    CHECK((found - expected).norm() <= 1e-9 * expected.norm());
  }
}

TEST_CASE("packed Cholesky: what is not definite is refused") {
  std::vector<double> indefinite = {1, 2, 1};  // [1 2; 2 1]
  CHECK_FALSE(factor_packed(indefinite, 2));
  std::vector<double> singular = {1, 1, 1};
  CHECK_FALSE(factor_packed(singular, 2));
}

}  // namespace
}  // namespace lecalib
