// SPDX-License-Identifier: MIT
/// What a calibration is computed from: measured points on the images of model lines, view by view.
#pragma once

#include <cstdint>

#include "lecalib/core/records.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/core/status.hpp"

namespace lecalib {

/// Views the caller's memory; it must outlive the solver that works on it.
struct CalibrationData {
  std::uint16_t width = 0;  ///< sensor, px
  std::uint16_t height = 0;
  Span<const ModelLine> model;
  Span<const LinePoint> points;
  Span<const View> views;
  Span<const std::uint8_t> left_out = {};  ///< per point, not 0: a wrong one, of no weight; empty: all are used
};

/// @return ok | invalid_argument (no sensor size, a value that is not finite, sigma not positive, a model line of no
/// length, an index out of range, left_out neither empty nor one per point) | too_few_lines (no model, no view or no
/// point)
Status validate(const CalibrationData& data);

/// The points of one view.
inline Span<const LinePoint> points_of(const CalibrationData& data, const View& view) {
  return data.points.subspan(view.first, view.count);
}

inline bool is_left_out(const CalibrationData& data, std::size_t point) {
  return !data.left_out.empty() && data.left_out[point] != 0;
}

/// Pixel centres are at integers, so the centre of the image is at (width - 1) / 2.
inline double centre_x(const CalibrationData& data) { return 0.5 * (data.width - 1); }
inline double centre_y(const CalibrationData& data) { return 0.5 * (data.height - 1); }

}  // namespace lecalib
