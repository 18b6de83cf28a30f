// SPDX-License-Identifier: MIT
#pragma once

namespace lecalib {

/// Number of terms of a line's shape: 1, u, tau, u tau, u^2, tau^2, u tau^2, u^2 tau, u^3, u^4.
inline constexpr int kNumShapeTerms = 10;

/// The shape's value at (u, tau), px.
inline float shape_at(const float* c, float u, float tau) noexcept {
  return c[0] + u * (c[1] + u * (c[4] + u * (c[8] + u * c[9]))) +
         tau * (c[2] + u * (c[3] + u * c[7]) + tau * (c[5] + u * c[6]));
}

/// Normal equations of a least squares fit of a shape's terms, u and tau within -1 to 1: single precision is enough.
class ShapeEquations {
 public:
  ShapeEquations() = default;
  /// Solved equations that know nothing but the constant term, with this variance, px^2 > 0.
  explicit ShapeEquations(float variance) noexcept;

  /// Adds a residual with its weight (1 / its variance).
  void add(float u, float tau, float weight, float residual) noexcept;
  /// Draws a term, whose present value is given, towards 0. @param sigma  of the term, px, > 0
  void add_prior(int term, float sigma, float value) noexcept;

  /// Solves by Cholesky's decomposition, which takes the place of the equations.
  /// @param[out] change  [kNumShapeTerms] unchanged unless true
  /// @return false when the equations are not positive definite
  bool solve(float* change) noexcept;

  /// Variance of the shape at (u, tau), px^2. Call after solve().
  [[nodiscard]] float variance(float u, float tau) const noexcept;

 private:
  float sums_[9][5] = {};                         // by the powers of u and tau, which the products of two terms share
  float a_[kNumShapeTerms][kNumShapeTerms] = {};  // priors; after solve() the Cholesky factor, lower triangle
  float b_[kNumShapeTerms] = {};
};

}  // namespace lecalib
