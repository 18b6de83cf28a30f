// SPDX-License-Identifier: MIT
#include "lecalib/events/evt2_decoder.hpp"

#include "lecalib/events/word_decoder_impl.hpp"

namespace lecalib {

Evt2Format::Evt2Format(SensorSize size) noexcept
    : width_(is_known(size) ? size.width : evt2::kCoordinates),
      height_(is_known(size) ? size.height : evt2::kCoordinates) {}

inline void Evt2Format::take(Word word, EventRoom* room, DecoderStats* stats) noexcept {
  const std::uint32_t type = word >> 28U;
  if (type > evt2::kCdOn) return evt2::take_other_word(word, &clock_, room->side, stats);
  const evt2::CdWord cd(word);
  if (!clock_.started()) {
    ++stats->unplaced;
  } else if (cd.x >= width_ || cd.y >= height_) {
    ++stats->outside;
  } else {
    *room->next++ = {cd.t_us(clock_), static_cast<std::uint16_t>(cd.x), static_cast<std::uint16_t>(cd.y),
                     static_cast<std::uint8_t>(type)};
  }
}

template class WordDecoder<Evt2Format>;

}  // namespace lecalib
