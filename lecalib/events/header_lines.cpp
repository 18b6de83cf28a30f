// SPDX-License-Identifier: MIT
#include "lecalib/events/header_lines.hpp"

#include "lecalib/events/header_text.hpp"

namespace lecalib {
namespace {

using header_text::contains;
using header_text::equals;
using header_text::parse_length;
using header_text::starts_with;
using header_text::take_until;
using header_text::Text;

/// What the header's lines "% evt 3.0" and "% format EVT3;..." call the formats.
struct RawFormat {
  const char* evt;
  const char* format;
  const char* name;
  EventFormat value;
};
constexpr RawFormat kRawFormats[] = {
    {"2.0", "EVT2", "EVT2", EventFormat::evt2},
    {"2.1", "EVT21", "EVT2.1", EventFormat::evt21},
    {"3.0", "EVT3", "EVT3", EventFormat::evt3},
    {"4.0", "EVT4", "EVT4", EventFormat::unknown},
};

/// What stands in the names that jAER gives its chips ("eu.seebetter.ini.chips.davis.DAVIS240C").
struct Chip {
  const char* part;
  SensorSize size;
  Aedat2Layout layout;
};
constexpr Chip kChips[] = {
    {"DVS128", {128, 128}, Aedat2Layout::dvs128}, {"128", {128, 128}, Aedat2Layout::davis},
    {"208", {208, 192}, Aedat2Layout::davis},     {"240", {240, 180}, Aedat2Layout::davis},
    {"346", {346, 260}, Aedat2Layout::davis},     {"640", {640, 480}, Aedat2Layout::davis},
};

constexpr std::size_t kEsHeaderBytes = 20;
constexpr std::size_t kEsVersionAt = 12;
constexpr std::size_t kEsContentAt = 15;
constexpr std::size_t kEsWidthAt = 16;
constexpr std::size_t kEsHeightAt = 18;

void set_format(EventFormat format, const char* name, HeaderFacts* facts) noexcept {
  facts->format = format;
  facts->format_name = name;
}

/// What follows a "%" line's key that names the byte order of EVT2.1.
void take_endianness(Text value, HeaderFacts* facts) noexcept {
  facts->evt21_order = equals(value, "legacy") ? Evt21Order::legacy : Evt21Order::little;
}

/// E.g. "EVT3;height=720;width=1280".
void take_format_line(Text line, HeaderFacts* facts) noexcept {
  const Text name = take_until(&line, ';');
  for (const RawFormat& raw : kRawFormats) {
    if (equals(name, raw.format)) set_format(raw.value, raw.name, facts);
  }
  while (!line.empty()) {
    Text value = take_until(&line, ';');
    const Text key = take_until(&value, '=');
    if (equals(key, "width")) facts->size.width = parse_length(value);
    if (equals(key, "height")) facts->size.height = parse_length(value);
    if (equals(key, "endianness")) take_endianness(value, facts);
  }
}

}  // namespace

void take_prophesee_line(Span<const char> line, HeaderFacts* facts) noexcept {
  take_until(&line, ' ');  // the '%'
  const Text key = take_until(&line, ' ');
  if (equals(key, "end")) {
    facts->has_ended = true;
  } else if (equals(key, "Data") && starts_with(line, "file")) {
    set_format(EventFormat::dat, "DAT", facts);
  } else if (equals(key, "Version")) {
    if (facts->format == EventFormat::unknown) set_format(EventFormat::dat, "DAT", facts);
    facts->dat_version = parse_length(line);
  } else if (equals(key, "Width")) {
    facts->size.width = parse_length(line);
  } else if (equals(key, "Height")) {
    facts->size.height = parse_length(line);
  } else if (equals(key, "geometry")) {
    const Text width = take_until(&line, 'x');
    facts->size = {parse_length(width), parse_length(line)};
  } else if (equals(key, "endianness")) {
    take_endianness(line, facts);
  } else if (equals(key, "evt")) {
    for (const RawFormat& raw : kRawFormats) {
      if (equals(line, raw.evt)) set_format(raw.value, raw.name, facts);
    }
  } else if (equals(key, "format")) {
    take_format_line(line, facts);
  }
}

void take_aedat2_line(Span<const char> line, HeaderFacts* facts) noexcept {
  if (contains(line, "End Of ASCII Header")) facts->has_ended = true;
  if (!contains(line, "AEChip")) return;
  for (const Chip& chip : kChips) {
    if (!contains(line, chip.part)) continue;
    facts->size = chip.size;
    facts->aedat2_layout = chip.layout;
    return;
  }
}

bool take_event_stream_header(Span<const std::uint8_t> bytes, HeaderFacts* facts) noexcept {
  if (bytes.size() <= kEsContentAt) return false;
  const std::uint8_t content = bytes[kEsContentAt];
  if (bytes[kEsVersionAt] != 2) {
    facts->format_name = "Event Stream of a version other than 2";
    return true;
  }
  if (content != static_cast<std::uint8_t>(EsContent::dvs) && content != static_cast<std::uint8_t>(EsContent::atis)) {
    facts->format_name = "Event Stream without DVS or ATIS events";
    return true;
  }
  if (bytes.size() < kEsHeaderBytes) return false;
  const auto length_at = [&](std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] | static_cast<unsigned>(bytes[at + 1]) << 8U);
  };
  facts->size = {length_at(kEsWidthAt), length_at(kEsHeightAt)};
  facts->es_content = static_cast<EsContent>(content);
  set_format(EventFormat::event_stream, "Event Stream", facts);
  return true;
}

void take_dat_records(std::uint8_t type, std::uint8_t size, HeaderFacts* facts) noexcept {
  constexpr std::uint8_t kEvent2d = 0;
  constexpr std::uint8_t kEventCd = 12;
  constexpr std::uint8_t kTrigger = 14;
  constexpr std::uint8_t kBytes = 8;
  if ((type == kEvent2d || type == kEventCd) && size == kBytes) return;
  if (type == kTrigger && size == kBytes) {
    facts->dat_content = DatContent::triggers;
    facts->format_name = "DAT of triggers";
    return;
  }
  set_format(EventFormat::unknown, "DAT of records that are neither CD events nor triggers", facts);
}

}  // namespace lecalib
