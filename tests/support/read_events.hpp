// SPDX-License-Identifier: MIT
#pragma once

#include <doctest/doctest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "lecalib/events/event_stream.hpp"

namespace lecalib::test {

/// All events of a recording that the core's own decoders read.
inline std::vector<Event> read_events(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> text((std::istreambuf_iterator<char>(file)), {});
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  EventStreamDecoder decoder;
  Span<const std::uint8_t> input(bytes);
  std::vector<Event> events;
  std::vector<Event> chunk(4096);
  for (std::size_t count = 1; count > 0;) {
    REQUIRE_FALSE(is_error(decoder.decode(&input, chunk, &count)));
    events.insert(events.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(count));
  }
  return events;
}

}  // namespace lecalib::test
