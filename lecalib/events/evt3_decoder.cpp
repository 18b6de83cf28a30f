// SPDX-License-Identifier: MIT
#include "lecalib/events/evt3_decoder.hpp"

#include "lecalib/events/word_decoder_impl.hpp"

namespace lecalib {
namespace {

constexpr unsigned kTimeLowBits = 12;
constexpr std::uint32_t kCoordinates = 1U << 11U;
constexpr std::uint32_t kPolarityBit = 1U << 11U;

enum Type : std::uint32_t {
  kAddrY = 0x0,
  kAddrX = 0x2,
  kVectBaseX = 0x3,
  kVect12 = 0x4,
  kVect8 = 0x5,
  kTimeLow = 0x6,
  kContinued4 = 0x7,
  kTimeHigh = 0x8,
  kExtTrigger = 0xA,
  kOthers = 0xE,
  kContinued12 = 0xF,
};

}  // namespace

Evt3Format::Evt3Format(SensorSize size) noexcept
    : width_(is_known(size) ? size.width : kCoordinates), height_(is_known(size) ? size.height : kCoordinates) {}

inline void Evt3Format::take(Word word, EventRoom* room, DecoderStats* stats) noexcept {
  const std::uint32_t content = word & 0x0FFFU;
  switch (word >> 12U) {
    case kAddrY: take_row(content % kCoordinates); break;
    case kAddrX: take_event(content, room, stats); break;
    case kVectBaseX:
      base_x_ = content % kCoordinates;
      polarity_ = (content & kPolarityBit) != 0 ? 1 : 0;
      break;
    case kVect12: take_vector(content, 12, room, stats); break;
    case kVect8: take_vector(content & 0xFFU, 8, room, stats); break;
    case kTimeLow: take_time_low(content, stats); break;
    case kTimeHigh: take_time_high(content, stats); break;
    case kExtTrigger: take_trigger(content, *room, stats); break;
    case kContinued4:
    case kOthers:
    case kContinued12: ++stats->other_words; break;
    default: ++stats->undefined_words; break;
  }
}

/// Where single events are sparse, most words come as one of three groups, in an order that no branch predictor can
/// tell word by word: [high time that repeats the last,] [low time,] row, column.
[[gnu::always_inline]] inline std::size_t Evt3Format::take_group(std::uint64_t words, EventRoom* room,
                                                                 DecoderStats* stats) noexcept {
  constexpr std::uint64_t kTypes = 0xF000F000F000F000U;
  constexpr std::uint64_t kRowColumn = std::uint64_t{kAddrX} << 28U | std::uint64_t{kAddrY} << 12U;
  constexpr std::uint64_t kLowRowColumn = kRowColumn << 16U | std::uint64_t{kTimeLow} << 12U;
  constexpr std::uint64_t kHighLowRowColumn = kLowRowColumn << 16U | std::uint64_t{kTimeHigh} << 12U;
  const std::uint64_t types = words & kTypes;
  std::size_t bytes = 0;
  if (types == kHighLowRowColumn && clock_.repeats(words & 0xFFFU)) {
    bytes = 8;
    words >>= 16U;
  } else if ((types & 0xFFFFFFFFFFFFU) == kLowRowColumn) {
    bytes = 6;
  } else if ((types & 0xFFFFFFFFU) == kRowColumn) {
    take_row(static_cast<std::uint32_t>(words % kCoordinates));
    take_event(static_cast<std::uint32_t>(words >> 16U & 0xFFFU), room, stats);
    return 4;
  } else {
    return 0;
  }
  take_time_low(static_cast<std::uint32_t>(words & 0xFFFU), stats);
  take_row(static_cast<std::uint32_t>(words >> 16U & (kCoordinates - 1)));
  take_event(static_cast<std::uint32_t>(words >> 32U & 0xFFFU), room, stats);
  return bytes;
}

inline void Evt3Format::take_row(std::uint32_t row) noexcept {
  row_ = row;
  has_row_ = true;
}

inline void Evt3Format::take_event(std::uint32_t x_and_polarity, EventRoom* room, DecoderStats* stats) const noexcept {
  const std::uint32_t x = x_and_polarity % kCoordinates;
  if (!is_placed()) {
    ++stats->unplaced;
  } else if (x >= width_ || row_ >= height_) {
    ++stats->outside;
  } else {
    *room->next++ = {t_us_, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(row_),
                     static_cast<std::uint8_t>((x_and_polarity & kPolarityBit) != 0)};
  }
}

inline void Evt3Format::take_vector(std::uint32_t bits, std::uint32_t length, EventRoom* room,
                                    DecoderStats* stats) noexcept {
  const std::uint32_t x = base_x_;
  // A row of vector words that never ends must not bring x back into the image.
  base_x_ = x < kCoordinates ? x + length : x;
  if (!is_placed()) {
    stats->unplaced += static_cast<std::uint64_t>(__builtin_popcount(bits));
    return;
  }
  if (row_ >= height_ || x + length > width_) {
    const std::uint32_t on_sensor = row_ < height_ && x < width_ ? bits & ((1U << (width_ - x)) - 1U) : 0;
    stats->outside += static_cast<std::uint64_t>(__builtin_popcount(bits ^ on_sensor));
    bits = on_sensor;
  }
  vector_ = bits;
  vector_x_ = x;
  flush(room);
}

inline void Evt3Format::flush(EventRoom* room) noexcept {
  std::uint32_t bits = vector_;
  Event* next = room->next;
  for (; bits != 0 && next != room->end; bits &= bits - 1) {
    const std::uint32_t x = vector_x_ + static_cast<std::uint32_t>(__builtin_ctz(bits));
    *next++ = {t_us_, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(row_), polarity_};
  }
  room->next = next;
  vector_ = bits;
}

inline void Evt3Format::take_time_high(std::uint32_t reading, DecoderStats* stats) noexcept {
  const std::int64_t before = clock_.value();
  take_time(reading, &clock_, stats);
  if (clock_.value() != before) t_us_ = clock_.value() << kTimeLowBits;
}

inline void Evt3Format::take_time_low(std::uint32_t reading, DecoderStats* stats) noexcept {
  const std::int64_t t_us = (clock_.value() << kTimeLowBits) + reading;
  if (t_us < t_us_) ++stats->time_steps_back;
  t_us_ = t_us;
}

inline void Evt3Format::take_trigger(std::uint32_t content, const EventRoom& room, DecoderStats* stats) const noexcept {
  if (!clock_.started()) {
    ++stats->unplaced;
    return;
  }
  const auto kind = (content & 1U) != 0 ? TriggerKind::rising : TriggerKind::falling;
  give_trigger({t_us_, static_cast<std::uint8_t>(content >> 8U), kind}, room.side, stats);
}

template class WordDecoder<Evt3Format>;

}  // namespace lecalib
