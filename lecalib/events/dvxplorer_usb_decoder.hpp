// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/events/inivation_words.hpp"

namespace lecalib {

/// What a DVXplorer sends over USB: a word for the column, one for two groups of eight rows, then one for each group
/// with its events, all of one polarity; IMU samples and triggers.
class DvxplorerUsbFormat : public WordByWord {
 public:
  using Word = std::uint16_t;
  explicit DvxplorerUsbFormat(const InivationFacts& facts) noexcept;
  explicit DvxplorerUsbFormat(SensorSize size) noexcept : DvxplorerUsbFormat(InivationFacts{size}) {}
  void take(Word word, EventRoom* room, DecoderStats* stats) noexcept;
  void flush(EventRoom* room) noexcept;
  [[nodiscard]] bool is_flushed() const noexcept { return vector_ == 0; }

 private:
  void take_groups(std::uint32_t data) noexcept;
  void take_vector(std::uint32_t data, std::uint32_t first_row, EventRoom* room, DecoderStats* stats) noexcept;

  InivationWords words_;
  std::uint32_t columns_, rows_;  ///< of the chip
  std::uint32_t column_ = 0;
  std::uint32_t first_row_[2] = {0, 0};  ///< of group 1 and group 2
  bool has_column_ = false, has_groups_ = false;
  Event first_ = {};          ///< the event of bit 0, in columns and rows of the chip
  std::uint32_t vector_ = 0;  ///< events of the last word that found no room
};

extern template class WordDecoder<DvxplorerUsbFormat>;
using DvxplorerUsbDecoder = WordDecoder<DvxplorerUsbFormat>;

}  // namespace lecalib
