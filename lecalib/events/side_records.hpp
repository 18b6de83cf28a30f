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

/// What the inertial sensor of a DAVIS reads. Its axes point to the left, down and backwards.
struct ImuReading {
  std::int64_t t_us;
  float accel_g[3];
  float temperature_c;
  float gyro_deg_s[3];
};

/// The same in SI units along the camera's axes: x and z change their signs.
inline ImuSample in_camera_axes(const ImuReading& reading) noexcept {
  constexpr float kGravity = 9.80665F;
  constexpr float kRadPerDegree = 0.0174532925F;
  constexpr float kSigns[3] = {-1, 1, -1};
  ImuSample sample{reading.t_us, {}, {}, reading.temperature_c};
  for (int i = 0; i < 3; ++i) {
    sample.gyro_rad_s[i] = kSigns[i] * kRadPerDegree * reading.gyro_deg_s[i];
    sample.accel_m_s2[i] = kSigns[i] * kGravity * reading.accel_g[i];
  }
  return sample;
}

}  // namespace lecalib
