// SPDX-License-Identifier: MIT
#include "lecalib/solve/gyro_prior.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/core/time.hpp"
#include "lecalib/math/eigen.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

constexpr double kSecondsPerUs = 1e-6;

/// A gyro without noise would be trusted more than arithmetic can be.
constexpr double kMinSigmaRad = 1e-7;

Vec3 rate_at(const GyroSample& a, const GyroSample& b, double t_us) {
  const double share =
      (t_us - static_cast<double>(a.t_us)) / (static_cast<double>(b.t_us) - static_cast<double>(a.t_us));
  return (1.0 - share) * Eigen::Map<const Vec3>(a.rate) + share * Eigen::Map<const Vec3>(b.rate);
}

bool is_valid(const GyroOptions& options) {
  return options.noise_density >= 0.0 && options.bias_sigma >= 0.0 && options.max_gap_us > 0;
}

}  // namespace

Status integrate_gyro(const GyroOptions& options, Span<const GyroSample> samples, std::int64_t t_a_us,
                      std::int64_t t_b_us, RelativePrior* out) {
  if (!is_valid(options) || t_b_us <= t_a_us) return Status::invalid_argument;
  const auto earlier = [](const GyroSample& sample, std::int64_t t_us) { return sample.t_us <= t_us; };
  const GyroSample* const after = std::lower_bound(samples.begin(), samples.end(), t_a_us, earlier);
  if (after == samples.begin() || after == samples.end()) return Status::need_more_data;
  Mat3 R_b_a = Mat3::Identity();
  std::int64_t now_us = t_a_us;
  for (const GyroSample* next = after; now_us < t_b_us; ++next) {
    if (next == samples.end()) return Status::need_more_data;
    const GyroSample& last = next[-1];
    if (next->t_us <= last.t_us) return Status::invalid_argument;
    if (distance_us(last.t_us, next->t_us) > static_cast<std::uint64_t>(options.max_gap_us))
      return Status::need_more_data;
    const std::int64_t until_us = std::min(next->t_us, t_b_us);
    const double middle_us = 0.5 * (static_cast<double>(now_us) + static_cast<double>(until_us));
    const double dt = kSecondsPerUs * static_cast<double>(until_us - now_us);
    R_b_a = so3_exp(-dt * rate_at(last, *next, middle_us)) * R_b_a;
    now_us = until_us;
  }
  const double seconds = kSecondsPerUs * static_cast<double>(t_b_us - t_a_us);
  const double walk = options.noise_density * std::sqrt(seconds);
  const double drift = options.bias_sigma * seconds;
  Eigen::Map<RowMat3>(out->R_b_a) = R_b_a;
  out->sigma_rad = std::max(std::sqrt(walk * walk + drift * drift), kMinSigmaRad);
  out->shared_rad = drift;
  return Status::ok;
}

}  // namespace lecalib
