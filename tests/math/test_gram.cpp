// SPDX-License-Identifier: MIT
#include "lecalib/math/gram.hpp"

#include <doctest/doctest.h>

#include <Eigen/Core>
#include <cmath>

#include "lecalib/core/rng.hpp"

namespace lecalib {
namespace {

template <int M>
void check_against_product() {
  Rng rng(5);
  Gram<16> gram;
  Eigen::MatrixXd rows(40, M);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    double z[16];
    for (double& value : z) value = rng.uniform(-1.0, 1.0);
    const double gain = rng.uniform(0.5, 2.0);
    for (int j = 0; j < M; ++j) rows(i, j) = gain * z[j];
    gram.add<M>(gain, z);
  }
  const Eigen::MatrixXd truth = rows.transpose() * rows;
  for (int i = 0; i < M; ++i) {
    for (int j = 0; j < M; ++j) CHECK(std::abs(gram(i, j) - truth(i, j)) < 1e-12);
  }
}

TEST_CASE("gram: is the product of the rows, for even and odd numbers of columns and both triangles") {
  check_against_product<13>();
  check_against_product<16>();
}

}  // namespace
}  // namespace lecalib
