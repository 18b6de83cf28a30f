// SPDX-License-Identifier: MIT
#include "lecalib/events/evt21_decoder.hpp"

#include "lecalib/events/word_decoder_impl.hpp"

namespace lecalib {
namespace {

constexpr std::uint32_t kVectorLength = 32;

}  // namespace

Evt21Format::Evt21Format(SensorSize size, Evt21Order order) noexcept
    : width_(is_known(size) ? size.width : evt2::kCoordinates),
      height_(is_known(size) ? size.height : evt2::kCoordinates),
      order_(order) {}

inline void Evt21Format::take(Word word, EventRoom* room, DecoderStats* stats) noexcept {
  if (order_ == Evt21Order::legacy) word = word << 32U | word >> 32U;
  const auto upper = static_cast<std::uint32_t>(word >> 32U);
  const std::uint32_t type = upper >> 28U;
  if (type > evt2::kCdOn) return evt2::take_other_word(upper, &clock_, room->side, stats);
  const evt2::CdWord cd(upper);
  auto bits = static_cast<std::uint32_t>(word);
  if (!clock_.started()) {
    stats->unplaced += static_cast<std::uint64_t>(__builtin_popcount(bits));
    return;
  }
  if (cd.y >= height_ || cd.x + kVectorLength > width_) {
    const std::uint32_t on_sensor = cd.y < height_ && cd.x < width_ ? width_ - cd.x : 0;
    const std::uint32_t kept = on_sensor < kVectorLength ? bits & ((1U << on_sensor) - 1U) : bits;
    stats->outside += static_cast<std::uint64_t>(__builtin_popcount(bits ^ kept));
    bits = kept;
  }
  first_ = {cd.t_us(clock_), static_cast<std::uint16_t>(cd.x), static_cast<std::uint16_t>(cd.y),
            static_cast<std::uint8_t>(type)};
  vector_ = bits;
  flush(room);
}

inline void Evt21Format::flush(EventRoom* room) noexcept {
  std::uint32_t bits = vector_;
  Event* next = room->next;
  for (; bits != 0 && next != room->end; bits &= bits - 1) {
    *next = first_;
    next->x = static_cast<std::uint16_t>(first_.x + __builtin_ctz(bits));
    ++next;
  }
  room->next = next;
  vector_ = bits;
}

template class WordDecoder<Evt21Format>;

}  // namespace lecalib
