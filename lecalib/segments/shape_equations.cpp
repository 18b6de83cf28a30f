// SPDX-License-Identifier: MIT
#include "lecalib/segments/shape_equations.hpp"

#include <cmath>

namespace lecalib {
namespace {

constexpr int kTerms = kNumShapeTerms;

/// Powers of u and tau that the terms have.
constexpr int kPowerOfU[kTerms] = {0, 1, 0, 1, 2, 0, 1, 2, 3, 4};
constexpr int kPowerOfTau[kTerms] = {0, 0, 1, 1, 0, 2, 2, 1, 0, 0};
/// Highest power of tau in products of two terms, by the power of u.
constexpr int kLastTau[] = {4, 4, 4, 3, 2, 2, 1, 0, 0};
constexpr int kLastU = 8;

void terms_at(float u, float tau, float* row) {
  row[0] = 1;
  row[1] = u;
  row[2] = tau;
  row[3] = u * tau;
  row[4] = u * u;
  row[5] = tau * tau;
  row[6] = row[1] * row[5];
  row[7] = row[4] * tau;
  row[8] = row[4] * u;
  row[9] = row[4] * row[4];
}

/// Adds the monomial u^kU tau^kTau, times a weight, to its sum and goes on to the others. @param of_u  u^kU, weighted
template <int kU, int kTau, class Sums>
void add_monomials(float u, float tau, float of_u, float monomial, Sums& sums) {
  sums[kU][kTau] += monomial;
  if constexpr (kTau < kLastTau[kU]) {
    add_monomials<kU, kTau + 1>(u, tau, of_u, monomial * tau, sums);
  } else if constexpr (kU < kLastU) {
    add_monomials<kU + 1, 0>(u, tau, of_u * u, of_u * u, sums);
  }
}

}  // namespace

ShapeEquations::ShapeEquations(float variance) noexcept {
  constexpr float kUnknown = 1e6F;  // of the terms that nothing is known of: 1 / (px of sigma)
  for (int i = 0; i < kTerms; ++i) a_[i][i] = kUnknown;
  a_[0][0] = 1 / std::sqrt(variance);
}

void ShapeEquations::add(float u, float tau, float weight, float residual) noexcept {
  add_monomials<0, 0>(u, tau, weight, weight, sums_);
  float row[kTerms];
  terms_at(u, tau, row);
  const float weighted = weight * residual;
  for (int i = 0; i < kTerms; ++i) b_[i] += weighted * row[i];
}

void ShapeEquations::add_prior(int term, float sigma, float value) noexcept {
  const float weight = 1 / (sigma * sigma);
  a_[term][term] += weight;
  b_[term] -= weight * value;
}

bool ShapeEquations::solve(float* change) noexcept {
  constexpr float kMinPivot = 1e-9F;
  for (int i = 0; i < kTerms; ++i) {
    for (int j = 0; j <= i; ++j) a_[i][j] += sums_[kPowerOfU[i] + kPowerOfU[j]][kPowerOfTau[i] + kPowerOfTau[j]];
  }
  for (int i = 0; i < kTerms; ++i) {
    for (int j = 0; j <= i; ++j) {
      float v = a_[i][j];
      for (int k = 0; k < j; ++k) v -= a_[i][k] * a_[j][k];
      if (j < i) {
        a_[i][j] = v / a_[j][j];
      } else if (v > kMinPivot) {
        a_[i][i] = std::sqrt(v);
      } else {
        return false;
      }
    }
  }
  float x[kTerms];
  for (int i = 0; i < kTerms; ++i) {
    x[i] = b_[i];
    for (int k = 0; k < i; ++k) x[i] -= a_[i][k] * x[k];
    x[i] /= a_[i][i];
  }
  for (int i = kTerms - 1; i >= 0; --i) {
    for (int k = i + 1; k < kTerms; ++k) x[i] -= a_[k][i] * x[k];
    x[i] /= a_[i][i];
  }
  for (int i = 0; i < kTerms; ++i) change[i] = x[i];
  return true;
}

float ShapeEquations::variance(float u, float tau) const noexcept {
  float v[kTerms];
  terms_at(u, tau, v);
  float sum = 0;
  for (int i = 0; i < kTerms; ++i) {
    for (int k = 0; k < i; ++k) v[i] -= a_[i][k] * v[k];
    v[i] /= a_[i][i];
    sum += v[i] * v[i];
  }
  return sum;
}

}  // namespace lecalib
