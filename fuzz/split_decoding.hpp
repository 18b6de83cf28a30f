// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "lecalib/events/decoder.hpp"

namespace lecalib::fuzz {

/// What a decoder made of a stream, as far as it can be compared cheaply.
struct Digest {
  std::uint64_t hash = 1469598103934665603ULL;
  std::uint64_t side_records = 0;  ///< those without room too
  Status status = Status::ok;
  DecoderStats stats;
  DecodeError error;

  void add(const Event& event) {
    const std::uint64_t place = static_cast<std::uint64_t>(event.x) << 24U | static_cast<std::uint64_t>(event.y) << 8U;
    for (const std::uint64_t value : {static_cast<std::uint64_t>(event.t_us), place | event.polarity}) {
      hash = (hash ^ value) * 1099511628211ULL;
    }
  }
};

/// Decodes in pieces whose sizes and rooms for events come from `seed`; 0: in one piece.
template <class Decoder>
Digest decode(Decoder decoder, Span<const std::uint8_t> stream, std::uint32_t seed) {
  Digest digest;
  std::vector<Event> out(64);
  TriggerEvent triggers[4];
  ImuSample imu_samples[2];
  const auto draw = [&](std::size_t largest) {
    seed = seed * 1664525U + 1013904223U;
    return 1 + (seed >> 8U) % largest;
  };
  const bool whole = seed == 0;
  bool is_over = false;
  while (!is_over) {
    Span<const std::uint8_t> piece = stream.first(whole ? stream.size() : draw(9));
    stream = stream.subspan(piece.size());
    is_over = piece.empty();
    std::size_t count = 0;
    do {
      const Span<Event> room = Span<Event>(out).first(whole ? out.size() : draw(14));
      SideRecords side{FixedVector<TriggerEvent>(triggers), FixedVector<ImuSample>(imu_samples)};
      digest.status = is_over ? decoder.finish(room, &count, &side) : decoder.decode(&piece, room, &count, &side);
      if (count > room.size()) std::abort();
      for (const Event& event : room.first(count)) digest.add(event);
      digest.side_records += side.triggers.size() + side.triggers.dropped();
      digest.side_records += side.imu_samples.size() + side.imu_samples.dropped();
    } while (digest.status == Status::ok && count > 0);
    if (is_error(digest.status)) break;
    if (!piece.empty()) std::abort();
  }
  digest.stats = decoder.stats();
  if (digest.side_records != digest.stats.triggers + digest.stats.imu_samples) std::abort();
  digest.error = decoder.error();
  return digest;
}

/// Stops the program unless the stream says the same in one piece and in many.
template <class Decoder>
void check_splits(const Decoder& decoder, const std::uint8_t* data, std::size_t size) {
  const Span<const std::uint8_t> stream(data, size);
  const Digest whole = decode(decoder, stream, 0);
  const Digest split = decode(decoder, stream, 1 + static_cast<std::uint32_t>(size));
  const bool same_error = whole.status == split.status && whole.error.offset == split.error.offset &&
                          whole.error.line == split.error.line &&
                          std::strcmp(whole.error.expected, split.error.expected) == 0;
  const bool same_stats = std::memcmp(&whole.stats, &split.stats, sizeof whole.stats) == 0;
  if (whole.hash != split.hash || !same_error || !same_stats) std::abort();
}

}  // namespace lecalib::fuzz
