// SPDX-License-Identifier: MIT
/// What a gyro that is fixed to the camera tells about the turn between two instants.
#pragma once

#include <cstdint>

#include "lecalib/core/span.hpp"
#include "lecalib/solve/calibration_data.hpp"

namespace lecalib {

/// One reading, about the camera's axes.
struct GyroSample {
  std::int64_t t_us;
  double rate[3];  ///< rad/s
};

struct GyroOptions {
  double noise_density = 2e-4;      ///< rad/s/sqrt(Hz), one sigma; of small MEMS gyros 5e-5 to 2e-4. >= 0
  double bias_sigma = 0.01;         ///< rad/s; of the offset that the readings have in common. >= 0
  std::int64_t max_gap_us = 20000;  ///< longest time between two readings that a straight line bridges. > 0
};

/// The turn from t_a_us to t_b_us > t_a_us, from the piecewise linear rate by the midpoint of each interval: with the
/// camera's rate w, R_cam_world(t + dt) = exp(-w dt) R_cam_world(t). Its sigma is sqrt(density^2 dt + (bias_sigma
/// dt)^2) about each axis.
/// @param samples in order of time
/// @param[out] out R_b_a, sigma_rad and shared_rad; the views stay as they are
/// @return ok | invalid_argument (options, t_b_us <= t_a_us, samples out of order where they are used) | need_more_data
/// (the samples do not reach from t_a_us to t_b_us, or with a gap)
Status integrate_gyro(const GyroOptions& options, Span<const GyroSample> samples, std::int64_t t_a_us,
                      std::int64_t t_b_us, RelativePrior* out);

}  // namespace lecalib
