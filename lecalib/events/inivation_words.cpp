// SPDX-License-Identifier: MIT
#include "lecalib/events/inivation_words.hpp"

#include <limits>

namespace lecalib {
namespace {

constexpr std::int64_t kWrapUs = 0x8000;

/// What a special word says.
enum Special : std::uint32_t {
  kReserved = 0,
  kReset = 1,
  kInputFalls = 2,
  kInputRises = 3,
  kInputPulse = 4,
  kImuBegin = 5,
  kImuEnd = 7,
  kFirstOfFrames = 8,
  kLastOfFrames = 15,
  kGeneratorFalls = 16,
  kGeneratorRises = 17,
};

/// Channels of triggers: the camera's input, and the signal that it generates itself.
constexpr std::uint8_t kInput = 0, kGenerator = 1;

/// What a word with a byte says, in bits 11 to 8.
enum Byte : std::uint32_t { kImuByte = 0, kRegionHigh = 1, kRegionLow = 2, kImuFormat = 3 };

}  // namespace

void InivationClock::wrap(std::uint32_t times, DecoderStats* stats) noexcept {
  times = times > 0 ? times : 1;
  wrap_us_ += kWrapUs * times;
  stats->time_wraps += times;
  t_us_ = epoch_us_ + wrap_us_;
  started_ = true;
}

void InivationClock::reset(DecoderStats* stats) noexcept {
  ++stats->time_resets;
  epoch_us_ = t_us_;
  wrap_us_ = 0;
  started_ = true;
}

void InivationImu::begin(std::int64_t t_us, DecoderStats* stats) noexcept {
  ++stats->other_words;
  words_ = 1;
  t_us_ = t_us;
  has_begun_ = true;
  has_format_ = false;
}

void InivationImu::take_format(std::uint32_t format, DecoderStats* stats) noexcept {
  ++stats->other_words;
  ++words_;
  format_ = static_cast<std::uint8_t>(format);
  has_format_ = true;
  next_ = (format & kHasAcceleration) != 0 ? 0 : kTemperature;
  skip_absent();
}

/// Goes on to the next part that the sample has.
void InivationImu::skip_absent() noexcept {
  if (next_ == kTemperature && (format_ & kHasTemperature) == 0) next_ = kRotation;
  if (next_ == kRotation && (format_ & kHasRotation) == 0) next_ = kBytes;
}

void InivationImu::take_byte(std::uint32_t byte, DecoderStats* stats) noexcept {
  ++stats->other_words;
  ++words_;
  if (!has_begun_ || !has_format_) return;
  if (next_ == kBytes) {
    has_begun_ = false;  // more than the sample has
    return;
  }
  bytes_[next_++] = static_cast<std::uint8_t>(byte);
  skip_absent();
}

void InivationImu::end(const InivationFacts& facts, const InivationImuKind& kind, SideRecords* side,
                       DecoderStats* stats) noexcept {
  ++stats->other_words;
  ++words_;
  const bool is_whole = has_begun_ && has_format_ && next_ == kBytes;
  has_begun_ = false;
  // 2, 4, 8 or 16 g; InvenSense has 250 to 2000 deg/s, Bosch 2000 down to 125.
  const std::uint32_t accel_range = (kind.is_bosch ? format_ >> 3U : format_ >> 2U) & 3U;
  const std::uint32_t gyro_range = format_ & (kind.is_bosch ? 7U : 3U);
  const bool has_range = !kind.is_bosch || gyro_range <= 4;
  if (!is_whole || !has_range) return;
  stats->other_words -= words_;
  constexpr float kFullScale = 32768;
  const auto accel_scale = static_cast<float>(2U << accel_range) / kFullScale;
  const auto gyro_scale =
      (kind.is_bosch ? 2000.0F / static_cast<float>(1U << gyro_range) : static_cast<float>(250U << gyro_range)) /
      kFullScale;
  give_imu_sample(in_camera_axes(reading(facts, kind, accel_scale, gyro_scale)), side, stats);
}

float InivationImu::value(std::size_t at, bool flip, float scale) const noexcept {
  const auto reading = static_cast<std::int16_t>(bytes_[at] << 8U | bytes_[at + 1]);
  return (flip ? -scale : scale) * static_cast<float>(reading);
}

ImuReading InivationImu::reading(const InivationFacts& facts, const InivationImuKind& kind, float accel_scale,
                                 float gyro_scale) const noexcept {
  constexpr float kAbsent = std::numeric_limits<float>::quiet_NaN();
  ImuReading reading{t_us_, {kAbsent, kAbsent, kAbsent}, kAbsent, {kAbsent, kAbsent, kAbsent}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t at = 2 * (kind.is_bosch && axis < 2 ? 1 - axis : axis);
    const bool flip = facts.flips_imu[axis];
    if ((format_ & kHasAcceleration) != 0) reading.accel_g[axis] = value(at, flip, accel_scale);
    if ((format_ & kHasRotation) != 0) reading.gyro_deg_s[axis] = value(kRotation + at, flip, gyro_scale);
  }
  if ((format_ & kHasTemperature) != 0) {
    reading.temperature_c = value(kTemperature, false, kind.degrees_per_unit) + kind.degrees_at_zero;
  }
  return reading;
}

void InivationWords::give(std::uint8_t channel, TriggerKind kind, SideRecords* side,
                          DecoderStats* stats) const noexcept {
  if (has_time()) {
    give_trigger({t_us(), channel, kind}, side, stats);
  } else {
    ++stats->unplaced;
  }
}

void InivationWords::take_special(std::uint32_t data, SideRecords* side, DecoderStats* stats) noexcept {
  switch (data) {
    case kReset: return clock_.reset(stats);
    case kInputFalls: return give(kInput, TriggerKind::falling, side, stats);
    case kInputRises: return give(kInput, TriggerKind::rising, side, stats);
    case kInputPulse: return give(kInput, TriggerKind::pulse, side, stats);
    case kImuBegin: return imu_.begin(t_us(), stats);
    case kImuEnd: return imu_.end(facts_, kind_, side, stats);
    case kGeneratorFalls: return give(kGenerator, TriggerKind::falling, side, stats);
    case kGeneratorRises: return give(kGenerator, TriggerKind::rising, side, stats);
    default: break;
  }
  const bool is_of_frame = data >= kFirstOfFrames && data <= kLastOfFrames;
  ++(data == kReserved || is_of_frame ? stats->other_words : stats->undefined_words);
}

void InivationWords::take_byte(std::uint32_t data, DecoderStats* stats) noexcept {
  switch (data >> 8U) {
    case kImuByte: return imu_.take_byte(data & 0xFFU, stats);
    case kImuFormat: return imu_.take_format(data & 0xFFU, stats);
    case kRegionHigh:
    case kRegionLow: ++stats->other_words; return;
    default: ++stats->undefined_words; return;
  }
}

}  // namespace lecalib
