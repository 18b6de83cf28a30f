// SPDX-License-Identifier: MIT
/// What EVT2 and EVT2.1 have in common: the upper half of an EVT2.1 word is an EVT2 word.
#pragma once

#include "lecalib/events/side_records.hpp"
#include "lecalib/events/wrapping_clock.hpp"

namespace lecalib::evt2 {

inline constexpr unsigned kTimeLowBits = 6;
inline constexpr unsigned kCoordinateBits = 11;
inline constexpr std::uint32_t kCoordinates = 1U << kCoordinateBits;

enum Type : std::uint32_t {
  kCdOff = 0x0,
  kCdOn = 0x1,
  kTimeHigh = 0x8,
  kExtTrigger = 0xA,
  kImu = 0xD,
  kOthers = 0xE,
  kContinued = 0xF,
};

/// Time bits 33 to 6.
using Clock = WrappingClock<28>;

/// Where and when the CD word says that its event, or the first of its events, was.
struct CdWord {
  explicit CdWord(std::uint32_t word) noexcept
      : time_low(word >> (2 * kCoordinateBits) & ((1U << kTimeLowBits) - 1)),
        x(word >> kCoordinateBits & (kCoordinates - 1)),
        y(word & (kCoordinates - 1)) {}
  [[nodiscard]] std::int64_t t_us(const Clock& clock) const noexcept {
    return (clock.value() << kTimeLowBits) + time_low;
  }

  std::uint32_t time_low, x, y;
};

/// Takes in an edge of an external signal: its time stands where a CD word has it.
inline void take_trigger(std::uint32_t word, const Clock& clock, SideRecords* side, DecoderStats* stats) noexcept {
  if (!clock.started()) {
    ++stats->unplaced;
    return;
  }
  const auto kind = (word & 1U) != 0 ? TriggerKind::rising : TriggerKind::falling;
  give_trigger({CdWord(word).t_us(clock), static_cast<std::uint8_t>(word >> 8U & 0x1FU), kind}, side, stats);
}

/// Takes in the words that are no CD.
inline void take_other_word(std::uint32_t word, Clock* clock, SideRecords* side, DecoderStats* stats) noexcept {
  switch (word >> 28U) {
    case kTimeHigh: take_time(word & 0x0FFFFFFFU, clock, stats); break;
    case kExtTrigger: take_trigger(word, *clock, side, stats); break;
    case kOthers:
    case kContinued: ++stats->other_words; break;
    default: ++stats->undefined_words; break;
  }
}

}  // namespace lecalib::evt2
