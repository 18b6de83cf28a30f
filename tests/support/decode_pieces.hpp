// SPDX-License-Identifier: MIT
#pragma once

#include <doctest/doctest.h>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "lecalib/core/span.hpp"
#include "lecalib/events/decoder.hpp"
#include "support/evt_encoder.hpp"

namespace lecalib {
inline bool operator==(const Event& a, const Event& b) {
  return a.t_us == b.t_us && a.x == b.x && a.y == b.y && a.polarity == b.polarity;
}
inline bool operator==(const TriggerEvent& a, const TriggerEvent& b) {
  return a.t_us == b.t_us && a.channel == b.channel && a.kind == b.kind;
}
/// Bit by bit: NaN is the same as NaN.
inline bool operator==(const ImuSample& a, const ImuSample& b) {
  return a.t_us == b.t_us && std::memcmp(a.gyro_rad_s, b.gyro_rad_s, sizeof a.gyro_rad_s) == 0 &&
         std::memcmp(a.accel_m_s2, b.accel_m_s2, sizeof a.accel_m_s2) == 0 &&
         std::memcmp(&a.temperature_c, &b.temperature_c, sizeof a.temperature_c) == 0;
}
}  // namespace lecalib

namespace lecalib::test {

/// All that a decoder says about a stream.
struct Decoded {
  std::vector<Event> events;
  std::vector<TriggerEvent> triggers;
  std::vector<ImuSample> imu_samples;
  Status status = Status::ok;
  DecoderStats stats;
  std::string expected;
  std::uint64_t error_offset = 0;
  std::uint64_t error_line = 0;
};

inline bool operator==(const Decoded& a, const Decoded& b) {
  return a.events == b.events && a.triggers == b.triggers && a.imu_samples == b.imu_samples && a.status == b.status &&
         a.stats.events == b.stats.events && a.stats.outside == b.stats.outside &&
         a.stats.unplaced == b.stats.unplaced && a.stats.triggers == b.stats.triggers &&
         a.stats.imu_samples == b.stats.imu_samples && a.stats.other_words == b.stats.other_words &&
         a.stats.undefined_words == b.stats.undefined_words && a.stats.time_wraps == b.stats.time_wraps &&
         a.stats.time_resets == b.stats.time_resets && a.stats.time_steps_back == b.stats.time_steps_back &&
         a.expected == b.expected && a.error_offset == b.error_offset && a.error_line == b.error_line;
}

/// Gives `pieces` to the decoder one after the other, then calls finish(); `room` events at a time are taken.
template <class Decoder>
Decoded decode_pieces(Decoder decoder, const std::vector<Span<const std::uint8_t>>& pieces, std::size_t room = 1000) {
  Decoded result;
  std::vector<Event> out(room);
  std::vector<TriggerEvent> triggers(1 << 14);
  std::vector<ImuSample> imu_samples(1000);
  SideRecords side{FixedVector<TriggerEvent>(triggers), FixedVector<ImuSample>(imu_samples)};
  const auto drain = [&](auto&& call) {
    std::size_t count = 0;
    do {
      result.status = call(&count);
      result.events.insert(result.events.end(), out.begin(), out.begin() + static_cast<std::ptrdiff_t>(count));
    } while (result.status == Status::ok && count > 0);
  };
  for (Span<const std::uint8_t> piece : pieces) {
    drain([&](std::size_t* count) { return decoder.decode(&piece, out, count, &side); });
    if (is_error(result.status)) break;
    CHECK(piece.empty());
  }
  if (!is_error(result.status)) {
    drain([&](std::size_t* count) { return decoder.finish(out, count, &side); });
  }
  result.triggers.assign(side.triggers.begin(), side.triggers.end());
  result.imu_samples.assign(side.imu_samples.begin(), side.imu_samples.end());
  CHECK(side.triggers.dropped() + side.imu_samples.dropped() == 0);
  result.stats = decoder.stats();
  result.expected = decoder.error().expected;
  result.error_offset = decoder.error().offset;
  result.error_line = decoder.error().line;
  return result;
}

template <class Decoder>
Decoded decode_whole(Decoder decoder, const Bytes& bytes, std::size_t room = 1000) {
  return decode_pieces(decoder, {Span<const std::uint8_t>(bytes)}, room);
}

/// Cuts `bytes` in two at every byte, and into single bytes; every way must say the same as one piece.
template <class Decoder>
void check_every_split(Decoder decoder, const Bytes& bytes) {
  const Decoded whole = decode_whole(decoder, bytes);
  const Span<const std::uint8_t> all(bytes);
  for (std::size_t cut = 0; cut <= bytes.size(); ++cut) {
    const bool is_same = decode_pieces(decoder, {all.first(cut), all.subspan(cut)}, 1 + cut % 7) == whole;
    CHECK_MESSAGE(is_same, "cut at byte ", cut);
  }
  std::vector<Span<const std::uint8_t>> single_bytes;
  for (std::size_t i = 0; i < bytes.size(); ++i) single_bytes.push_back(all.subspan(i, 1));
  CHECK(decode_pieces(decoder, single_bytes, 1) == whole);
}

template <class Path>
Bytes read_bytes(const Path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace lecalib::test
