// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "lecalib/events/event_stream.hpp"
#include "lecalib/host/aedat4_decoder.hpp"

namespace lecalib::host {

/// Decodes a recording in any format that lecalib reads, told by its first bytes. Contract: events/decoder.hpp, except
/// that it allocates for AEDAT 4.
class RecordingDecoder {
 public:
  /// @param size as for EventStreamDecoder
  explicit RecordingDecoder(SensorSize size = {}) : given_size_(size), stream_(size) {}

  Status decode(Span<const std::uint8_t>* input, Span<Event> out, std::size_t* count, SideRecords* side = nullptr);
  Status finish(Span<Event> out, std::size_t* count, SideRecords* side = nullptr);

  /// "EVT3", "AEDAT 4" ..., also of formats that are recognised but not read; "unknown" else.
  [[nodiscard]] const char* format_name() const { return stream_.format_name(); }
  /// What the recording itself states; 0 x 0 when it does not.
  [[nodiscard]] SensorSize stated_size() const { return aedat4_ ? aedat4_->stated_size() : stream_.stated_size(); }
  /// The size events are checked against: the stated one, else the constructor's.
  [[nodiscard]] SensorSize size() const { return aedat4_ ? aedat4_->size() : stream_.size(); }
  [[nodiscard]] const DecoderStats& stats() const { return aedat4_ ? aedat4_->stats() : stream_.stats(); }
  [[nodiscard]] const DecodeError& error() const { return aedat4_ ? aedat4_->error() : stream_.error(); }

 private:
  SensorSize given_size_;
  EventStreamDecoder stream_;
  std::optional<Aedat4Decoder> aedat4_;
};

}  // namespace lecalib::host
