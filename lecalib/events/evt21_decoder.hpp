// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/events/evt2_words.hpp"
#include "lecalib/events/word_decoder.hpp"

namespace lecalib {

/// In which order the bytes of an EVT2.1 word come.
enum class Evt21Order : std::uint8_t {
  little,  ///< 64 bits, least significant byte first (GenX320)
  legacy,  ///< the upper 32 bits, then the lower ones, each least significant byte first (IMX636)
};

/// Prophesee EVT2.1: words of 64 bits. The upper half is an EVT2 word; of a CD word bit i of the lower half is an
/// event at x + i.
class Evt21Format : public WordByWord {
 public:
  using Word = std::uint64_t;
  explicit Evt21Format(SensorSize size, Evt21Order order = Evt21Order::little) noexcept;
  void take(Word word, EventRoom* room, DecoderStats* stats) noexcept;
  void flush(EventRoom* room) noexcept;
  [[nodiscard]] bool is_flushed() const noexcept { return vector_ == 0; }

 private:
  evt2::Clock clock_;
  std::uint32_t width_;
  std::uint32_t height_;
  Evt21Order order_;
  Event first_ = {};          ///< the event of bit 0
  std::uint32_t vector_ = 0;  ///< events of the last word that found no room
};

extern template class WordDecoder<Evt21Format>;
using Evt21Decoder = WordDecoder<Evt21Format>;

}  // namespace lecalib
