// SPDX-License-Identifier: MIT
/// What EVT2 and EVT2.1 have in common: the upper half of an EVT2.1 word is an EVT2 word.
#pragma once

#include "lecalib/events/decoder.hpp"
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

/// Takes in the words that are no CD.
inline void take_other_word(std::uint32_t word, Clock* clock, DecoderStats* stats) noexcept {
  switch (word >> 28U) {
    case kTimeHigh: take_time(word & 0x0FFFFFFFU, clock, stats); break;
    case kExtTrigger: ++stats->triggers; break;
    case kOthers:
    case kContinued: ++stats->other_words; break;
    default: ++stats->undefined_words; break;
  }
}

}  // namespace lecalib::evt2
