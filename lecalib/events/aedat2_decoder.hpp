// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/events/word_decoder.hpp"
#include "lecalib/events/wrapping_clock.hpp"

namespace lecalib {

/// How a chip's pixel stands in the address of an AEDAT 2 record.
enum class Aedat2Layout : std::uint8_t {
  davis,   ///< y in bits 30 to 22, x in 21 to 12, ON in bit 11; bit 31: frame or IMU; bit 10: external input
  dvs128,  ///< y in bits 14 to 8, x in 7 to 1, OFF in bit 0; bit 15: external input
};

/// AEDAT 2 of jAER: records of a big-endian 32-bit address and a big-endian 32-bit time in microseconds, which runs
/// over after 71.6 minutes. Columns count from the right and rows from the bottom, so that the sensor's size has to be
/// known; without one there are no events, all are counted as outside. Triggers don't tell their edge. Files do not
/// tell the ranges of the IMU; they are taken as jAER sets them, 4 g and 500 deg/s.
class Aedat2Format : public EventPerWord {
 public:
  using Word = std::uint64_t;
  explicit Aedat2Format(SensorSize size, Aedat2Layout layout = Aedat2Layout::davis) noexcept
      : size_(size), layout_(layout) {}
  void take(Word word, EventRoom* room, DecoderStats* stats) noexcept;

 private:
  [[nodiscard]] std::int64_t time_beside(std::uint32_t reading) const noexcept;
  void take_imu(std::uint32_t address, std::uint32_t time, const EventRoom& room, DecoderStats* stats) noexcept;

  static constexpr std::uint8_t kImuWords = 7;
  static constexpr std::uint8_t kNoImu = 0xFF;

  WrappingClock<32> clock_;
  SensorSize size_;
  Aedat2Layout layout_;
  std::uint8_t imu_words_ = kNoImu;  ///< words of imu_ that have come
  std::int16_t imu_[kImuWords] = {};
  std::int64_t imu_t_us_ = 0;
};

extern template class WordDecoder<Aedat2Format>;
using Aedat2Decoder = WordDecoder<Aedat2Format>;

}  // namespace lecalib
