// SPDX-License-Identifier: MIT
/// Cholesky's decomposition of symmetric positive definite matrices whose size is known at run time only, stored as
/// lower triangles by rows.
#pragma once

#include <cstddef>

#include "lecalib/core/span.hpp"

namespace lecalib {

/// Place of row i, column j <= i in a lower triangle by rows.
constexpr std::size_t triangle_index(std::size_t i, std::size_t j) noexcept { return i * (i + 1) / 2 + j; }

/// The decomposition takes the place of `a`, of n rows. @return false, `a` overwritten in part, where it is not
/// definite
bool factor_packed(Span<double> a, std::size_t n);

/// With the factor L of n rows: x becomes inverse(L L') x.
void solve_packed(Span<const double> factor, std::size_t n, Span<double> x);

}  // namespace lecalib
