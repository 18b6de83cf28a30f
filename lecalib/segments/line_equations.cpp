// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_equations.hpp"

namespace lecalib {
namespace {

constexpr int kN = kNumLineCoefficients;
/// Smallest pivot: below it the events say nothing about a coefficient, and neither do the priors.
constexpr float kMinPivot = 1e-6F;

struct Factor {
  float l[kN][kN];  // unit lower triangle
  float d[kN];

  bool factorise(const float (&a)[kN][kN]) {
    for (int i = 0; i < kN; ++i) {
      float pivot = a[i][i];
      for (int k = 0; k < i; ++k) pivot -= l[i][k] * l[i][k] * d[k];
      if (!(pivot > kMinPivot)) return false;
      d[i] = pivot;
      for (int j = i + 1; j < kN; ++j) {
        float v = a[j][i];
        for (int k = 0; k < i; ++k) v -= l[j][k] * l[i][k] * d[k];
        l[j][i] = v / pivot;
      }
    }
    return true;
  }

  void solve_in_place(float* v) const {
    for (int i = 0; i < kN; ++i) {
      for (int k = 0; k < i; ++k) v[i] -= l[i][k] * v[k];
    }
    for (int i = 0; i < kN; ++i) v[i] /= d[i];
    for (int i = kN - 1; i >= 0; --i) {
      for (int k = i + 1; k < kN; ++k) v[i] -= l[k][i] * v[k];
    }
  }
};

}  // namespace

bool LineEquations::solve(const LinePriors& priors, float variance, float* m, float* covariance) const {
  float a[kN][kN];
  const float* entry = a_;
  for (int i = 0; i < kN; ++i) {
    for (int j = i; j < kN; ++j) a[i][j] = a[j][i] = *entry++;
  }
  a[1][1] += variance / (priors.motion_px * priors.motion_px);
  a[2][2] += variance / (priors.motion_px * priors.motion_px);
  a[3][3] += variance / (priors.turn_px * priors.turn_px);
  a[4][4] += variance / (priors.bend_px * priors.bend_px);

  Factor factor{};
  if (!factor.factorise(a)) return false;
  float x[kN];
  for (int i = 0; i < kN; ++i) x[i] = b_[i];
  factor.solve_in_place(x);
  for (int i = 0; i < kN; ++i) m[i] = x[i];
  if (covariance == nullptr) return true;
  for (int i = 0; i < kN; ++i) {
    float column[kN] = {};
    column[i] = 1;
    factor.solve_in_place(column);
    for (int j = i; j < kN; ++j) *covariance++ = column[j];
  }
  return true;
}

}  // namespace lecalib
