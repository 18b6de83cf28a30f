// SPDX-License-Identifier: MIT
/// What a calibration is computed from: measured points on the images of model lines, view by view.
#pragma once

#include <cstdint>

#include "lecalib/core/records.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/core/status.hpp"

namespace lecalib {

/// How a camera has turned from one view to another, as measured by something else than lines:
/// R_cam_world of view_b is about R_b_a times that of view_a.
struct RelativePrior {
  std::uint32_t view_a = 0;
  std::uint32_t view_b = 0;
  double R_b_a[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< row-major
  double sigma_rad = 0;                           ///< one sigma about each of the camera's axes, > 0
  double shared_rad = 0;  ///< the part of it that all priors have in common, as a gyro's bias: [0, sigma_rad]
};

/// What is known of a point that stands for a moving edge.
struct EdgePoint {
  float normal_x, normal_y;  ///< unit, across the edge
  float speed_px_per_s;      ///< along the normal
  float along;               ///< place on the edge, from -1/2 at the model line's p to 1/2 at its q
  float events;              ///< in a pixel's crossing, mean
  std::int8_t dark;          ///< the dark side lies along the normal (1) or against it (-1); 0: unknown, no offsets
  std::int8_t model_side;    ///< the same side by the normal of the model line's image from p to q
  std::int8_t polarity;      ///< of the events: 1 ON, -1 OFF
  bool other_flank;          ///< not matched itself, but found beside a line that is
};

/// Views the caller's memory; it must outlive the solver that works on it.
struct CalibrationData {
  std::uint16_t width = 0;  ///< sensor, px
  std::uint16_t height = 0;
  Span<const ModelLine> model;
  Span<const LinePoint> points;
  Span<const View> views;
  Span<const EdgePoint> edges = {};         ///< one per point, or none: the points are as measured elsewhere
  Span<const std::uint8_t> left_out = {};   ///< per point, not 0: a wrong one, of no weight; empty: all are used
  Span<const RelativePrior> relative = {};  ///< ties views in pairs; no view is in more than one
};

/// @return ok | invalid_argument (no sensor size, a value that is not finite, sigma not positive, a model line of no
/// length, an index out of range, edges or left_out neither empty nor one per point, a turn without sigma or of a view
/// to itself or to two others) | too_few_lines (no model, no view or no point)
Status validate(const CalibrationData& data);

/// The points of one view.
inline Span<const LinePoint> points_of(const CalibrationData& data, const View& view) {
  return data.points.subspan(view.first, view.count);
}

inline bool is_left_out(const CalibrationData& data, std::size_t point) {
  return !data.left_out.empty() && data.left_out[point] != 0;
}

/// Points of a view that are in use.
std::size_t count_points(const CalibrationData& data, const View& view);

/// Pixel centres are at integers, so the centre of the image is at (width - 1) / 2.
inline double centre_x(const CalibrationData& data) { return 0.5 * (data.width - 1); }
inline double centre_y(const CalibrationData& data) { return 0.5 * (data.height - 1); }

}  // namespace lecalib
