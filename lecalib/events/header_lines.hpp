// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/core/span.hpp"
#include "lecalib/events/aedat2_decoder.hpp"
#include "lecalib/events/dat_decoder.hpp"
#include "lecalib/events/es_decoder.hpp"
#include "lecalib/events/evt21_decoder.hpp"

namespace lecalib {

enum class EventFormat : std::uint8_t {
  unknown,       ///< not told yet, or not one of these
  evt2,          ///< Prophesee RAW
  evt21,         ///< Prophesee RAW
  evt3,          ///< Prophesee RAW
  dat,           ///< Prophesee DAT
  aedat2,        ///< jAER
  event_stream,  ///< Event Stream 2
  text,
};

/// What a header says, as far as it was read.
struct HeaderFacts {
  EventFormat format = EventFormat::unknown;
  /// "EVT3", "text", "HDF5" ..., also of formats that are recognised but not read; "unknown" else.
  const char* format_name = "unknown";
  SensorSize size;
  Evt21Order evt21_order = Evt21Order::little;
  unsigned dat_version = 0;
  DatContent dat_content = DatContent::events;
  Aedat2Layout aedat2_layout = Aedat2Layout::davis;
  EsContent es_content = EsContent::dvs;
  bool has_ended = false;  ///< a line said that it is the last one
};

/// Takes in a line "% key value" of a RAW or DAT header. `line` is without white space at its end.
void take_prophesee_line(Span<const char> line, HeaderFacts* facts) noexcept;

/// Takes in a line "# ..." of an AEDAT 2 header. "# AEChip: NAME" tells layout and size.
void take_aedat2_line(Span<const char> line, HeaderFacts* facts) noexcept;

/// Takes in the 20 bytes before the events of an Event Stream, as soon as they say more: `bytes` are the first ones.
/// @return false while more are needed; the format stays unknown where the content is not read
bool take_event_stream_header(Span<const std::uint8_t> bytes, HeaderFacts* facts) noexcept;

/// Takes in the two bytes (type and size of the records) before the events of a DAT file; the format becomes unknown
/// where they are not read.
void take_dat_records(std::uint8_t type, std::uint8_t size, HeaderFacts* facts) noexcept;

}  // namespace lecalib
