// SPDX-License-Identifier: MIT
/// What the USB streams of DAVIS346 and DVXplorer have in common. Words of 16 bits: with bit 15 set the lower 15 are
/// the time in microseconds, which stands until the next one; else bits 14 to 12 are a code and the others its data.
#pragma once

#include "lecalib/events/word_decoder.hpp"

namespace lecalib {

/// What a camera's registers say and its words don't.
struct InivationFacts {
  SensorSize size;                            ///< of the image; 0 x 0: not known, nothing is outside
  bool swaps_axes = false;                    ///< the chip's columns are rows of the image
  bool flips_imu[3] = {false, false, false};  ///< x, y, z of the inertial sensor, as it is mounted
  std::uint8_t imu_type = 1;                  ///< of a DAVIS: 1 InvenSense 6050 or 6150, 2 InvenSense 9250
};

/// The inertial sensors that iniVation builds in.
struct InivationImuKind {
  bool is_bosch;           ///< of the DVXplorer, else InvenSense: other ranges, x and y exchanged
  float degrees_per_unit;  ///< of temperature
  float degrees_at_zero;
};

/// The time of the words. It runs over after 32.8 ms, and a word says how many times it did. A reset lets it begin at
/// 0; times given out go on from the last one.
class InivationClock {
 public:
  void take(std::uint32_t low_us, DecoderStats* stats) noexcept {
    const std::int64_t t_us = epoch_us_ + wrap_us_ + low_us;
    if (t_us < t_us_) ++stats->time_steps_back;
    t_us_ = t_us;
    started_ = true;
  }
  void wrap(std::uint32_t times, DecoderStats* stats) noexcept;
  void reset(DecoderStats* stats) noexcept;

  [[nodiscard]] bool started() const noexcept { return started_; }
  [[nodiscard]] std::int64_t t_us() const noexcept { return t_us_; }

 private:
  std::int64_t epoch_us_ = 0;  ///< of the last reset
  std::int64_t wrap_us_ = 0;   ///< since then
  std::int64_t t_us_ = 0;
  bool started_ = false;
};

/// Puts IMU samples together: a word that begins one, one that tells its parts and ranges, up to 14 bytes, one that
/// ends it. The words of what is not whole are counted as others.
class InivationImu {
 public:
  void begin(std::int64_t t_us, DecoderStats* stats) noexcept;
  void take_format(std::uint32_t format, DecoderStats* stats) noexcept;
  void take_byte(std::uint32_t byte, DecoderStats* stats) noexcept;
  void end(const InivationFacts& facts, const InivationImuKind& kind, SideRecords* side, DecoderStats* stats) noexcept;

 private:
  /// Acceleration x y z, temperature, rotation x y z, each with its upper byte first.
  static constexpr std::uint8_t kBytes = 14, kTemperature = 6, kRotation = 8;
  /// Bits of the format: which of them the sample has.
  static constexpr std::uint32_t kHasAcceleration = 0x80, kHasRotation = 0x40, kHasTemperature = 0x20;

  void skip_absent() noexcept;
  [[nodiscard]] float value(std::size_t at, bool flip, float scale) const noexcept;
  [[nodiscard]] ImuReading reading(const InivationFacts& facts, const InivationImuKind& kind, float accel_scale,
                                   float gyro_scale) const noexcept;

  std::uint8_t bytes_[kBytes] = {};
  std::uint8_t next_ = 0;  ///< kBytes: all that the sample has are there
  std::uint8_t format_ = 0;
  bool has_begun_ = false, has_format_ = false;
  std::uint32_t words_ = 0;  ///< counted as others since the begin
  std::int64_t t_us_ = 0;
};

/// What both cameras send besides their events.
class InivationWords {
 public:
  static constexpr std::uint32_t kTimeBit = 0x8000;
  static constexpr std::uint32_t kMaxSide = 1U << 12U;
  /// Codes of both cameras.
  enum Code : std::uint32_t { kSpecial = 0, kByte = 5, kWrap = 7 };

  InivationWords(const InivationFacts& facts, const InivationImuKind& kind) noexcept : facts_(facts), kind_(kind) {}

  [[nodiscard]] const InivationFacts& facts() const noexcept { return facts_; }
  [[nodiscard]] bool has_time() const noexcept { return clock_.started(); }
  [[nodiscard]] std::int64_t t_us() const noexcept { return clock_.t_us(); }

  void take_time(std::uint32_t low_us, DecoderStats* stats) noexcept { clock_.take(low_us, stats); }
  void take_wrap(std::uint32_t times, DecoderStats* stats) noexcept { clock_.wrap(times, stats); }
  /// Triggers, begins and ends of IMU samples, resets; words of frames are counted as others.
  void take_special(std::uint32_t data, SideRecords* side, DecoderStats* stats) noexcept;
  /// Bytes of IMU samples; those of frames are counted as others.
  void take_byte(std::uint32_t data, DecoderStats* stats) noexcept;

 private:
  void give(std::uint8_t channel, TriggerKind kind, SideRecords* side, DecoderStats* stats) const noexcept;

  InivationFacts facts_;
  InivationImuKind kind_;
  InivationClock clock_;
  InivationImu imu_;
};

}  // namespace lecalib
