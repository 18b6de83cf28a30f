// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/events/evt2_words.hpp"
#include "lecalib/events/word_decoder.hpp"

namespace lecalib {

/// Prophesee EVT2: words of 32 bits, type in the upper 4. A CD word carries the lower 6 bits of its time, x and y;
/// TIME_HIGH carries the upper 28: 34 bits of microseconds, which run over after 4.8 hours.
///
/// Cameras with an inertial sensor send a word IMU and five words CONTINUED for each of its samples. Nothing tells the
/// ranges that it was read in; they are taken as the driver of its maker sets them, 2 g and 2000 deg/s.
class Evt2Format : public EventPerWord {
 public:
  using Word = std::uint32_t;
  explicit Evt2Format(SensorSize size) noexcept;
  void take(Word word, EventRoom* room, DecoderStats* stats) noexcept;

 private:
  void take_imu(std::uint32_t word, const EventRoom& room, DecoderStats* stats) noexcept;

  evt2::Clock clock_;
  std::uint32_t width_;
  std::uint32_t height_;
  // Numbers, not arrays, so that a loop over words can keep all of the format in registers.
  std::uint64_t imu_accel_ = 0;  ///< x, y, z as they came, 16 bits each, z lowest
  std::uint64_t imu_gyro_ = 0;   ///< likewise
  std::int64_t imu_t_us_ = 0;
  std::uint32_t imu_words_ = 0;  ///< of the sample that is under way; 0: none is
};

extern template class WordDecoder<Evt2Format>;
using Evt2Decoder = WordDecoder<Evt2Format>;

}  // namespace lecalib
