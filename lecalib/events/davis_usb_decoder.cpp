// SPDX-License-Identifier: MIT
#include "lecalib/events/davis_usb_decoder.hpp"

#include "lecalib/events/word_decoder_impl.hpp"

namespace lecalib {
namespace {

enum DavisCode : std::uint32_t { kRow = 1, kColumnOff = 2, kColumnOn = 3 };

constexpr InivationImuKind kInvenSense6050{false, 1 / 340.0F, 35};
constexpr InivationImuKind kInvenSense9250{false, 1 / 333.87F, 21};

}  // namespace

DavisUsbFormat::DavisUsbFormat(const InivationFacts& facts) noexcept
    : words_(facts, facts.imu_type == 2 ? kInvenSense9250 : kInvenSense6050),
      columns_(facts.swaps_axes ? facts.size.height : facts.size.width),
      rows_(facts.swaps_axes ? facts.size.width : facts.size.height) {
  if (!is_known(facts.size)) columns_ = rows_ = InivationWords::kMaxSide;
}

inline void DavisUsbFormat::take(Word word, EventRoom* room, DecoderStats* stats) noexcept {
  const std::uint32_t data = word & 0x0FFFU;
  if ((word & InivationWords::kTimeBit) != 0) return words_.take_time(word & 0x7FFFU, stats);
  switch (word >> 12U) {
    case kRow:
      row_ = data;
      has_row_ = true;
      break;
    case kColumnOff: take_event(data, 0, room, stats); break;
    case kColumnOn: take_event(data, 1, room, stats); break;
    case InivationWords::kSpecial: words_.take_special(data, room->side, stats); break;
    case InivationWords::kByte: words_.take_byte(data, stats); break;
    case InivationWords::kWrap: words_.take_wrap(data, stats); break;
    default: ++stats->other_words; break;  // samples of frames, exposures
  }
}

inline void DavisUsbFormat::take_event(std::uint32_t column, std::uint8_t polarity, EventRoom* room,
                                       DecoderStats* stats) const noexcept {
  if (!words_.has_time() || !has_row_) {
    ++stats->unplaced;
  } else if (column >= columns_ || row_ >= rows_) {
    ++stats->outside;
  } else {
    const bool swap = words_.facts().swaps_axes;
    *room->next++ = {words_.t_us(), static_cast<std::uint16_t>(swap ? row_ : column),
                     static_cast<std::uint16_t>(swap ? column : row_), polarity};
  }
}

template class WordDecoder<DavisUsbFormat>;

}  // namespace lecalib
