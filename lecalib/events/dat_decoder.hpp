// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/events/word_decoder.hpp"
#include "lecalib/events/wrapping_clock.hpp"

namespace lecalib {

/// What the records of a DAT file are.
enum class DatContent : std::uint8_t { events, triggers };

/// Prophesee DAT: records of 8 bytes, the time in microseconds (32 bits, running over after 71.6 minutes) below the
/// address. From version 2 on the address holds 14 bits of x, 14 of y and the polarity; before, 9 of x and 8 of y.
/// A file of triggers, which lies beside one of events, has the edge in the lower 4 bits and the channel in the
/// upper 6.
class DatFormat : public EventPerWord {
 public:
  using Word = std::uint64_t;
  explicit DatFormat(SensorSize size, unsigned version = 2, DatContent content = DatContent::events) noexcept;
  void take(Word word, EventRoom* room, DecoderStats* stats) noexcept;

 private:
  WrappingClock<32> clock_;
  std::uint32_t width_;
  std::uint32_t height_;
  DatContent content_;
  bool is_old_;
};

extern template class WordDecoder<DatFormat>;
using DatDecoder = WordDecoder<DatFormat>;

}  // namespace lecalib
