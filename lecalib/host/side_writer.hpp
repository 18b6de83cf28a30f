// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "lecalib/core/records.hpp"
#include "lecalib/host/file_io.hpp"

namespace lecalib::host {

/// Appends IMU samples as rows "t_us,wx,wy,wz,ax,ay,az,temperature_c": rad/s, m/s^2 and degrees Celsius, "nan" for what
/// was not measured. With their title they are what gyro_file.hpp reads.
void append_imu_csv(Span<const ImuSample> samples, std::string* text);

/// Appends triggers as rows "t_us,channel,kind".
void append_triggers_csv(Span<const TriggerEvent> triggers, std::string* text);

/// Writes what a camera sent beside events as CSV files, which appear under their names once commit() is called.
class SideWriter {
 public:
  /// @param imu_path, triggers_path  empty: not wanted
  static Result<SideWriter> create(const std::string& imu_path, const std::string& triggers_path);
  /// IMU samples whose time is not above the last one's are left out and counted.
  MaybeError write(Span<const ImuSample> samples, Span<const TriggerEvent> triggers);
  MaybeError commit();

  [[nodiscard]] std::uint64_t imu_samples() const { return num_imu_samples_; }
  [[nodiscard]] std::uint64_t imu_samples_left_out() const { return num_left_out_; }
  [[nodiscard]] std::uint64_t triggers() const { return num_triggers_; }

 private:
  SideWriter() = default;

  std::optional<OutputFile> imu_, triggers_;
  std::uint64_t num_imu_samples_ = 0, num_left_out_ = 0, num_triggers_ = 0;
  std::int64_t last_imu_us_ = 0;
  std::string buffer_;
};

}  // namespace lecalib::host
