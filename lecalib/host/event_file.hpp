// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lecalib/core/records.hpp"
#include "lecalib/host/error.hpp"
#include "lecalib/host/file_io.hpp"
#include "lecalib/host/gzip.hpp"
#include "lecalib/host/recording_decoder.hpp"
#include "lecalib/host/sensor_size.hpp"

namespace lecalib::host {

/// Reads the events of a recording piece by piece, in bounded memory. The format is told by the content; a file
/// packed by gzip is unpacked on the way.
///
/// The sensor's size is what the file states, else what the caller gives, else the smallest that holds all events (or
/// that of a sensor on the market that they almost fill): that takes a pass over the file. A caller's size that
/// contradicts the file's, or that leaves out more than 1 % of the events, is an error: events off the sensor are
/// dropped otherwise.
class EventFile {
 public:
  /// What a recording has to hold for it not to be an error: triggers and IMU samples may come in files of their own.
  enum class Needs { events, anything };

  /// @param given the sensor's size, or 0 x 0.
  static Result<EventFile> open(const std::string& path, SensorSize given, Needs needs = Needs::events);

  /// The next events, in the order of the file; empty at its end. Valid until the next call. Errors name the line or
  /// the byte: broken or cut content, no events at all, wrong sensor size.
  Result<Span<const Event>> read();

  /// Triggers and IMU samples that came with the events of the last read(), at the file's end with none. Valid until
  /// the next one. A read() with too many of them drops the last.
  [[nodiscard]] Span<const TriggerEvent> triggers() const { return side_.triggers.view(); }
  [[nodiscard]] Span<const ImuSample> imu_samples() const { return side_.imu_samples.view(); }
  /// How many were dropped so far.
  [[nodiscard]] std::uint64_t side_dropped() const;

  [[nodiscard]] const std::string& path() const { return input_.path(); }
  [[nodiscard]] SensorSize sensor() const { return sensor_; }
  /// True when sensor() was guessed from the largest coordinates.
  [[nodiscard]] bool sensor_is_guess() const { return sensor_is_guess_; }
  /// "EVT3", "text" ...
  [[nodiscard]] const char* format_name() const { return decoder_.format_name(); }
  [[nodiscard]] const DecoderStats& stats() const { return decoder_.stats(); }
  [[nodiscard]] std::uint64_t size_bytes() const { return input_.size(); }
  /// Share of the file that was read, 0 to 1; 0 for what has no size.
  [[nodiscard]] double fraction_read() const;
  /// CPU time spent in the decoder, without reading the file.
  [[nodiscard]] std::uint64_t decode_cpu_ns() const { return decode_cpu_ns_; }

 private:
  EventFile(InputFile input, SensorSize size);
  static Result<EventFile> open_with_head(const std::string& path, SensorSize given, Needs needs);
  static Result<SensorSize> size_of_all_events(const std::string& path);
  Result<std::size_t> decode();
  void make_room_for_triggers();
  MaybeError fill();
  MaybeError fill_from_gzip();
  MaybeError read_bytes(Span<const std::uint8_t>* out);
  [[nodiscard]] Error decode_error(Status status) const;
  [[nodiscard]] MaybeError check_sensor() const;

  InputFile input_;
  RecordingDecoder decoder_;
  SensorSize sensor_;
  bool sensor_is_guess_ = false;
  bool at_end_ = false;
  std::vector<std::uint8_t> bytes_;
  Span<const std::uint8_t> unread_;
  std::optional<GzipReader> gzip_;  ///< of a file packed by gzip
  Span<const std::uint8_t> packed_;
  std::vector<std::uint8_t> unpacked_;
  std::vector<Event> events_;
  std::vector<TriggerEvent> triggers_;
  std::vector<ImuSample> imu_samples_;
  SideRecords side_;                      ///< in the room of these two
  std::uint64_t side_dropped_ = 0;        ///< before the last read()
  std::optional<std::size_t> num_ahead_;  ///< events that were decoded while opening and are given by the next read()
  std::uint64_t bytes_read_ = 0;
  std::uint64_t decode_cpu_ns_ = 0;
};

}  // namespace lecalib::host
