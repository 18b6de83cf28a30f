// SPDX-License-Identifier: MIT
#pragma once

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "lecalib/events/event_stream.hpp"
#include "support/decode_pieces.hpp"

namespace lecalib::test {

/// What the stream decoder says of `bytes`, and of itself.
struct Opened {
  Decoded decoded;
  EventFormat format;
  std::string format_name;
  SensorSize stated;
  SensorSize size;
};

inline Opened open(const Bytes& bytes, SensorSize given = {}) {
  EventStreamDecoder decoder(given);
  Opened opened;
  opened.decoded = decode_whole(decoder, bytes);
  Span<const std::uint8_t> input(bytes);
  std::vector<Event> out(1000);
  std::size_t count = 0;
  do {
    if (decoder.decode(&input, out, &count) != Status::ok) break;
  } while (count > 0);
  if (decoder.finish(out, &count) != Status::ok) CHECK(opened.decoded.status != Status::ok);
  opened.format = decoder.format();
  opened.format_name = decoder.format_name();
  opened.stated = decoder.stated_size();
  opened.size = decoder.size();
  CHECK(decoder.width() == opened.size.width);
  CHECK(decoder.height() == opened.size.height);
  return opened;
}

}  // namespace lecalib::test
