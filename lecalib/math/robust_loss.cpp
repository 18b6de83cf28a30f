// SPDX-License-Identifier: MIT
#include "lecalib/math/robust_loss.hpp"

#include <cmath>

namespace lecalib {

LossValue evaluate_loss(Loss loss, double width, double squared) {
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
