// SPDX-License-Identifier: MIT
/// Points that somebody measured on the images of model lines: CSV `view,line,u_px,v_px[,sigma_px][,t_us]`.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "lecalib/core/records.hpp"
#include "lecalib/host/error.hpp"
#include "lecalib/host/model_file.hpp"
#include "lecalib/host/sensor_size.hpp"

namespace lecalib::host {

/// sigma_px of rows that give none.
inline constexpr double kDefaultSigmaPx = 1.0;

struct Observations {
  std::vector<std::string> view_names;  ///< of views[i], in order of first appearance
  std::vector<View> views;              ///< without has_times, t_us is the view's index
  std::vector<LinePoint> points;        ///< grouped by view, within it by line, then in the order of the file
  bool has_sigma = false;               ///< false: every sigma_px is kDefaultSigmaPx, the scale is unknown
  bool has_times = false;
};

/// Reads `view,line,u_px,v_px[,sigma_px][,t_us]`, a header row of that form first; '#' starts a comment, blank lines
/// are skipped. t_us is a whole number, the same in all rows of a view. A view's label is any text without a comma;
/// rows of one view need not be together. Errors carry line and column: fields missing or too many, not a finite
/// number, sigma_px <= 0, a line that the model does not have, two times of one view, a point more than a quarter of
/// the sensor beside it, a line with a single point in a view.
Result<Observations> parse_observations(std::string_view text, const std::string& file_name, const Model& model,
                                        const SensorSize& sensor);
Result<Observations> read_observations(const std::string& path, const Model& model, const SensorSize& sensor);

}  // namespace lecalib::host
