// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "lecalib/events/event_stream.hpp"
#include "lecalib/usb/stream_buffer.hpp"

namespace lecalib::usb {

/// Of a usual ring a quarter: the rest is room for what comes while a window is worked on, and what waits at the end is
/// soon worked on.
inline constexpr std::size_t kUsualMostWaiting = StreamBufferOptions().places / 4;

/// What a reader that did not keep up has not seen.
struct LeftOut {
  std::uint64_t events = 0;
  std::uint64_t buffers = 0;  ///< not even decoded
  std::uint64_t times = 0;    ///< that it fell behind
};

/// Turns the buffers of a live stream into events, as a file of the same bytes is decoded.
///
/// Finding lines takes many times longer than decoding. When `most_waiting` buffers have come to wait, the events of
/// all that wait are decoded, counted and left out, and the reader goes on with what is of now: the ring does not
/// overflow, the decoder sees every byte, and what the reader gets are long stretches without gaps rather than a bit of
/// everything, since a window is worth little without all of its events. Where buffers were lost all the same, all that
/// waits goes as it is: the decoder itself is too slow, and what waits has further gaps.
class LiveDecoder {
 public:
  /// @param most_waiting > 0; well below the ring's places, as more comes while the reader works
  explicit LiveDecoder(std::size_t most_waiting = kUsualMostWaiting)
      : most_waiting_(most_waiting), events_(kEventsPerStep) {}

  /// A stream begins. The clock of a camera that was plugged in anew begins anew: its times go on after those before.
  /// @param header of the stream's recording @return as EventStreamDecoder::decode()
  Status begin(const std::string& header);

  /// Takes the stream's next buffer, once next() has given all of the last one. @param waiting buffers behind it
  void take(const BufferRing::Buffer& buffer, std::size_t waiting);

  /// @param[out] events valid until the next call; empty: take() a further buffer
  /// @return as EventStreamDecoder::decode()
  Status next(Span<const Event>* events);

  /// Whether events are missing between those of the last next() and those before.
  [[nodiscard]] bool has_gap() const { return has_gap_; }
  [[nodiscard]] const LeftOut& left_out() const { return left_out_; }
  /// Of all streams; events left out are included.
  [[nodiscard]] DecoderStats stats() const;
  [[nodiscard]] const DecodeError& error() const { return decoder_->error(); }

 private:
  static constexpr std::size_t kEventsPerStep = std::size_t{1} << 16;

  std::size_t most_waiting_;
  std::unique_ptr<EventStreamDecoder> decoder_;
  Span<const std::uint8_t> bytes_;  ///< to be decoded next
  std::vector<Event> events_;
  std::int64_t shift_us_ = 0;
  std::int64_t last_us_ = 0;
  std::size_t buffers_to_leave_out_ = 0;  ///< the current one included
  bool skips_ = false;                    ///< and these are not decoded
  bool is_behind_ = false;
  bool gap_is_ahead_ = false;  ///< before the next event that is given
  bool has_gap_ = false;
  LeftOut left_out_;
  DecoderStats before_;  ///< of streams that are over
};

}  // namespace lecalib::usb
