// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "lecalib/math/eigen.hpp"

namespace lecalib {

/// Sweeps after which jacobi_eigen stops whatever is left. Convergence is quadratic: 12 x 12 needs 6 to 9.
inline constexpr int kMaxJacobiSweeps = 30;

namespace detail {

/// Rotates `count` pairs of elements, each the given stride apart.
template <class Real>
inline void rotate_pairs(Real c, Real s, int count, Real* x, int x_stride, Real* y, int y_stride) {
  for (int i = 0; i < count; ++i, x += x_stride, y += y_stride) {
    const Real old = *x;
    *x = c * old - s * *y;
    *y = s * old + c * *y;
  }
}

/// One Jacobi rotation in the (p, q) plane, p < q: annihilates a(p, q) in the upper triangle, the only one in use, and
/// accumulates into `vectors`. Both n x n, column by column.
template <class Real>
inline void jacobi_rotate(int n, int p, int q, Real* a, Real* vectors) {
  Real* const ap = a + p * n;
  Real* const aq = a + q * n;
  const Real theta = (aq[q] - ap[p]) / (Real(2) * aq[p]);
  const Real magnitude = theta < Real(0) ? -theta : theta;
  // A huge theta (also one that overflowed) means that the element is already nothing beside the diagonal's gap.
  const Real t = (theta < Real(0) ? Real(-1) : Real(1)) / (magnitude + std::sqrt(theta * theta + Real(1)));
  const Real c = Real(1) / std::sqrt(t * t + Real(1));
  const Real s = t * c;
  ap[p] -= t * aq[p];
  aq[q] += t * aq[p];
  aq[p] = Real(0);
  rotate_pairs(c, s, p, ap, 1, aq, 1);                          // above the diagonal element of p
  rotate_pairs(c, s, q - p - 1, ap + p + n, n, aq + p + 1, 1);  // row p against column q
  rotate_pairs(c, s, n - 1 - q, aq + p + n, n, aq + q + n, n);  // rows p and q
  rotate_pairs(c, s, n, vectors + p * n, 1, vectors + q * n, 1);
}

template <class Real>
inline void sort_ascending(int n, Real* values, Real* vectors) {
  for (int i = 0; i + 1 < n; ++i) {
    const int least = static_cast<int>(std::min_element(values + i, values + n) - values);
    if (least == i) continue;
    std::swap(values[i], values[least]);
    std::swap_ranges(vectors + i * n, vectors + (i + 1) * n, vectors + least * n);
  }
}

/// jacobi_eigen() of any size, so that programs hold it once. `a` is used up, `vectors` begin as the unit matrix.
template <class Real>
inline void jacobi_diagonalise(int n, Real* a, Real* values, Real* vectors) {
  Real largest = Real(0);
  for (int i = 0; i < n * n; ++i) largest = std::max(largest, std::abs(a[i]));
  const Real negligible = std::numeric_limits<Real>::epsilon() * largest / static_cast<Real>(n);
  for (int sweep = 0; sweep < kMaxJacobiSweeps; ++sweep) {
    bool rotated = false;
    for (int p = 0; p + 1 < n; ++p) {
      for (int q = p + 1; q < n; ++q) {
        // Written so that a NaN does not rotate, hence ends the sweeps.
        if (!(std::abs(a[q * n + p]) > negligible)) continue;
        jacobi_rotate(n, p, q, a, vectors);
        rotated = true;
      }
    }
    if (!rotated) break;
  }
  for (int i = 0; i < n; ++i) values[i] = a[i * n + i];
  sort_ascending(n, values, vectors);
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
  detail::jacobi_diagonalise(N, work.data(), values->data(), vectors->data());
}

}  // namespace lecalib
