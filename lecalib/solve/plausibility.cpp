// SPDX-License-Identifier: MIT
#include "lecalib/solve/plausibility.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/trigonometry.hpp"
#include "lecalib/solve/visibility.hpp"

namespace lecalib {
namespace {

bool all_finite(const CalibrationResult& result) {
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    if (!std::isfinite(result.camera.*kIntrinsics[i]) || !std::isfinite(result.sigma[i])) return false;
  }
  return std::isfinite(result.rms_px);
}

/// The intrinsic outside of its plausible range, or kNoParameter.
std::uint8_t implausible_parameter(const CalibrationData& data, const PlausibilityOptions& options, const Camera& c) {
  const double widest = 0.5 * data.width / tangent(deg_to_rad(0.5 * options.max_view_deg));
  const double narrowest = 0.5 * data.width / tangent(deg_to_rad(0.5 * options.min_view_deg));
  if (!(c.fx >= widest && c.fx <= narrowest)) return kFx;
  if (!(c.fy >= widest && c.fy <= narrowest) || !(std::max(c.fx / c.fy, c.fy / c.fx) <= options.max_aspect)) return kFy;
  const double margin_x = options.centre_margin * data.width;
  const double margin_y = options.centre_margin * data.height;
  if (!(c.cx >= -margin_x && c.cx <= data.width + margin_x)) return kCx;
  if (!(c.cy >= -margin_y && c.cy <= data.height + margin_y)) return kCy;
  return kNoParameter;
}

std::uint8_t undetermined_parameter(const CalibrationData& data, const PlausibilityOptions& options,
                                    const CalibrationResult& result) {
  if (!(result.sigma[kFx] <= options.max_focal_sigma * result.camera.fx)) return kFx;
  if (!(result.sigma[kFy] <= options.max_focal_sigma * result.camera.fy)) return kFy;
  if (!(result.sigma[kCx] <= options.max_centre_sigma * data.width)) return kCx;
  if (!(result.sigma[kCy] <= options.max_centre_sigma * data.width)) return kCy;
  return kNoParameter;
}

}  // namespace

Status check_plausibility(const CalibrationData& data, Span<const RefineView> views, const PlausibilityOptions& options,
                          CalibrationResult* result) {
  if (!all_finite(*result)) return Status::numerical_failure;
  const std::uint8_t implausible = implausible_parameter(data, options, result->camera);
  const std::uint8_t undetermined = undetermined_parameter(data, options, *result);
  if (undetermined != kNoParameter) {  // first: a value that the data do not tell may be anywhere
    result->parameter = undetermined;
    return Status::undetermined;
  }
  if (implausible != kNoParameter) {
    result->parameter = implausible;
    return Status::implausible_result;
  }
  std::size_t seen = 0;
  std::size_t in_front = 0;
  std::size_t inside = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!views[v].used) continue;
    seen += count_points(data, data.views[v]);
    in_front += count_in_front(data, data.views[v], result->camera, views[v].pose);
    inside += count_inside(data, data.views[v], result->camera);
  }
  const auto points = static_cast<double>(seen);
  if (!(static_cast<double>(inside) >= options.min_inside * points)) {
    result->parameter = kK1;
    return Status::implausible_result;
  }
  if (!(static_cast<double>(in_front) >= options.min_visible * points)) return Status::implausible_result;
  const bool fits = result->rms_px <= options.max_rms_share * data.width &&
                    (options.max_chi2_per_dof <= 0.0 || result->chi2_per_dof <= options.max_chi2_per_dof);
  return fits ? Status::ok : Status::implausible_result;
}

}  // namespace lecalib
