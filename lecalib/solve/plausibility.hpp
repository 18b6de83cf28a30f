// SPDX-License-Identifier: MIT
/// The last gate: a converged camera that cannot be true, or that is too uncertain to use, is refused by name.
#pragma once

#include "lecalib/solve/calibration_data.hpp"
#include "lecalib/solve/calibration_result.hpp"
#include "lecalib/solve/refine.hpp"

namespace lecalib {

struct PlausibilityOptions {
  double min_view_deg = 10.0;  ///< bounds of the horizontal field of view of the pinhole part, 2 atan(w / 2f)
  double max_view_deg = 170.0;
  double max_aspect = 1.5;  ///< fx / fy and its inverse: pixels are nearly square
  /// The principal point may lie outside of the image by this share of its size; below 0 it must lie inside by as much.
  double centre_margin = 0.25;
  double min_visible = 0.5;       ///< share of the points that must be in front of the camera
  double min_inside = 0.9;        ///< share of the points inside the image of the distortion's valid radius
  double max_rms_share = 0.01;    ///< of the image width: largest rms_px
  double max_chi2_per_dof = 0;    ///< 0: no bound. Where the given sigmas are true, more means a wrong model
  double max_focal_sigma = 0.3;   ///< of f: largest sigma of fx and fy; larger means undetermined
  double max_centre_sigma = 0.2;  ///< of the width: largest sigma of cx and cy
};

/// Judges result->camera, sigma, rms_px and the poses in `views`.
/// @return ok | implausible_result | undetermined; result->parameter names the intrinsic where it is about one, and is
/// otherwise unchanged
Status check_plausibility(const CalibrationData& data, Span<const RefineView> views, const PlausibilityOptions& options,
                          CalibrationResult* result);

}  // namespace lecalib
