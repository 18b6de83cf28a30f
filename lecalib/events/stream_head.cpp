// SPDX-License-Identifier: MIT
#include "lecalib/events/stream_head.hpp"

namespace lecalib {
namespace {

using Text = Span<const char>;

/// First bytes of formats that are not read. None begins with '%'.
struct Magic {
  const char* bytes;
  const char* name;
};
constexpr Magic kMagics[] = {
    {"#!AER-DAT", "AEDAT"},
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

/// What the header's lines "% evt 3.0" and "% format EVT3;..." call the formats.
struct RawFormat {
  const char* evt;
  const char* format;
  const char* name;
  EventFormat value;
};
constexpr RawFormat kRawFormats[] = {
    {"2.0", "EVT2", "EVT2", EventFormat::evt2},
    {"2.1", "EVT21", "EVT2.1", EventFormat::unknown},
    {"3.0", "EVT3", "EVT3", EventFormat::evt3},
    {"4.0", "EVT4", "EVT4", EventFormat::unknown},
};

constexpr bool is_text(std::uint8_t byte) noexcept {
  return (byte >= 0x20 && byte < 0x7F) || byte == '\t' || byte == '\r' || byte == '\n';
}

constexpr bool is_blank(char character) noexcept {
  return character == ' ' || character == '\t' || character == '\r' || character == '\n';
}

/// How many characters of `text` and the zero-terminated `other` are the same, from the front.
std::size_t common_length(Text text, const char* other) noexcept {
  std::size_t i = 0;
  while (i < text.size() && other[i] != '\0' && text[i] == other[i]) ++i;
  return i;
}

bool starts_with(Text text, const char* prefix) noexcept { return prefix[common_length(text, prefix)] == '\0'; }
bool is_front_of(Text text, const char* whole) noexcept { return common_length(text, whole) == text.size(); }
bool equals(Text text, const char* other) noexcept { return starts_with(text, other) && is_front_of(text, other); }

/// Cuts the part before `separator`, or all of it, from the front of *text.
Text take_until(Text* text, char separator) noexcept {
  std::size_t size = 0;
  while (size < text->size() && (*text)[size] != separator) ++size;
  const Text part = text->first(size);
  *text = text->subspan(size + 1);
  return part;
}

/// @return 0 unless `digits` is an integer from 1 to 65535.
std::uint16_t parse_length(Text digits) noexcept {
  std::uint32_t value = 0;
  for (const char digit : digits) {
    if (digit < '0' || digit > '9') return 0;
    value = value * 10 + static_cast<std::uint32_t>(digit - '0');
    if (value > 0xFFFF) return 0;
  }
  return static_cast<std::uint16_t>(value);
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
  if (part_ == Part::header) {
    parse_header_line();
    line_size_ = 0;
    end_header();
  }
  return status_;
}

void StreamHead::take(std::uint8_t byte) noexcept {
  ++offset_;
  const bool is_held = line_size_ < sizeof line_;
  if (is_held) line_[line_size_++] = byte;
  if (part_ == Part::magic) tell_format();
  if (part_ == Part::header) check_header_line(is_held, byte);
}

void StreamHead::tell_format() noexcept {
  const Text seen(reinterpret_cast<const char*>(line_), line_size_);
  for (const Magic& magic : kMagics) {
    if (starts_with(seen, magic.bytes)) return refuse(magic.name);
    if (is_front_of(seen, magic.bytes)) return;
  }
  tell_format_by_first_byte();
}

void StreamHead::tell_format_by_first_byte() noexcept {
  if (line_[0] == '%') {
    format_name_ = "'%' header without a known evt or format";
    part_ = Part::header;
  } else if (is_text(line_[0])) {
    set_format(EventFormat::text, "text");
    end_header();
  } else {
    refuse("unknown");
  }
}

void StreamHead::check_header_line(bool is_held, std::uint8_t byte) noexcept {
  if (byte == '\n' && line_[0] == '%') {
    parse_header_line();
    line_size_ = 0;
    return;
  }
  if (!is_held) return;  // so long a row of printable characters is text beyond doubt
  const bool begins_well = line_[0] == '%' && (line_size_ < 2 || line_[1] == ' ' || line_[1] == '\r');
  if (!begins_well || !is_text(byte)) end_header();
}

void StreamHead::parse_header_line() noexcept {
  Text line(reinterpret_cast<const char*>(line_), line_size_);
  while (!line.empty() && is_blank(line[line.size() - 1])) line = line.first(line.size() - 1);
  take_until(&line, ' ');  // the '%'
  const Text key = take_until(&line, ' ');
  if (equals(key, "end")) {
    end_header();
  } else if (equals(key, "Data") && starts_with(line, "file")) {
    format_name_ = "DAT";
  } else if (equals(key, "geometry")) {
    const Text width = take_until(&line, 'x');
    size_ = {parse_length(width), parse_length(line)};
  } else if (equals(key, "evt")) {
    for (const RawFormat& raw : kRawFormats) {
      if (equals(line, raw.evt)) set_format(raw.value, raw.name);
    }
  } else if (equals(key, "format")) {
    parse_format_line(line);
  }
}

/// E.g. "EVT3;height=720;width=1280".
void StreamHead::parse_format_line(Text line) noexcept {
  const Text name = take_until(&line, ';');
  for (const RawFormat& raw : kRawFormats) {
    if (equals(name, raw.format)) set_format(raw.value, raw.name);
  }
  while (!line.empty()) {
    Text value = take_until(&line, ';');
    const Text key = take_until(&value, '=');
    if (equals(key, "width")) size_.width = parse_length(value);
    if (equals(key, "height")) size_.height = parse_length(value);
  }
}

void StreamHead::set_format(EventFormat format, const char* name) noexcept {
  format_ = format;
  format_name_ = name;
}

void StreamHead::end_header() noexcept {
  part_ = Part::done;
  status_ = format_ == EventFormat::unknown ? Status::unsupported_format : Status::ok;
}

void StreamHead::refuse(const char* name) noexcept {
  set_format(EventFormat::unknown, name);
  end_header();
}

}  // namespace lecalib
