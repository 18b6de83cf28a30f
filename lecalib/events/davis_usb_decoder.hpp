// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/events/inivation_words.hpp"

namespace lecalib {

/// What a DAVIS346 sends over USB: a word for the row, then one for each event in it with column and polarity; IMU
/// samples, triggers, and frames, whose words are counted as others.
class DavisUsbFormat : public EventPerWord {
 public:
  using Word = std::uint16_t;
  explicit DavisUsbFormat(const InivationFacts& facts) noexcept;
  explicit DavisUsbFormat(SensorSize size) noexcept : DavisUsbFormat(InivationFacts{size}) {}
  void take(Word word, EventRoom* room, DecoderStats* stats) noexcept;

 private:
  void take_event(std::uint32_t column, std::uint8_t polarity, EventRoom* room, DecoderStats* stats) const noexcept;

  InivationWords words_;
  std::uint32_t columns_, rows_;  ///< of the chip
  std::uint32_t row_ = 0;
  bool has_row_ = false;
};

extern template class WordDecoder<DavisUsbFormat>;
using DavisUsbDecoder = WordDecoder<DavisUsbFormat>;

}  // namespace lecalib
