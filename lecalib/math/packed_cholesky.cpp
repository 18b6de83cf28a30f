// SPDX-License-Identifier: MIT
#include "lecalib/math/packed_cholesky.hpp"

#include <cmath>

namespace lecalib {

bool factor_packed(Span<double> a, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    double* const row = &a[triangle_index(i, 0)];
    for (std::size_t j = 0; j <= i; ++j) {
      const double* const other = &a[triangle_index(j, 0)];
      double v = row[j];
      for (std::size_t k = 0; k < j; ++k) v -= row[k] * other[k];
      if (j < i) {
        row[j] = v / other[j];
      } else if (v > 0) {
        row[i] = std::sqrt(v);
      } else {
        return false;
      }
    }
  }
  return true;
}

void solve_packed(Span<const double> factor, std::size_t n, Span<double> x) {
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < i; ++k) x[i] -= factor[triangle_index(i, k)] * x[k];
    x[i] /= factor[triangle_index(i, i)];
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) x[i] -= factor[triangle_index(k, i)] * x[k];
    x[i] /= factor[triangle_index(i, i)];
  }
}

}  // namespace lecalib
