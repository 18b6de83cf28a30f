// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "lecalib/core/span.hpp"
#include "lecalib/events/decoder.hpp"
#include "lecalib/host/decompress.hpp"

namespace lecalib::host {

/// What an AEDAT 4 header says of one of its streams.
struct Aedat4Stream {
  std::string type;  ///< "EVTS", "FRME", "IMUS", "TRIG" ...
  SensorSize size;
};

struct Aedat4Header {
  Compression compression = Compression::none;
  std::int64_t table_offset = -1;  ///< where the packets end, from the file's first byte; -1: at its end
  std::map<std::int32_t, Aedat4Stream> streams;
};

/// Reads the FlatBuffer behind the first line and its length. @return nothing where it is none
std::optional<Aedat4Header> read_aedat4_header(Span<const std::uint8_t> bytes);

/// The streams in the XML of the header: nodes below the one named "outInfo", named by number, with an attribute
/// typeIdentifier, and below them one named "info" with sizeX and sizeY. Whatever else stands there is passed over.
std::map<std::int32_t, Aedat4Stream> read_aedat4_streams(std::string_view xml);

}  // namespace lecalib::host
