// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/events/evt2_words.hpp"
#include "lecalib/events/word_decoder.hpp"

namespace lecalib {

/// Prophesee EVT2: words of 32 bits, type in the upper 4. A CD word carries the lower 6 bits of its time, x and y;
/// TIME_HIGH carries the upper 28: 34 bits of microseconds, which run over after 4.8 hours.
class Evt2Format : public EventPerWord {
 public:
  using Word = std::uint32_t;
  explicit Evt2Format(SensorSize size) noexcept;
  void take(Word word, EventRoom* room, DecoderStats* stats) noexcept;

 private:
  evt2::Clock clock_;
  std::uint32_t width_;
  std::uint32_t height_;
};

extern template class WordDecoder<Evt2Format>;
using Evt2Decoder = WordDecoder<Evt2Format>;

}  // namespace lecalib
