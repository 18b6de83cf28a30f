// SPDX-License-Identifier: MIT
#include "lecalib/events/evt2_decoder.hpp"

#include <limits>

#include "lecalib/events/word_decoder_impl.hpp"

namespace lecalib {
namespace {

constexpr std::uint32_t kImuWordsOfEvt2 = 6;

/// Reading number `axis` of three that came one after the other.
float imu_value_of_evt2(std::uint64_t readings, unsigned axis) noexcept {
  return static_cast<float>(static_cast<std::int16_t>(readings >> (32U - 16U * axis) & 0xFFFFU));
}

[[gnu::noinline, gnu::cold]] void give_imu_sample_of_evt2(std::int64_t t_us, std::uint64_t accel, std::uint64_t gyro,
                                                          SideRecords* side, DecoderStats* stats) noexcept {
  constexpr float kFullScale = 32768;
  ImuReading reading{t_us, {}, std::numeric_limits<float>::quiet_NaN(), {}};
  for (unsigned axis = 0; axis < 3; ++axis) {
    reading.accel_g[axis] = imu_value_of_evt2(accel, axis) * 2 / kFullScale;
    reading.gyro_deg_s[axis] = imu_value_of_evt2(gyro, axis) * 2000 / kFullScale;
  }
  give_imu_sample(in_camera_axes(reading, kLeftUpForwards), side, stats);
}

}  // namespace

Evt2Format::Evt2Format(SensorSize size) noexcept
    : width_(is_known(size) ? size.width : evt2::kCoordinates),
      height_(is_known(size) ? size.height : evt2::kCoordinates) {}

inline void Evt2Format::take(Word word, EventRoom* room, DecoderStats* stats) noexcept {
  const std::uint32_t type = word >> 28U;
  if (type > evt2::kCdOn) {
    if (type == evt2::kImu || (type == evt2::kContinued && imu_words_ > 0)) return take_imu(word, *room, stats);
    if (type == evt2::kOthers) imu_words_ = 0;  // what is continued now is not the sample
    return evt2::take_other_word(word, &clock_, room->side, stats);
  }
  const evt2::CdWord cd(word);
  if (!clock_.started()) {
    ++stats->unplaced;
  } else if (cd.x >= width_ || cd.y >= height_) {
    ++stats->outside;
  } else {
    *room->next++ = {cd.t_us(clock_), static_cast<std::uint16_t>(cd.x), static_cast<std::uint16_t>(cd.y),
                     static_cast<std::uint8_t>(type)};
  }
}

/// Acceleration x y z and rotation x y z in bits 16 to 1, one in a word; the first has the time. Words of other types
/// may stand between.
inline void Evt2Format::take_imu(std::uint32_t word, const EventRoom& room, DecoderStats* stats) noexcept {
  ++stats->other_words;  // until the sample is whole
  if (word >> 28U == evt2::kImu) {
    imu_words_ = 0;
    if (!clock_.started()) {
      ++stats->unplaced;
      return;
    }
    imu_t_us_ = evt2::CdWord(word).t_us(clock_);
  }
  std::uint64_t& readings = imu_words_ < 3 ? imu_accel_ : imu_gyro_;
  readings = readings << 16U | (word >> 1U & 0xFFFFU);
  if (++imu_words_ < kImuWordsOfEvt2) return;
  imu_words_ = 0;
  stats->other_words -= kImuWordsOfEvt2;
  give_imu_sample_of_evt2(imu_t_us_, imu_accel_, imu_gyro_, room.side, stats);
}

template class WordDecoder<Evt2Format>;

}  // namespace lecalib
