// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "lecalib/math/eigen.hpp"

namespace lecalib {

/// Cholesky factors of a small symmetric positive definite matrix, scaled to a unit diagonal first: parameters of any
/// units may be mixed, and each pivot in (0, 1] tells which share of its parameter's information the parameters before
/// it do not explain.
template <int N>
class Cholesky {
 public:
  using Matrix = Eigen::Matrix<double, N, N>;

  /// Reads the lower triangle of `a`.
  /// @return false where a diagonal element is not positive or a pivot not above `min_pivot`
  bool factor(const Matrix& a, double min_pivot = 1e-14) {
    for (int i = 0; i < N; ++i) {
      if (!(a(i, i) > 0.0) || !std::isfinite(a(i, i))) return false;
      scale_(i) = 1.0 / std::sqrt(a(i, i));
    }
    for (int j = 0; j < N; ++j) {
      double pivot = 1.0;
      for (int k = 0; k < j; ++k) pivot -= L_(j, k) * L_(j, k);
      if (!(pivot > min_pivot)) return false;
      inverse_(j) = 1.0 / std::sqrt(pivot);
      for (int i = j + 1; i < N; ++i) {
        double sum = a(i, j) * scale_(i) * scale_(j);
        for (int k = 0; k < j; ++k) sum -= L_(i, k) * L_(j, k);
        L_(i, j) = sum * inverse_(j);
      }
    }
    return true;
  }

  /// inverse(L) b with a = L L', so that its squared norm is b' inverse(a) b.
  [[nodiscard]] Eigen::Matrix<double, N, 1> whiten(const Eigen::Matrix<double, N, 1>& b) const {
    Eigen::Matrix<double, N, 1> x;
    for (int i = 0; i < N; ++i) {
      double sum = b(i) * scale_(i);
      for (int k = 0; k < i; ++k) sum -= L_(i, k) * x(k);
      x(i) = sum * inverse_(i);
    }
    return x;
  }

  /// inverse(a) b for M right-hand sides.
  template <int M>
  [[nodiscard]] Eigen::Matrix<double, N, M> solve(const Eigen::Matrix<double, N, M>& b) const {
    Eigen::Matrix<double, N, M> x;
    for (int c = 0; c < M; ++c) {
      for (int i = 0; i < N; ++i) {
        double sum = b(i, c) * scale_(i);
        for (int k = 0; k < i; ++k) sum -= L_(i, k) * x(k, c);
        x(i, c) = sum * inverse_(i);
      }
      for (int i = N - 1; i >= 0; --i) {
        double sum = x(i, c);
        for (int k = i + 1; k < N; ++k) sum -= L_(k, i) * x(k, c);
        x(i, c) = sum * inverse_(i);
      }
      for (int i = 0; i < N; ++i) x(i, c) *= scale_(i);
    }
    return x;
  }

  /// inverse(a), at a third of what solving for it costs.
  [[nodiscard]] Matrix inverse() const {
    Matrix x;  // inverse(L) in the lower triangle, until its columns have had their last use
    for (int j = 0; j < N; ++j) {
      x(j, j) = inverse_(j);
      for (int i = j + 1; i < N; ++i) {
        double sum = 0.0;
        for (int k = j; k < i; ++k) sum -= L_(i, k) * x(k, j);
        x(i, j) = sum * inverse_(i);
      }
    }
    for (int j = 0; j < N; ++j) {
      for (int i = j; i < N; ++i) {
        double sum = 0.0;
        for (int k = i; k < N; ++k) sum += x(k, i) * x(k, j);
        x(i, j) = x(j, i) = sum * scale_(i) * scale_(j);
      }
    }
    return x;
  }

 private:
  Matrix L_;                             // strictly lower triangle
  Eigen::Matrix<double, N, 1> inverse_;  // of the diagonal
  Eigen::Matrix<double, N, 1> scale_;
};

}  // namespace lecalib
