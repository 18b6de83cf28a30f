// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include "lecalib/math/cholesky.hpp"
#include "lecalib/math/eigen.hpp"
#include "lecalib/math/jacobi_eigen.hpp"

namespace lecalib {

namespace detail {

/// By inverse iteration: one Cholesky factorisation finds the vector and another one proves it, in place of the Jacobi
/// solver's many rotations. With the Rayleigh quotient m of the unit vector x, r = |A x - m x| and any s > m: if
/// A + c x x' - s I is positive definite for some c > 0, then A has one eigenvalue below s only (a matrix of rank one
/// lifts no more than one past it), and x is off its vector by r / (s - m) at most (Parlett 1980, theorem 11.7.1).
/// @return false, *x unchanged, where that proves nothing: other eigenvalues are near
template <int N>
bool prove_smallest_eigenvector(const Eigen::Matrix<double, N, N>& a, Eigen::Matrix<double, N, 1>* x) {
  constexpr double kShift = 1e-13;    // of the trace: keeps the factors of a singular matrix finite
  constexpr double kGap = 1e-8;       // of the trace, at least, to the second eigenvalue
  constexpr double kMaxError = 1e-8;  // radians
  constexpr double kSettled = 1e-20;  // squared change
  constexpr int kMaxIterations = 20;  // enough where the second eigenvalue is three times the first
  using Vector = Eigen::Matrix<double, N, 1>;
  const double trace = a.trace();
  Cholesky<N> factor;
  Eigen::Matrix<double, N, N> shifted = a;
  shifted.diagonal().array() += kShift * trace;
  if (!factor.factor(shifted)) return false;
  Vector v = Vector::Ones() / std::sqrt(static_cast<double>(N));
  for (int i = 0; i < kMaxIterations; ++i) {
    Vector next = factor.solve(v);
    next /= next.norm();
    if (next.dot(v) < 0.0) next = -next;
    const double change2 = (next - v).squaredNorm();
    v = next;
    if (!(change2 > kSettled)) break;
  }
  const Vector image = a.lazyProduct(v);
  const double quotient = v.dot(image);
  const double bound = std::max(2.0 * quotient, kGap * trace);
  if (!((image - quotient * v).norm() <= kMaxError * (bound - quotient))) return false;
  shifted = a + trace * v.lazyProduct(v.transpose());
  shifted.diagonal().array() -= bound;
  if (!factor.factor(shifted)) return false;
  *x = v;
  return true;
}

}  // namespace detail

/// The unit eigenvector of the smallest eigenvalue of a symmetric positive semidefinite matrix, either sign.
/// @param min_gap > 1e-14; of the largest eigenvalue
/// @return false, *x unchanged, where the second smallest eigenvalue is not above that: the vector is not unique
template <int N>
bool smallest_eigenvector(const Eigen::Matrix<double, N, N>& a, double min_gap, Eigen::Matrix<double, N, 1>* x) {
  if (detail::prove_smallest_eigenvector(a, x)) return true;
  Eigen::Matrix<double, N, 1> values;
  Eigen::Matrix<double, N, N> vectors;
  jacobi_eigen(a, &values, &vectors);
  if (!(values(1) > min_gap * values(N - 1))) return false;
  *x = vectors.col(0);
  return true;
}

}  // namespace lecalib
