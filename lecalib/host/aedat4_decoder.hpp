// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "lecalib/events/decoder.hpp"
#include "lecalib/host/aedat4_header.hpp"

namespace lecalib::host {

/// AEDAT 4 of iniVation's DV: a header and packets of events, frames, IMU samples and triggers, each a FlatBuffer and
/// most of them compressed. Contract: events/decoder.hpp, except that it allocates: a packet and its content are held,
/// 256 MiB each at most.
///
/// Events are those of the stream that comes first. DecoderStats::other_words counts packets of frames and of further
/// event streams, undefined_words triggers and IMU samples that contradict themselves. Times are microseconds since
/// 1970. The IMU's axes are taken as those of a DAVIS.
class Aedat4Decoder {
 public:
  /// First bytes of every such file.
  static constexpr std::string_view kMagic = "#!AER-DAT4";

  /// @param size of the sensor, for files that do not state it
  explicit Aedat4Decoder(SensorSize size = {}) : given_size_(size) {}

  /// @return ok | invalid_argument (`out` is empty) | malformed_input
  Status decode(Span<const std::uint8_t>* input, Span<Event> out, std::size_t* count, SideRecords* side = nullptr);
  /// @return ok | invalid_argument (`out` is empty) | malformed_input (the file ends within a packet)
  Status finish(Span<Event> out, std::size_t* count, SideRecords* side = nullptr);

  /// What the file states for its first event stream; 0 x 0 when it does not.
  [[nodiscard]] SensorSize stated_size() const { return stated_size_; }
  [[nodiscard]] SensorSize size() const { return is_known(stated_size_) ? stated_size_ : given_size_; }
  [[nodiscard]] const DecoderStats& stats() const { return stats_; }
  [[nodiscard]] const DecodeError& error() const { return error_; }

 private:
  enum class Part : std::uint8_t { first_line, header_size, header, packet_head, packet, table };

  void take(Span<const std::uint8_t>* input, SideRecords* side);
  void end_piece(SideRecords* side);
  void take_packet_head(SideRecords* side);
  void begin_packets();
  void take_packet(SideRecords* side);
  bool take_content(Span<const std::uint8_t> content, std::string_view type, SideRecords* side);
  void give_events(Span<Event> out, std::size_t* count);
  void expect(Part part, std::size_t bytes);
  void fail(const char* expected);

  SensorSize given_size_;
  SensorSize stated_size_;
  Part part_ = Part::first_line;
  std::vector<std::uint8_t> piece_;  ///< of the header or a packet, as far as it has come
  std::size_t piece_size_ = 14;
  std::uint64_t offset_ = 0;  ///< where the piece begins
  Aedat4Header header_;
  std::int32_t stream_ = 0;                    ///< of the packet at hand
  std::optional<std::int32_t> events_stream_;  ///< whose events are given out
  std::vector<std::uint8_t> content_;
  std::size_t next_event_ = 0;  ///< bytes of content_
  std::size_t events_end_ = 0;
  std::int64_t last_t_us_ = 0;
  DecoderStats stats_;
  DecodeError error_;
  Status status_ = Status::ok;
};

}  // namespace lecalib::host
