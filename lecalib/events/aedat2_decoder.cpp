// SPDX-License-Identifier: MIT
#include "lecalib/events/aedat2_decoder.hpp"

#include "lecalib/events/bytes.hpp"
#include "lecalib/events/word_decoder_impl.hpp"

namespace lecalib {
namespace {

/// What an address says.
struct Address {
  enum Kind { event, trigger, imu, other, undefined } kind;
  std::uint32_t column = 0, row = 0, polarity = 0;  ///< column from the right, row from the bottom
};

constexpr Address read_davis(std::uint32_t address) noexcept {
  if (bits_of(address, 31, 1) != 0) {
    return {bits_of(address, 10, 2) == 3 ? Address::imu : Address::other};  // other: a pixel of a frame
  }
  if (bits_of(address, 10, 1) != 0) return {Address::trigger};
  return {Address::event, bits_of(address, 12, 10), bits_of(address, 22, 9), bits_of(address, 11, 1)};
}

constexpr Address read_dvs128(std::uint32_t address) noexcept {
  if (bits_of(address, 16, 16) != 0) return {Address::undefined};
  if (bits_of(address, 15, 1) != 0) return {Address::trigger};
  return {Address::event, bits_of(address, 1, 7), bits_of(address, 8, 7), 1 - bits_of(address, 0, 1)};
}

}  // namespace

inline void Aedat2Format::take(Word word, EventRoom* room, DecoderStats* stats) noexcept {
  const std::uint32_t raw = __builtin_bswap32(static_cast<std::uint32_t>(word));
  const std::uint32_t time = __builtin_bswap32(static_cast<std::uint32_t>(word >> 32U));
  const Address address = layout_ == Aedat2Layout::davis ? read_davis(raw) : read_dvs128(raw);
  switch (address.kind) {
    case Address::event:
      take_time(time, &clock_, stats);
      if (address.column >= size_.width || address.row >= size_.height) {
        ++stats->outside;
      } else {
        *room->next++ = {clock_.value(), static_cast<std::uint16_t>(size_.width - 1 - address.column),
                         static_cast<std::uint16_t>(size_.height - 1 - address.row),
                         static_cast<std::uint8_t>(address.polarity)};
      }
      break;
    case Address::trigger: give_trigger({time_beside(time), 0, TriggerKind::other}, room->side, stats); break;
    case Address::imu: take_imu(raw, time, *room, stats); break;
    case Address::other: ++stats->other_words; break;
    case Address::undefined: ++stats->undefined_words; break;
  }
}

/// The events' clock does not take part: what lies beside them may come out of their order.
std::int64_t Aedat2Format::time_beside(std::uint32_t reading) const noexcept {
  WrappingClock<32> clock = clock_;
  clock.update(reading);
  return clock.value();
}

/// Seven words make an IMU sample, numbered in bits 30 to 28: acceleration x y z, temperature, rotation x y z.
void Aedat2Format::take_imu(std::uint32_t address, std::uint32_t time, const EventRoom& room,
                            DecoderStats* stats) noexcept {
  const std::uint32_t number = bits_of(address, 28, 3);
  ++stats->other_words;  // until the sample is whole
  if (number == 0) {
    imu_words_ = 0;
    imu_t_us_ = time_beside(time);
  }
  if (number != imu_words_ || number == kImuWords) {
    imu_words_ = kNoImu;
    return;
  }
  imu_[imu_words_++] = static_cast<std::int16_t>(bits_of(address, 12, 16));
  if (imu_words_ < kImuWords) return;
  imu_words_ = kNoImu;
  stats->other_words -= kImuWords;
  ImuReading reading{imu_t_us_, {}, 35 + static_cast<float>(imu_[3]) / 340, {}};
  for (int i = 0; i < 3; ++i) {
    reading.accel_g[i] = static_cast<float>(imu_[i]) / 8192;
    reading.gyro_deg_s[i] = static_cast<float>(imu_[4 + i]) / 65.5F;
  }
  give_imu_sample(in_camera_axes(reading), room.side, stats);
}

template class WordDecoder<Aedat2Format>;

}  // namespace lecalib
