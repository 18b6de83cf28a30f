// SPDX-License-Identifier: MIT
#include "lecalib/events/aedat2_decoder.hpp"

#include "lecalib/events/word_decoder_impl.hpp"

namespace lecalib {
namespace {

/// What an address says.
struct Address {
  enum Kind { event, trigger, imu_begin, other, undefined } kind;
  std::uint32_t column = 0, row = 0, polarity = 0;  ///< column from the right, row from the bottom
};

constexpr std::uint32_t bits(std::uint32_t word, unsigned first, unsigned count) noexcept {
  return word >> first & ((1U << count) - 1U);
}

constexpr Address read_davis(std::uint32_t address) noexcept {
  if (bits(address, 31, 1) != 0) {
    // Seven words make an IMU sample, numbered in bits 30 to 28; anything else is a pixel of a frame.
    const bool is_imu = bits(address, 10, 2) == 3;
    return {is_imu && bits(address, 28, 3) == 0 ? Address::imu_begin : Address::other};
  }
  if (bits(address, 10, 1) != 0) return {Address::trigger};
  return {Address::event, bits(address, 12, 10), bits(address, 22, 9), bits(address, 11, 1)};
}

constexpr Address read_dvs128(std::uint32_t address) noexcept {
  if (bits(address, 16, 16) != 0) return {Address::undefined};
  if (bits(address, 15, 1) != 0) return {Address::trigger};
  return {Address::event, bits(address, 1, 7), bits(address, 8, 7), 1 - bits(address, 0, 1)};
}

}  // namespace

inline void Aedat2Format::take(Word word, EventRoom* room, DecoderStats* stats) noexcept {
  const std::uint32_t raw = __builtin_bswap32(static_cast<std::uint32_t>(word));
  const Address address = layout_ == Aedat2Layout::davis ? read_davis(raw) : read_dvs128(raw);
  switch (address.kind) {
    case Address::event:
      take_time(__builtin_bswap32(static_cast<std::uint32_t>(word >> 32U)), &clock_, stats);
      if (address.column >= size_.width || address.row >= size_.height) {
        ++stats->outside;
      } else {
        *room->next++ = {clock_.value(), static_cast<std::uint16_t>(size_.width - 1 - address.column),
                         static_cast<std::uint16_t>(size_.height - 1 - address.row),
                         static_cast<std::uint8_t>(address.polarity)};
      }
      break;
    case Address::trigger: ++stats->triggers; break;
    case Address::imu_begin: ++stats->imu_samples; break;
    case Address::other: ++stats->other_words; break;
    case Address::undefined: ++stats->undefined_words; break;
  }
}

template class WordDecoder<Aedat2Format>;

}  // namespace lecalib
