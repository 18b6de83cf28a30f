// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>

namespace lecalib {

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

inline LossValue evaluate_loss(Loss loss, double width, double squared) {
  const double width2 = width * width;
  switch (loss) {
    case Loss::huber: {
      if (!(squared > width2)) break;
      const double size = std::sqrt(squared);
      return {2.0 * width * size - width2, width / size};
    }
    case Loss::geman: {
      const double share = width2 / (width2 + squared);
      return {squared * share, share * share};
    }
    case Loss::squared: break;
  }
  return {squared, 1.0};
}

}  // namespace lecalib
