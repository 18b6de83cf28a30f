// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/core/span.hpp"
#include "lecalib/events/decoder.hpp"

namespace lecalib {

enum class EventFormat : std::uint8_t {
  unknown,  ///< not told yet, or not one of these
  evt2,     ///< Prophesee RAW
  evt3,     ///< Prophesee RAW
  text,
};

/// Reads what stands before the events: tells the format by the first bytes and takes in the header of a RAW file.
///
/// A RAW header is a row of lines "% key value". It ends after "% end", or before the first line that does not begin
/// with "% " (or is "%" alone). Events may begin with the byte of '%' too, so a line with a byte that is not printable
/// ASCII was none: its bytes are given back by unread(). Lines are held to 255 bytes; of longer ones the front is read.
class StreamHead {
 public:
  /// Takes bytes from the front of *input until the format is known and its header is over.
  /// @return in_progress (all input used, more is needed) | ok (the events follow) | unsupported_format
  Status read(Span<const std::uint8_t>* input) noexcept;
  /// There are no more bytes. @return ok | unsupported_format | malformed_input (the stream is empty)
  Status finish() noexcept;

  [[nodiscard]] EventFormat format() const noexcept { return format_; }
  /// "EVT3", "text", "HDF5" ..., also of formats that are recognised but not read; "unknown" else. Never null.
  [[nodiscard]] const char* format_name() const noexcept { return format_name_; }
  /// The sensor's size as the header states it.
  [[nodiscard]] SensorSize size() const noexcept { return size_; }
  /// Bytes that were taken but belong to the events.
  [[nodiscard]] Span<const std::uint8_t> unread() const noexcept { return {line_, line_size_}; }
  /// Where the events begin in the stream.
  [[nodiscard]] std::uint64_t events_offset() const noexcept { return offset_ - line_size_; }

 private:
  enum class Part : std::uint8_t { magic, header, done };

  void take(std::uint8_t byte) noexcept;
  void tell_format() noexcept;
  void tell_format_by_first_byte() noexcept;
  void check_header_line(bool is_held, std::uint8_t byte) noexcept;
  void parse_header_line() noexcept;
  void parse_format_line(Span<const char> line) noexcept;
  void set_format(EventFormat format, const char* name) noexcept;
  void end_header() noexcept;
  void refuse(const char* name) noexcept;

  std::uint8_t line_[255] = {};
  std::uint8_t line_size_ = 0;
  Part part_ = Part::magic;
  Status status_ = Status::in_progress;
  EventFormat format_ = EventFormat::unknown;
  const char* format_name_ = "unknown";
  SensorSize size_;
  std::uint64_t offset_ = 0;
};

}  // namespace lecalib
