// SPDX-License-Identifier: MIT
#include "lecalib/events/dvxplorer_usb_decoder.hpp"

#include "lecalib/events/word_decoder_impl.hpp"

namespace lecalib {
namespace {

enum DvxplorerCode : std::uint32_t { kColumn = 1, kGroup2 = 2, kGroup1 = 3, kGroups = 4 };

constexpr std::uint32_t kRowsPerGroup = 8;
constexpr InivationImuKind kBosch{true, 1 / 512.0F, 23};

}  // namespace

DvxplorerUsbFormat::DvxplorerUsbFormat(const InivationFacts& facts) noexcept
    : words_(facts, kBosch),
      columns_(facts.swaps_axes ? facts.size.height : facts.size.width),
      rows_(facts.swaps_axes ? facts.size.width : facts.size.height) {
  if (!is_known(facts.size)) columns_ = rows_ = InivationWords::kMaxSide;
}

inline void DvxplorerUsbFormat::take(Word word, EventRoom* room, DecoderStats* stats) noexcept {
  const std::uint32_t data = word & 0x0FFFU;
  if ((word & InivationWords::kTimeBit) != 0) return words_.take_time(word & 0x7FFFU, stats);
  switch (word >> 12U) {
    case kColumn:  // bit 11 only says that a read-out begins
      column_ = data & 0x3FFU;
      has_column_ = true;
      break;
    case kGroup1: take_vector(data, first_row_[0], room, stats); break;
    case kGroup2: take_vector(data, first_row_[1], room, stats); break;
    case kGroups: take_groups(data); break;
    case InivationWords::kSpecial: words_.take_special(data, room->side, stats); break;
    case InivationWords::kByte: words_.take_byte(data, stats); break;
    case InivationWords::kWrap: words_.take_wrap(data, stats); break;
    default: ++stats->undefined_words; break;
  }
}

/// Bits 5 to 0 are group 1; group 2 lies by bits 10 to 6 behind it, before it where bit 11 is set.
inline void DvxplorerUsbFormat::take_groups(std::uint32_t data) noexcept {
  const std::uint32_t group = data & 0x3FU;
  const std::uint32_t distance = data >> 6U & 0x1FU;
  const bool is_before = (data & 0x800U) != 0;
  first_row_[0] = group * kRowsPerGroup;
  first_row_[1] = is_before ? (group - distance) * kRowsPerGroup : (group + distance) * kRowsPerGroup;
  if (is_before && distance > group) first_row_[1] = InivationWords::kMaxSide;  // on no sensor
  has_groups_ = true;
}

/// Bits 7 to 0 are the rows of the group that fired, OFF where bit 8 is set.
inline void DvxplorerUsbFormat::take_vector(std::uint32_t data, std::uint32_t first_row, EventRoom* room,
                                            DecoderStats* stats) noexcept {
  std::uint32_t bits = data & 0xFFU;
  if (!words_.has_time() || !has_column_ || !has_groups_) {
    stats->unplaced += static_cast<std::uint64_t>(__builtin_popcount(bits));
    return;
  }
  if (column_ >= columns_ || first_row + kRowsPerGroup > rows_) {
    const std::uint32_t on_sensor = column_ < columns_ && first_row < rows_ ? rows_ - first_row : 0;
    const std::uint32_t kept = on_sensor < kRowsPerGroup ? bits & ((1U << on_sensor) - 1U) : bits;
    stats->outside += static_cast<std::uint64_t>(__builtin_popcount(bits ^ kept));
    bits = kept;
  }
  first_ = {words_.t_us(), static_cast<std::uint16_t>(column_), static_cast<std::uint16_t>(first_row),
            static_cast<std::uint8_t>((data & 0x100U) == 0)};
  vector_ = bits;
  flush(room);
}

inline void DvxplorerUsbFormat::flush(EventRoom* room) noexcept {
  std::uint32_t bits = vector_;
  Event* next = room->next;
  const bool swap = words_.facts().swaps_axes;
  for (; bits != 0 && next != room->end; bits &= bits - 1) {
    const auto row = static_cast<std::uint16_t>(first_.y + __builtin_ctz(bits));
    *next++ = {first_.t_us, swap ? row : first_.x, swap ? first_.x : row, first_.polarity};
  }
  room->next = next;
  vector_ = bits;
}

template class WordDecoder<DvxplorerUsbFormat>;

}  // namespace lecalib
