// SPDX-License-Identifier: MIT
/// The oracle for every analytic Jacobian: finite differences.
#pragma once

#include "lecalib/math/eigen.hpp"

namespace lecalib::test {

/// d f / d x at x, M x N, by the fourth-order central difference (error O(step^4) plus rounding / step).
/// On a manifold, differentiate the lambda over the increment at zero:
///
///     numeric_jacobian<2, 3>([&](const Vec3& w) { return f(R * exp_so3(w)); }, Vec3::Zero());
///
/// @param step the increment of each coordinate, in that coordinate's unit.
template <int M, int N, class Function>
Eigen::Matrix<double, M, N> numeric_jacobian(Function&& f, const Eigen::Matrix<double, N, 1>& x, double step = 1e-3) {
  Eigen::Matrix<double, M, N> jacobian;
  for (int column = 0; column < N; ++column) {
    const auto at = [&](double offset) {
      Eigen::Matrix<double, N, 1> moved = x;
      moved(column) += offset;
      return Eigen::Matrix<double, M, 1>(f(moved));
    };
    jacobian.col(column) = (8.0 * (at(step) - at(-step)) - (at(2.0 * step) - at(-2.0 * step))) / (12.0 * step);
  }
  return jacobian;
}

/// max |a - b| / max(1, max |b|): a Jacobian with large entries is compared relative to its largest.
template <class DerivedA, class DerivedB>
double jacobian_error(const Eigen::MatrixBase<DerivedA>& a, const Eigen::MatrixBase<DerivedB>& b) {
  const double scale = b.cwiseAbs().maxCoeff();
  return (a - b).cwiseAbs().maxCoeff() / (scale > 1.0 ? scale : 1.0);
}

}  // namespace lecalib::test
