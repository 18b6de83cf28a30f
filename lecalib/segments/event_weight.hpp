// SPDX-License-Identifier: MIT
/// The weight 1 - (r / band)^2 that fits give to an event at distance r from the line, and what follows from it.
#pragma once

#include <algorithm>

namespace lecalib {

/// E[w r^2] / E[w] of a normal distribution under that weight, cut at 3 sigma, in sigma^2.
inline constexpr float kWeightedVariance = 0.78F;
/// Events of one edge are not independent: the pixel grid and the thresholds tie neighbours together.
inline constexpr float kVarianceInflation = 1.2F;

/// The band of events whose distance has this one-sigma, px: 3 sigma, within what pixels and crossings allow.
inline float weight_band(float sigma_px) noexcept {
  constexpr float kSigmas = 3;
  constexpr float kMinPx = 1.2F;
  constexpr float kMaxPx = 4.5F;
  return std::clamp(kSigmas * sigma_px, kMinPx, kMaxPx);
}

/// How far past its ends a line takes events, px.
inline constexpr float kBeyondEndsPx = 6;

/// The band of events that a line takes for its own, whose distance has this one-sigma, px.
inline float claimed_band(float sigma_px) noexcept {
  constexpr float kSigmas = 3.5F;
  constexpr float kMinPx = 2;
  return std::max(kMinPx, kSigmas * sigma_px);
}

}  // namespace lecalib
