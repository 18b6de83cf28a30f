// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/events/word_decoder.hpp"

namespace lecalib {

/// What an Event Stream file holds, by the number in its header.
enum class EsContent : std::uint8_t {
  dvs = 1,   ///< events
  atis = 2,  ///< events and exposure measurements, which are skipped
};

/// Event Stream 2 (.es): 5 bytes an event, the first of which holds the microseconds since the event before; between
/// events single bytes that only let time pass or bring a reader that lost its place back to the begin of an event.
/// Rows count from the bottom. The size stands in every such file; without one there are no events, all are counted as
/// outside.
class EsFormat : public EventPerWord {
 public:
  using Word = std::uint8_t;
  explicit EsFormat(SensorSize size, EsContent content = EsContent::dvs) noexcept : size_(size), content_(content) {}
  void take(Word byte, EventRoom* room, DecoderStats* stats) noexcept;
  [[nodiscard]] std::size_t held() const noexcept { return held_; }

 private:
  void take_first(Word byte, DecoderStats* stats) noexcept;
  void end_event(EventRoom* room, DecoderStats* stats) const noexcept;

  static constexpr std::uint8_t kEventBytes = 5;

  SensorSize size_;
  EsContent content_;
  std::int64_t t_us_ = 0;
  std::uint8_t bytes_[kEventBytes] = {};  ///< of the event at hand
  std::uint8_t held_ = 0;
};

extern template class WordDecoder<EsFormat>;
using EsDecoder = WordDecoder<EsFormat>;

}  // namespace lecalib
