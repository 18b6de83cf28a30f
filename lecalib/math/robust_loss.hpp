// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace lecalib {

/// Sigma of a Gaussian over the median of its absolute value.
inline constexpr double kGaussianOverMedian = 1.4826;

/// How a residual counts beyond `width` sigmas.
enum class Loss : std::uint8_t {
  squared,  ///< least squares: all the same
  huber,    ///< linear beyond the width: an outlier pulls with the force of `width` sigmas
  geman,    ///< Geman and McClure: bounded, an outlier pulls ever less; needs a start that is near
};

/// rho(s) of the squared residual s (in sigmas squared) and its derivative, the weight of the residual's square.
struct LossValue {
  double rho;
  double weight;
};

LossValue evaluate_loss(Loss loss, double width, double squared);

}  // namespace lecalib
