// SPDX-License-Identifier: MIT
#include "lecalib/events/es_decoder.hpp"

#include "lecalib/events/word_decoder_impl.hpp"

namespace lecalib {
namespace {

constexpr std::uint8_t kDvsOverflow = 0xFF;
constexpr std::uint8_t kDvsReset = 0xFE;
constexpr std::int64_t kDvsOverflowUs = 127;
/// With the number of overflows in the lower two bits; none of them is a reset.
constexpr std::uint8_t kAtisOverflow = 0xFC;
constexpr std::int64_t kAtisOverflowUs = 63;

}  // namespace

inline void EsFormat::take(Word byte, EventRoom* room, DecoderStats* stats) noexcept {
  if (held_ == 0) return take_first(byte, stats);
  bytes_[held_++] = byte;
  if (held_ < kEventBytes) return;
  held_ = 0;
  end_event(room, stats);
}

inline void EsFormat::take_first(Word byte, DecoderStats* stats) noexcept {
  const bool is_dvs = content_ == EsContent::dvs;
  if (is_dvs && byte == kDvsOverflow) {
    t_us_ += kDvsOverflowUs;
  } else if (!is_dvs && byte > kAtisOverflow) {
    t_us_ += kAtisOverflowUs * (byte - kAtisOverflow);
  } else if (byte == (is_dvs ? kDvsReset : kAtisOverflow)) {
    ++stats->other_words;
  } else {
    t_us_ += byte >> (is_dvs ? 1U : 2U);
    bytes_[0] = byte;
    held_ = 1;
  }
}

inline void EsFormat::end_event(EventRoom* room, DecoderStats* stats) const noexcept {
  const auto x = static_cast<std::uint16_t>(bytes_[1] | bytes_[2] << 8U);
  const auto row = static_cast<std::uint16_t>(bytes_[3] | bytes_[4] << 8U);
  const bool is_exposure = content_ == EsContent::atis && (bytes_[0] & 1U) != 0;
  if (is_exposure) {
    ++stats->other_words;
  } else if (x >= size_.width || row >= size_.height) {
    ++stats->outside;
  } else {
    const auto polarity = static_cast<std::uint8_t>(bytes_[0] >> (content_ == EsContent::dvs ? 0U : 1U) & 1U);
    *room->next++ = {t_us_, x, static_cast<std::uint16_t>(size_.height - 1 - row), polarity};
  }
}

template class WordDecoder<EsFormat>;

}  // namespace lecalib
