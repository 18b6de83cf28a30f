// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/events/dat_decoder.hpp"
#include "lecalib/events/evt2_decoder.hpp"
#include "lecalib/events/evt3_decoder.hpp"
#include "lecalib/events/stream_head.hpp"
#include "lecalib/events/text_decoder.hpp"

namespace lecalib {

/// Decodes a recording or a live stream whose format is told by its first bytes. Contract: decoder.hpp.
class EventStreamDecoder {
 public:
  /// @param size of the sensor, for streams that do not state it; what a stream states comes first. Events beside the
  /// sensor are dropped and counted; with no size known none are.
  explicit EventStreamDecoder(SensorSize size = {}) noexcept : given_size_(size) {}

  /// @return ok | invalid_argument (`out` is empty) | unsupported_format (see format_name()) | malformed_input
  Status decode(Span<const std::uint8_t>* input, Span<Event> out, std::size_t* count,
                SideRecords* side = nullptr) noexcept;
  /// @return as decode(); malformed_input also for a stream without a byte and for one that ends within a word
  Status finish(Span<Event> out, std::size_t* count, SideRecords* side = nullptr) noexcept;

  /// unknown until the first bytes were seen.
  [[nodiscard]] EventFormat format() const noexcept { return head_.facts().format; }
  /// "EVT3", "text" ..., also of formats that are recognised but not read; "unknown" else. Never null.
  [[nodiscard]] const char* format_name() const noexcept { return head_.facts().format_name; }
  /// What the stream itself states; 0 x 0 when it does not.
  [[nodiscard]] SensorSize stated_size() const noexcept;
  /// The size events are checked against: the stated one, else the constructor's.
  [[nodiscard]] SensorSize size() const noexcept;
  [[nodiscard]] std::uint16_t width() const noexcept { return size().width; }
  [[nodiscard]] std::uint16_t height() const noexcept { return size().height; }

  [[nodiscard]] const DecoderStats& stats() const noexcept;
  /// Where and why decoding stopped; the offset counts from the stream's first byte.
  [[nodiscard]] const DecodeError& error() const noexcept { return error_; }

 private:
  template <class Self, class Call>
  static void with_decoder(Self* self, Call&& call) noexcept;
  template <class Call>
  void run_decoder(Call&& call) noexcept;
  Status begin_events(Status head_status) noexcept;
  Status decode_events(Span<const std::uint8_t>* input, Span<Event> out, std::size_t* count,
                       SideRecords* side) noexcept;

  SensorSize given_size_;
  StreamHead head_;
  std::size_t replayed_ = 0;  ///< bytes of head_.unread() that the decoder has taken
  bool has_begun_ = false;    ///< the events have
  Evt2Decoder evt2_;
  Evt21Decoder evt21_;
  Evt3Decoder evt3_;
  DatDecoder dat_;
  Aedat2Decoder aedat2_;
  EsDecoder es_;
  TextDecoder text_;
  DecodeError error_;
  Status status_ = Status::ok;
};

}  // namespace lecalib
