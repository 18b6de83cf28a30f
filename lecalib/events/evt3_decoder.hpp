// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/events/word_decoder.hpp"
#include "lecalib/events/wrapping_clock.hpp"

namespace lecalib {

/// Prophesee EVT3: words of 16 bits, type in the upper 4. Row, time and vector base stand until they are replaced; an
/// X word is one event, a vector word up to 12 in a row. TIME_HIGH (12 bits) and TIME_LOW (12 bits) make 24 bits of
/// microseconds, which run over every 16.8 s. TIME_HIGH is repeated every 16 us; one that changes sets TIME_LOW to 0.
/// TIME_LOW never carries into TIME_HIGH: where it steps back it was sent late.
class Evt3Format {
 public:
  using Word = std::uint16_t;
  explicit Evt3Format(SensorSize size) noexcept;
  void take(Word word, EventRoom* room, DecoderStats* stats) noexcept;
  std::size_t take_group(std::uint64_t words, EventRoom* room, DecoderStats* stats) noexcept;
  void flush(EventRoom* room) noexcept;
  [[nodiscard]] bool is_flushed() const noexcept { return vector_ == 0; }
  [[nodiscard]] std::size_t held() const noexcept { return 0; }

 private:
  void take_row(std::uint32_t row) noexcept;
  void take_event(std::uint32_t x_and_polarity, EventRoom* room, DecoderStats* stats) const noexcept;
  void take_vector(std::uint32_t bits, std::uint32_t length, EventRoom* room, DecoderStats* stats) noexcept;
  void take_time_high(std::uint32_t reading, DecoderStats* stats) noexcept;
  void take_time_low(std::uint32_t reading, DecoderStats* stats) noexcept;
  void take_trigger(std::uint32_t content, const EventRoom& room, DecoderStats* stats) const noexcept;
  [[nodiscard]] bool is_placed() const noexcept { return clock_.started() && has_row_; }

  WrappingClock<12> clock_;
  std::int64_t t_us_ = 0;
  std::uint32_t width_;
  std::uint32_t height_;
  std::uint32_t row_ = 0;
  std::uint32_t base_x_ = 0;    ///< x of the next vector word's lowest bit
  std::uint32_t vector_ = 0;    ///< bits of the current vector word whose events are still to be given
  std::uint32_t vector_x_ = 0;  ///< x of bit 0 of vector_
  std::uint8_t polarity_ = 0;   ///< of vector words
  bool has_row_ = false;
};

extern template class WordDecoder<Evt3Format>;
using Evt3Decoder = WordDecoder<Evt3Format>;

}  // namespace lecalib
