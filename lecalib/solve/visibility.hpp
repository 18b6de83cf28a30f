// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "lecalib/core/records.hpp"
#include "lecalib/solve/calibration_data.hpp"

namespace lecalib {

/// How measured points lie to a camera and a pose.
struct Visibility {
  std::size_t points = 0;
  std::size_t in_front = 0;  ///< whose foot on the model line has positive depth
  std::size_t inside = 0;    ///< whose pixel is the image of an ideal point inside the valid radius
  double cost = 0.0;         ///< px^2; each point's squared distance to its line, capped at cap_px^2
  double cap_px = 1e3;
};

/// Adds the points of one view.
void add_visibility(const CalibrationData& data, const View& view, const Camera& camera, const Pose& pose,
                    Visibility* sum);

}  // namespace lecalib
