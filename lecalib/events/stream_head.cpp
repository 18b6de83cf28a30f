// SPDX-License-Identifier: MIT
#include "lecalib/events/stream_head.hpp"

#include "lecalib/events/header_text.hpp"

namespace lecalib {
namespace {

using header_text::is_blank;
using header_text::is_front_of;
using header_text::starts_with;
using header_text::Text;

constexpr char kAedat2Magic[] = "#!AER-DAT2";
constexpr char kEventStreamMagic[] = "Event Stream";

/// First bytes of formats. None begins with '%'.
struct Magic {
  const char* bytes;
  const char* name;
};
constexpr Magic kMagics[] = {
    {kAedat2Magic, "AEDAT 2"},
    {"#!AER-DAT3", "AEDAT 3"},
    {"#!AER-DAT4", "AEDAT 4"},
    {"#!AER-DAT", "AEDAT"},
    {kEventStreamMagic, "Event Stream that ends in its header"},
    {"#ROSBAG", "ROS bag"},
    {"SQLite format 3", "SQLite (ROS 2 bag)"},
    {"\x89MCAP", "MCAP"},
    {"\x89HDF", "HDF5"},
    {"\x93NUMPY", "NumPy array"},
    {"\x1f\x8b", "gzip"},
    {"PK\x03\x04", "zip"},
    {"\x28\xb5\x2f\xfd", "zstd"},
    {"\xfd\x37zXZ", "xz"},
    {"\xef\xbb\xbf", "text with a byte order mark"},
};

constexpr bool is_text(std::uint8_t byte) noexcept {
  return (byte >= 0x20 && byte < 0x7F) || byte == '\t' || byte == '\r' || byte == '\n';
}

}  // namespace

Status StreamHead::read(Span<const std::uint8_t>* input) noexcept {
  while (status_ == Status::in_progress && !input->empty()) {
    take((*input)[0]);
    *input = input->subspan(1);
  }
  return status_;
}

Status StreamHead::finish() noexcept {
  if (status_ != Status::in_progress) return status_;
  if (offset_ == 0) return status_ = Status::malformed_input;
  if (part_ == Part::magic) tell_format_by_first_byte();
  if (part_ == Part::prophesee_lines || part_ == Part::aedat2_lines) parse_header_line();
  if (part_ != Part::done) {
    line_size_ = 0;
    end_header();
  }
  return status_;
}

void StreamHead::take(std::uint8_t byte) noexcept {
  ++offset_;
  const bool is_held = line_size_ < sizeof line_;
  if (is_held) line_[line_size_++] = byte;
  switch (part_) {
    case Part::magic: tell_format(); break;
    case Part::prophesee_lines:
    case Part::aedat2_lines: check_header_line(is_held, byte); break;
    case Part::dat_records: check_dat_records(); break;
    case Part::event_stream:
      if (take_event_stream_header(unread(), &facts_)) {
        line_size_ = 0;
        end_header();
      }
      break;
    case Part::done: break;
  }
}

void StreamHead::tell_format() noexcept {
  const Text seen(reinterpret_cast<const char*>(line_), line_size_);
  for (const Magic& magic : kMagics) {
    if (starts_with(seen, magic.bytes)) {
      facts_.format_name = magic.name;
      if (magic.bytes == kAedat2Magic) {
        facts_.format = EventFormat::aedat2;
        part_ = Part::aedat2_lines;
      } else if (magic.bytes == kEventStreamMagic) {
        part_ = Part::event_stream;
      } else {
        end_header();
      }
      return;
    }
    if (is_front_of(seen, magic.bytes)) return;
  }
  tell_format_by_first_byte();
}

void StreamHead::tell_format_by_first_byte() noexcept {
  if (line_[0] == '%') {
    facts_.format_name = "'%' header without a known evt or format";
    part_ = Part::prophesee_lines;
    check_header_line(true, line_[line_size_ - 1]);
  } else if (is_text(line_[0])) {
    facts_.format = EventFormat::text;
    facts_.format_name = "text";
    end_header();
  } else {
    end_header();
  }
}

/// Whether the bytes at hand, of which `byte` is the last, can be a line of the header.
bool StreamHead::is_header_line(std::uint8_t byte) const noexcept {
  if (part_ == Part::prophesee_lines) {
    const bool begins_well = line_size_ < 2 || line_[1] == ' ' || line_[1] == '\r' || line_[1] == '\n';
    return line_[0] == '%' && begins_well && is_text(byte);
  }
  // Paths and names may hold other alphabets. The lowest byte of an event's address is 0.
  return line_[0] == '#' && (is_text(byte) || byte >= 0x80);
}

void StreamHead::check_header_line(bool is_held, std::uint8_t byte) noexcept {
  const bool is_line = is_header_line(byte);
  // An event of AEDAT 2 may hold '#' and LF, but not CR LF.
  const bool has_cr = line_size_ >= 2 && line_[line_size_ - 2] == '\r';
  if (is_line && byte == '\n' && (has_cr || !lines_end_with_cr_ || !is_held)) {
    lines_end_with_cr_ = lines_end_with_cr_ || (part_ == Part::aedat2_lines && has_cr);
    return parse_header_line();
  }
  if (!is_held) return;  // so long a row of printable characters is text beyond doubt
  if (!is_line) end_lines();
}

void StreamHead::parse_header_line() noexcept {
  Text line(reinterpret_cast<const char*>(line_), line_size_);
  const auto ends_blank = [&line] { return is_blank(line[line.size() - 1]) || line[line.size() - 1] == '\n'; };
  while (!line.empty() && ends_blank()) line = line.first(line.size() - 1);
  part_ == Part::aedat2_lines ? take_aedat2_line(line, &facts_) : take_prophesee_line(line, &facts_);
  line_size_ = 0;
  if (facts_.has_ended) end_lines();
}

/// Two bytes more belong to the header of a DAT file.
void StreamHead::end_lines() noexcept {
  if (facts_.format != EventFormat::dat) return end_header();
  part_ = Part::dat_records;
  check_dat_records();
}

void StreamHead::check_dat_records() noexcept {
  if (line_size_ < 2) return;
  take_dat_records(line_[0], line_[1], &facts_);
  line_size_ = 0;
  end_header();
}

void StreamHead::end_header() noexcept {
  part_ = Part::done;
  status_ = facts_.format == EventFormat::unknown ? Status::unsupported_format : Status::ok;
}

}  // namespace lecalib
