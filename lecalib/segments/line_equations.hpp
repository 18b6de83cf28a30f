// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "lecalib/segments/moving_line.hpp"

namespace lecalib {

/// How far a line may reasonably depart from a plane's trace: standard deviations of the coefficients, px at 64 px from
/// the middle. Weak knowledge that keeps short or sparse lines from turning and bending after noise.
struct LinePriors {
  float motion_px = 30;  ///< m1 and m2
  float turn_px = 4;     ///< m3
  float bend_px = 2.5F;  ///< m4
};

/// Additive normal equations of the least squares fit of a MovingLine's coefficients to events. Single precision is
/// enough: the entries are of one magnitude, and lines found with it differ from those in double by less than 1e-3 px.
class LineEquations {
 public:
  void add(float s_px, float tau, float d, float weight) noexcept {
    const float s = s_px * kAlongUnit;
    const float row[kNumLineCoefficients] = {1, s, tau, s * tau, s * s};
    float* entry = a_;
    for (int i = 0; i < kNumLineCoefficients; ++i) {
      const float w = weight * row[i];
      for (int j = i; j < kNumLineCoefficients; ++j) *entry++ += w * row[j];
      b_[i] += w * d;
    }
    ++count_;
  }

  [[nodiscard]] std::uint32_t count() const noexcept { return count_; }

  /// Solves by LDL'. @param variance of the events' distance, px^2: the weight of the priors against the events.
  /// @param[out] m           [5]; unchanged unless true
  /// @param[out] covariance  [15] upper triangle by rows, times 1 / variance; may be null
  /// @return false when the equations are not positive definite
  bool solve(const LinePriors& priors, float variance, float* m, float* covariance) const;

 private:
  float a_[15] = {};  // upper triangle by rows
  float b_[kNumLineCoefficients] = {};
  std::uint32_t count_ = 0;
};

}  // namespace lecalib
