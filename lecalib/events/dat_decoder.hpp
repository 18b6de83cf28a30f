// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/events/word_decoder.hpp"
#include "lecalib/events/wrapping_clock.hpp"

namespace lecalib {

/// Prophesee DAT: records of 8 bytes, the time in microseconds (32 bits, running over after 71.6 minutes) below the
/// address. From version 2 on the address holds 14 bits of x, 14 of y and the polarity; before, 9 of x and 8 of y.
class DatFormat : public EventPerWord {
 public:
  using Word = std::uint64_t;
  explicit DatFormat(SensorSize size, unsigned version = 2) noexcept;
  void take(Word word, EventRoom* room, DecoderStats* stats) noexcept;

 private:
  WrappingClock<32> clock_;
  std::uint32_t width_;
  std::uint32_t height_;
  bool is_old_;
};

extern template class WordDecoder<DatFormat>;
using DatDecoder = WordDecoder<DatFormat>;

}  // namespace lecalib
