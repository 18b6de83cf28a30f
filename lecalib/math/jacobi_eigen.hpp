// SPDX-License-Identifier: MIT
#pragma once

#include <limits>

#include "lecalib/math/eigen.hpp"

namespace lecalib {

/// Sweeps after which jacobi_eigen stops whatever is left. Convergence is quadratic: 12 x 12 needs 6 to 9.
inline constexpr int kMaxJacobiSweeps = 30;

namespace detail {

template <class Real>
void rotate_pair(Real c, Real s, Real& x, Real& y) {
  const Real old = x;
  x = c * old - s * y;
  y = s * old + c * y;
}

/// One Jacobi rotation in the (p, q) plane, p < q: annihilates a(p, q) in the upper triangle, the only one in use, and
/// accumulates into `vectors`.
template <class Real, int N>
void jacobi_rotate(int p, int q, Eigen::Matrix<Real, N, N>& a, Eigen::Matrix<Real, N, N>& vectors) {
  const Real theta = (a(q, q) - a(p, p)) / (Real(2) * a(p, q));
  const Real magnitude = theta < Real(0) ? -theta : theta;
  // A huge theta (also one that overflowed) means that the element is already nothing beside the diagonal's gap.
  const Real t = (theta < Real(0) ? Real(-1) : Real(1)) / (magnitude + Eigen::numext::sqrt(theta * theta + Real(1)));
  const Real c = Real(1) / Eigen::numext::sqrt(t * t + Real(1));
  const Real s = t * c;
  a(p, p) -= t * a(p, q);
  a(q, q) += t * a(p, q);
  a(p, q) = Real(0);
  for (int i = 0; i < p; ++i) rotate_pair(c, s, a(i, p), a(i, q));
  for (int i = p + 1; i < q; ++i) rotate_pair(c, s, a(p, i), a(i, q));
  for (int i = q + 1; i < N; ++i) rotate_pair(c, s, a(p, i), a(q, i));
  for (int i = 0; i < N; ++i) rotate_pair(c, s, vectors(i, p), vectors(i, q));
}

template <class Real, int N>
void sort_ascending(Eigen::Matrix<Real, N, 1>& values, Eigen::Matrix<Real, N, N>& vectors) {
  for (int i = 0; i + 1 < N; ++i) {
    int least = i;
    for (int j = i + 1; j < N; ++j) {
      if (values(j) < values(least)) least = j;
    }
    if (least == i) continue;
    const Real value = values(i);
    values(i) = values(least);
    values(least) = value;
    vectors.col(i).swap(vectors.col(least));
  }
}

}  // namespace detail

/// Eigenvalues and eigenvectors of a symmetric matrix by cyclic Jacobi rotations; + - * / and sqrt only, so the same
/// bits on every target. Backward stable: the residual |A V - V diag(values)| is a few eps |A|.
/// @param a symmetric, finite; only equality of both triangles is assumed, not definiteness
/// @param[out] values  ascending
/// @param[out] vectors orthonormal columns in the order of `values`; signs are not normalised
/// Complexity O(N^3) per sweep, at most kMaxJacobiSweeps.
template <class Real, int N>
void jacobi_eigen(const Eigen::Matrix<Real, N, N>& a, Eigen::Matrix<Real, N, 1>* values,
                  Eigen::Matrix<Real, N, N>* vectors) {
  static_assert(N >= 2 && N <= 12, "small matrices only: all N x N live on the stack");
  Eigen::Matrix<Real, N, N> work = a;
  vectors->setIdentity();
  const Real negligible = std::numeric_limits<Real>::epsilon() * a.cwiseAbs().maxCoeff() / Real(N);
  for (int sweep = 0; sweep < kMaxJacobiSweeps; ++sweep) {
    bool rotated = false;
    for (int p = 0; p + 1 < N; ++p) {
      for (int q = p + 1; q < N; ++q) {
        // Written so that a NaN does not rotate, hence ends the sweeps.
        if (!(work(p, q) > negligible || work(p, q) < -negligible)) continue;
        detail::jacobi_rotate(p, q, work, *vectors);
        rotated = true;
      }
    }
    if (!rotated) break;
  }
  *values = work.diagonal();
  detail::sort_ascending(*values, *vectors);
}

}  // namespace lecalib
