// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/segments/moving_line.hpp"

namespace lecalib {

/// How far a line may reasonably depart from a plane's trace: standard deviations of the coefficients, px at 64 px from
/// the middle. Weak knowledge that keeps short or sparse lines from turning and bending after noise.
struct LinePriors {
  float motion_px = 30;    ///< m1 and m2
  float turn_px = 4;       ///< m3
  float bend_px = 2.5F;    ///< m4
  float bend_mean_px = 0;  ///< what is expected of m4, px at 64 px; of the others it is 0
};

/// Events along a line, as growing and fitting list them, or every so manieth of them.
struct ListedEvents {
  const float* along;   ///< [(count - 1) * stride + 1] s, px
  const float* across;  ///< [as along] d, px
  const float* tau;     ///< [as along]
  std::size_t count;
  std::size_t stride = 1;
};

/// What the events of a weighted fit amount to.
struct WeightedSupport {
  std::uint32_t events = 0;  ///< of weight above zero
  float weight = 0;
  float square = 0;  ///< weighted sum of (r / band)^2
};

/// Additive normal equations of the least squares fit of a MovingLine's coefficients to events. Single precision is
/// enough: the entries are of one magnitude, and lines found with it differ from those in double by less than 1e-3 px.
class LineEquations {
 public:
  void add(float s_px, float tau, float d, float weight) noexcept { add_monomials(s_px, tau, d, weight, sums_); }

  /// Adds all events with weight 1.
  void add(const ListedEvents& events) noexcept;
  /// Adds events with the weight 1 - (r / band)^2, where r is the distance from the line; none beyond the band.
  WeightedSupport add_near(const ListedEvents& events, const MovingLine& line, float band_px) noexcept;

  /// Solves by LDL'. @param variance of the events' distance, px^2: the weight of the priors against the events.
  /// @param[out] m           [5]; unchanged unless true
  /// @param[out] covariance  [15] upper triangle by rows, times 1 / variance; may be null
  /// @return false when the equations are not positive definite
  bool solve(const LinePriors& priors, float variance, float* m, float* covariance) const;

 private:
  /// Products of two of the row's entries 1, s, t, st, s^2 are these twelve monomials; below them those times d.
  enum Sum { k1, kS, kT, kSS, kST, kTT, kSSS, kSST, kSTT, kSSSS, kSSST, kSSTT, kD, kDS, kDT, kDST, kDSS, kNumSums };

  template <class Sums>
  static void add_monomials(float s_px, float t, float d, float weight, Sums&& sums) noexcept {
    const float s = s_px * kAlongUnit;
    const float ws = weight * s;
    const float wt = weight * t;
    const float wss = ws * s;
    const float wst = ws * t;
    const float wsst = wss * t;
    sums[k1] += weight;
    sums[kS] += ws;
    sums[kT] += wt;
    sums[kSS] += wss;
    sums[kST] += wst;
    sums[kTT] += wt * t;
    sums[kSSS] += wss * s;
    sums[kSST] += wsst;
    sums[kSTT] += wst * t;
    sums[kSSSS] += wss * s * s;
    sums[kSSST] += wsst * s;
    sums[kSSTT] += wsst * t;
    sums[kD] += weight * d;
    sums[kDS] += ws * d;
    sums[kDT] += wt * d;
    sums[kDST] += wst * d;
    sums[kDSS] += wss * d;
  }

  struct Lanes;

  float sums_[kNumSums] = {};
};

}  // namespace lecalib
