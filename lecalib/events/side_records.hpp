// SPDX-License-Identifier: MIT
/// How decoders hand out what comes beside events.
#pragma once

#include "lecalib/events/decoder.hpp"

namespace lecalib {

/// Gives a record out where there is somebody to take it. Not inlined: that is rare, and the loops it is called from
/// keep their state in registers.
template <class Record>
[[gnu::noinline, gnu::cold]] void give(const Record& record, FixedVector<Record>* room) noexcept {
  if (room != nullptr) room->try_push(record);
}

inline void give_trigger(const TriggerEvent& trigger, SideRecords* side, DecoderStats* stats) noexcept {
  ++stats->triggers;
  give(trigger, side != nullptr ? &side->triggers : nullptr);
}

inline void give_imu_sample(const ImuSample& sample, SideRecords* side, DecoderStats* stats) noexcept {
  ++stats->imu_samples;
  give(sample, side != nullptr ? &side->imu_samples : nullptr);
}

/// What an inertial sensor reads, along its own axes.
struct ImuReading {
  std::int64_t t_us;
  float accel_g[3];
  float temperature_c;
  float gyro_deg_s[3];
};

/// Signs of a sensor's axes x, y, z along those of its camera.
struct ImuAxes {
  float signs[3];
};
inline constexpr ImuAxes kLeftDownBackwards = {{-1, 1, -1}};  ///< of a DAVIS
inline constexpr ImuAxes kLeftUpForwards = {{-1, -1, 1}};     ///< of Prophesee's cameras that have one

/// The same in SI units along the camera's axes.
inline ImuSample in_camera_axes(const ImuReading& reading, const ImuAxes& axes = kLeftDownBackwards) noexcept {
  constexpr float kGravity = 9.80665F;
  constexpr float kRadPerDegree = 0.0174532925F;
  ImuSample sample{reading.t_us, {}, {}, reading.temperature_c};
  for (int i = 0; i < 3; ++i) {
    sample.gyro_rad_s[i] = axes.signs[i] * kRadPerDegree * reading.gyro_deg_s[i];
    sample.accel_m_s2[i] = axes.signs[i] * kGravity * reading.accel_g[i];
  }
  return sample;
}

}  // namespace lecalib
