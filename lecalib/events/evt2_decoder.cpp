// SPDX-License-Identifier: MIT
#include "lecalib/events/evt2_decoder.hpp"

#include "lecalib/events/word_decoder_impl.hpp"

namespace lecalib {
namespace {

constexpr unsigned kTimeLowBits = 6;
constexpr unsigned kCoordinateBits = 11;
constexpr std::uint32_t kCoordinates = 1U << kCoordinateBits;

enum Type : std::uint32_t {
  kCdOff = 0x0,
  kCdOn = 0x1,
  kTimeHigh = 0x8,
  kExtTrigger = 0xA,
  kOthers = 0xE,
  kContinued = 0xF,
};

}  // namespace

Evt2Format::Evt2Format(SensorSize size) noexcept
    : width_(is_known(size) ? size.width : kCoordinates), height_(is_known(size) ? size.height : kCoordinates) {}

inline void Evt2Format::take(Word word, EventRoom* room, DecoderStats* stats) noexcept {
  const std::uint32_t type = word >> 28U;
  switch (type) {
    case kCdOff:
    case kCdOn: {
      const std::uint32_t x = word >> kCoordinateBits & (kCoordinates - 1);
      const std::uint32_t y = word & (kCoordinates - 1);
      const std::uint32_t time_low = word >> (2 * kCoordinateBits) & ((1U << kTimeLowBits) - 1);
      if (!clock_.started()) {
        ++stats->unplaced;
      } else if (x >= width_ || y >= height_) {
        ++stats->outside;
      } else {
        *room->next++ = {(clock_.value() << kTimeLowBits) + time_low, static_cast<std::uint16_t>(x),
                         static_cast<std::uint16_t>(y), static_cast<std::uint8_t>(type)};
      }
      break;
    }
    case kTimeHigh: {
      const std::int64_t before = clock_.value();
      clock_.update(word & 0x0FFFFFFFU);
      if (clock_.value() < before) ++stats->time_steps_back;
      stats->time_wraps = static_cast<std::uint64_t>(clock_.wraps());
      break;
    }
    case kExtTrigger:
    case kOthers:
    case kContinued: ++stats->other_words; break;
    default: ++stats->undefined_words; break;
  }
}

template class WordDecoder<Evt2Format>;

}  // namespace lecalib
