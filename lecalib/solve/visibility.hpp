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
  double cost = 0.0;         ///< px^2; each point's squared distance to its line, capped
};

/// Adds the points of one view.
/// @param cap_px > 0; no point's distance counts for more, and a point whose line has no image counts that much
void add_visibility(const CalibrationData& data, const View& view, const Camera& camera, const Pose& pose,
                    double cap_px, Visibility* sum);

/// Points of a view that are seen at positive depth: where its pixel's ray, roughly un-distorted, comes nearest to the
/// model line. A line's depth changes sign at its vanishing point only.
std::size_t count_in_front(const CalibrationData& data, const View& view, const Camera& camera, const Pose& pose);

/// Points of a view whose pixel is the image of an ideal point inside the camera's valid radius.
std::size_t count_inside(const CalibrationData& data, const View& view, const Camera& camera);

}  // namespace lecalib
