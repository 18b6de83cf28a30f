// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/core/span.hpp"
#include "lecalib/events/header_lines.hpp"

namespace lecalib {

/// Reads what stands before the events: tells the format by the first bytes and takes in the header.
///
/// Headers of RAW and DAT are rows of lines "% key value", those of AEDAT 2 of lines "# ...". One ends after the line
/// that says so ("% end", "#End Of ASCII Header"), or before the first line that does not begin like the others. Events
/// may begin with the byte of '%' or '#' too, so a line with a byte that no such line has was none: its bytes are given
/// back by unread(). Lines are held to 255 bytes; of longer ones the front is read.
class StreamHead {
 public:
  /// Takes bytes from the front of *input until the format is known and its header is over.
  /// @return in_progress (all input used, more is needed) | ok (the events follow) | unsupported_format
  Status read(Span<const std::uint8_t>* input) noexcept;
  /// There are no more bytes. @return ok | unsupported_format | malformed_input (the stream is empty)
  Status finish() noexcept;

  /// What the header says; complete once read() or finish() has returned something else than in_progress.
  [[nodiscard]] const HeaderFacts& facts() const noexcept { return facts_; }
  /// Bytes that were taken but belong to the events.
  [[nodiscard]] Span<const std::uint8_t> unread() const noexcept { return {line_, line_size_}; }
  /// Where the events begin in the stream.
  [[nodiscard]] std::uint64_t events_offset() const noexcept { return offset_ - line_size_; }

 private:
  enum class Part : std::uint8_t { magic, prophesee_lines, dat_records, aedat2_lines, event_stream, done };

  void take(std::uint8_t byte) noexcept;
  void tell_format() noexcept;
  void tell_format_by_first_byte() noexcept;
  [[nodiscard]] bool is_header_line(std::uint8_t byte) const noexcept;
  void check_header_line(bool is_held, std::uint8_t byte) noexcept;
  void parse_header_line() noexcept;
  void check_dat_records() noexcept;
  void end_lines() noexcept;
  void end_header() noexcept;

  std::uint8_t line_[255] = {};
  std::uint8_t line_size_ = 0;
  Part part_ = Part::magic;
  Status status_ = Status::in_progress;
  HeaderFacts facts_;
  bool lines_end_with_cr_ = false;  ///< the first one did, before its LF
  std::uint64_t offset_ = 0;
};

}  // namespace lecalib
