// SPDX-License-Identifier: MIT
#include "lecalib/events/dat_decoder.hpp"

#include "lecalib/events/bytes.hpp"
#include "lecalib/events/word_decoder_impl.hpp"

namespace lecalib {
namespace {

constexpr std::uint32_t kDatCoordinates = 1U << 14U;

}  // namespace

DatFormat::DatFormat(SensorSize size, unsigned version, DatContent content) noexcept
    : width_(is_known(size) ? size.width : kDatCoordinates),
      height_(is_known(size) ? size.height : kDatCoordinates),
      content_(content),
      is_old_(version < 2) {}

inline void DatFormat::take(Word word, EventRoom* room, DecoderStats* stats) noexcept {
  const auto address = static_cast<std::uint32_t>(word >> 32U);
  if (content_ == DatContent::triggers) {
    take_time(static_cast<std::uint32_t>(word), &clock_, stats);
    const auto kind = bits_of(address, 0, 4) != 0 ? TriggerKind::rising : TriggerKind::falling;
    return give_trigger({clock_.value(), static_cast<std::uint8_t>(bits_of(address, 26, 6)), kind}, room->side, stats);
  }
  const std::uint32_t x = is_old_ ? bits_of(address, 0, 9) : bits_of(address, 0, 14);
  const std::uint32_t y = is_old_ ? bits_of(address, 9, 8) : bits_of(address, 14, 14);
  const std::uint32_t polarity = is_old_ ? bits_of(address, 17, 1) : bits_of(address, 28, 4);
  take_time(static_cast<std::uint32_t>(word), &clock_, stats);
  if (x >= width_ || y >= height_) {
    ++stats->outside;
  } else {
    *room->next++ = {clock_.value(), static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y),
                     static_cast<std::uint8_t>(polarity != 0)};
  }
}

template class WordDecoder<DatFormat>;

}  // namespace lecalib
