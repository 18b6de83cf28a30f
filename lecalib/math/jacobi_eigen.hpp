// SPDX-License-Identifier: MIT
#pragma once

#include <limits>

#include "lecalib/math/eigen.hpp"

namespace lecalib {

/// Sweeps after which jacobi_eigen stops whatever is left. Convergence is quadratic: 12 x 12 needs 6 to 9.
inline constexpr int kMaxJacobiSweeps = 30;

namespace detail {

/// Rotates `count` pairs of elements, each the given stride apart.
template <class Real>
void rotate_pairs(Real c, Real s, int count, Real* x, int x_stride, Real* y, int y_stride) {
  for (int i = 0; i < count; ++i, x += x_stride, y += y_stride) {
    const Real old = *x;
    *x = c * old - s * *y;
    *y = s * old + c * *y;
  }
}

/// One Jacobi rotation in the (p, q) plane, p < q: annihilates a(p, q) in the upper triangle, the only one in use, and
/// accumulates into `vectors`, if they are wanted.
template <class Real, int N>
void jacobi_rotate(int p, int q, Eigen::Matrix<Real, N, N>& a, Eigen::Matrix<Real, N, N>* vectors) {
  const Real theta = (a(q, q) - a(p, p)) / (Real(2) * a(p, q));
  const Real magnitude = theta < Real(0) ? -theta : theta;
  // A huge theta (also one that overflowed) means that the element is already nothing beside the diagonal's gap.
  const Real t = (theta < Real(0) ? Real(-1) : Real(1)) / (magnitude + Eigen::numext::sqrt(theta * theta + Real(1)));
  const Real c = Real(1) / Eigen::numext::sqrt(t * t + Real(1));
  const Real s = t * c;
  a(p, p) -= t * a(p, q);
  a(q, q) += t * a(p, q);
  a(p, q) = Real(0);
  Real* const ap = a.data() + p * N;  // columns
  Real* const aq = a.data() + q * N;
  rotate_pairs(c, s, p, ap, 1, aq, 1);                          // above the diagonal element of p
  rotate_pairs(c, s, q - p - 1, ap + p + N, N, aq + p + 1, 1);  // row p against column q
  rotate_pairs(c, s, N - 1 - q, aq + p + N, N, aq + q + N, N);  // rows p and q
  if (vectors != nullptr) rotate_pairs(c, s, N, vectors->data() + p * N, 1, vectors->data() + q * N, 1);
}

template <class Real, int N>
void sort_ascending(Eigen::Matrix<Real, N, 1>& values, Eigen::Matrix<Real, N, N>* vectors) {
  for (int i = 0; i + 1 < N; ++i) {
    int least = i;
    for (int j = i + 1; j < N; ++j) {
      if (values(j) < values(least)) least = j;
    }
    if (least == i) continue;
    const Real value = values(i);
    values(i) = values(least);
    values(least) = value;
    if (vectors != nullptr) vectors->col(i).swap(vectors->col(least));
  }
}

}  // namespace detail

/// Eigenvalues and eigenvectors of a symmetric matrix by cyclic Jacobi rotations; + - * / and sqrt only, so the same
/// bits on every target. Backward stable: the residual |A V - V diag(values)| is a few eps |A|.
/// @param a symmetric, finite; only equality of both triangles is assumed, not definiteness
/// @param[out] values  ascending
/// @param[out] vectors orthonormal columns in the order of `values`; signs are not normalised; may be null
/// Complexity O(N^3) per sweep, at most kMaxJacobiSweeps.
template <class Real, int N>
void jacobi_eigen(const Eigen::Matrix<Real, N, N>& a, Eigen::Matrix<Real, N, 1>* values,
                  Eigen::Matrix<Real, N, N>* vectors) {
  static_assert(N >= 2 && N <= 12, "small matrices only: all N x N live on the stack");
  Eigen::Matrix<Real, N, N> work = a;
  if (vectors != nullptr) vectors->setIdentity();
  const Real negligible = std::numeric_limits<Real>::epsilon() * a.cwiseAbs().maxCoeff() / Real(N);
  for (int sweep = 0; sweep < kMaxJacobiSweeps; ++sweep) {
    bool rotated = false;
    for (int p = 0; p + 1 < N; ++p) {
      for (int q = p + 1; q < N; ++q) {
        // Written so that a NaN does not rotate, hence ends the sweeps.
        if (!(work(p, q) > negligible || work(p, q) < -negligible)) continue;
        detail::jacobi_rotate(p, q, work, vectors);
        rotated = true;
      }
    }
    if (!rotated) break;
  }
  *values = work.diagonal();
  detail::sort_ascending(*values, vectors);
}

}  // namespace lecalib
