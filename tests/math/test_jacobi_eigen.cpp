// SPDX-License-Identifier: MIT
#include "lecalib/math/jacobi_eigen.hpp"

#include <doctest/doctest.h>

#include <limits>

#include "lecalib/core/rng.hpp"
#include "support/dense_algebra.hpp"

namespace lecalib {
namespace {

template <class Real, int N>
Eigen::Matrix<Real, N, N> random_symmetric(Rng& rng) {
  Eigen::Matrix<Real, N, N> a;
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j <= i; ++j) a(i, j) = a(j, i) = static_cast<Real>(rng.uniform(-1.0, 1.0));
  }
  return a;
}

/// |A V - V diag| is below `slack` |A|, |V'V - I| below `slack`, and so is the distance to Eigen's eigenvalues.
void check_decomposition(const Eigen::MatrixXd& A, const Eigen::VectorXd& values, const Eigen::MatrixXd& V,
                         double slack) {
  const double tolerance = slack * (A.norm() + std::numeric_limits<double>::min());
  CHECK((values - test::dense_eigenvalues(A)).cwiseAbs().maxCoeff() <= tolerance);
  CHECK((test::dense_product(A, V) - V * values.asDiagonal()).norm() <= tolerance);
  CHECK((test::dense_product(V.transpose(), V) - Eigen::MatrixXd::Identity(A.rows(), A.rows())).norm() <= slack);
  for (Eigen::Index i = 0; i + 1 < values.size(); ++i) CHECK(values(i) <= values(i + 1));
}

/// `slack` in units of Real's epsilon.
template <class Real, int N>
void check_against_eigen(const Eigen::Matrix<Real, N, N>& a, Real slack) {
  Eigen::Matrix<Real, N, 1> values;
  Eigen::Matrix<Real, N, N> vectors;
  jacobi_eigen(a, &values, &vectors);
  check_decomposition(a.template cast<double>(), values.template cast<double>(), vectors.template cast<double>(),
                      static_cast<double>(slack * std::numeric_limits<Real>::epsilon()));
}

TEST_CASE_TEMPLATE("jacobi_eigen agrees with Eigen on random symmetric matrices", Real, float, double) {
  Rng rng(1);
  for (int i = 0; i < 50; ++i) {
    check_against_eigen<Real, 2>(random_symmetric<Real, 2>(rng), Real(30));
    check_against_eigen<Real, 3>(random_symmetric<Real, 3>(rng), Real(30));
    check_against_eigen<Real, 6>(random_symmetric<Real, 6>(rng), Real(60));
    check_against_eigen<Real, 12>(random_symmetric<Real, 12>(rng), Real(120));
  }
}

TEST_CASE("jacobi_eigen handles rank one, equal eigenvalues, zero and badly scaled matrices") {
  Rng rng(2);
  const Eigen::Matrix<double, 9, 1> v = random_symmetric<double, 9>(rng).col(3);
  check_against_eigen<double, 9>(v * v.transpose(), 60.0);
  check_against_eigen<double, 4>(3.0 * Eigen::Matrix4d::Identity(), 30.0);
  check_against_eigen<double, 3>(Mat3::Zero(), 30.0);
  check_against_eigen<double, 3>(Vec3(1e-20, 1.0, 1e20).asDiagonal().toDenseMatrix(), 30.0);
  check_against_eigen<double, 3>(1e-120 * random_symmetric<double, 3>(rng), 30.0);
}

TEST_CASE("jacobi_eigen ends on a NaN") {
  Mat3 a = Mat3::Constant(std::numeric_limits<double>::quiet_NaN());
  Vec3 values;
  Mat3 vectors;
  jacobi_eigen(a, &values, &vectors);
  CHECK_FALSE(values.allFinite());
}

}  // namespace
}  // namespace lecalib
