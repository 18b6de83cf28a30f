// SPDX-License-Identifier: MIT
/// Readings of a gyro: CSV `t_us,wx,wy,wz`, on the clock of the events, rad/s about the camera's axes (x right, y down,
/// z forward). Columns behind these are passed over.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "lecalib/events/decoder.hpp"
#include "lecalib/host/error.hpp"
#include "lecalib/solve/gyro_prior.hpp"

namespace lecalib::host {

/// A header row of that form comes first; '#' starts a comment, blank lines are skipped.
/// Errors carry line and column: fields missing or too many, not a finite number, times that do not increase, no rows.
Result<std::vector<GyroSample>> parse_gyro(std::string_view text, const std::string& file_name);
Result<std::vector<GyroSample>> read_gyro(const std::string& path);

/// The readings of the IMU in a recording; those whose time is not above the last one's are left out.
/// @return an error where the file cannot be read or holds none
Result<std::vector<GyroSample>> read_gyro_of_recording(const std::string& path, SensorSize sensor);

/// Ties views in pairs, by time: the first to the second, the third to the fourth, and so on, as far as the gyro tells
/// the turn between them. Views of one instant are not tied.
std::vector<RelativePrior> pair_views(const GyroOptions& options, Span<const GyroSample> samples,
                                      Span<const View> views);

}  // namespace lecalib::host
