// SPDX-License-Identifier: MIT
#include "lecalib/math/gram.hpp"

#include <doctest/doctest.h>

#include <Eigen/Core>
#include <cmath>

#include "lecalib/core/rng.hpp"

namespace lecalib {
namespace {

template <int N>
void check_against_product() {
  Rng rng(5);
  Gram<N> gram;
  Eigen::MatrixXd rows(40, N);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    double z[Gram<N>::kSize] = {};
    for (int j = 0; j < N; ++j) rows(i, j) = z[j] = rng.uniform(-1.0, 1.0);
    gram.add(z);
  }
  const Eigen::MatrixXd truth = rows.transpose() * rows;
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < N; ++j) CHECK(std::abs(gram(i, j) - truth(i, j)) < 1e-13);
  }
}

TEST_CASE("gram: is the product of the rows, for even and odd lengths and both triangles") {
  check_against_product<13>();
  check_against_product<16>();
}

}  // namespace
}  // namespace lecalib
