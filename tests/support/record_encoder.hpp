// SPDX-License-Identifier: MIT
/// Writers of EVT2.1, DAT, AEDAT 2 and Event Stream that share nothing with the decoders under test.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "lecalib/core/records.hpp"
#include "support/evt_encoder.hpp"

namespace lecalib::test {

/// The lowest `count` bytes of `value`, least significant first.
inline Bytes little_endian(std::uint64_t value, int count) {
  Bytes bytes;
  for (int i = 0; i < count; ++i, value /= 256) bytes.push_back(static_cast<std::uint8_t>(value % 256));
  return bytes;
}

inline Bytes big_endian(std::uint64_t value, int count) {
  const Bytes little = little_endian(value, count);
  return {little.rbegin(), little.rend()};
}

/// A word of EVT2.1: type, 28 bits of content, 32 bits of vector.
struct Word64 {
  unsigned type;
  std::uint32_t content;
  std::uint32_t vector;
};

inline Bytes evt21_bytes(const std::vector<Word64>& words, bool legacy = false) {
  Bytes bytes;
  for (const Word64& word : words) {
    const Bytes upper = little_endian(word.type * 268435456ULL + word.content, 4);
    const Bytes lower = little_endian(word.vector, 4);
    bytes = std::move(bytes) + (legacy ? upper + lower : lower + upper);
  }
  return bytes;
}

/// A TIME_HIGH whenever it changes; events of one row, time and polarity within 32 columns share a word.
inline Bytes encode_evt21(const std::vector<Event>& events, bool legacy = false) {
  std::vector<Word64> words;
  std::int64_t high = -1;
  for (std::size_t i = 0; i < events.size();) {
    const Event& first = events[i];
    if (first.t_us / 64 != high) {
      high = first.t_us / 64;
      words.push_back({8, static_cast<std::uint32_t>(high % (1 << 28)), 0});
    }
    const int base = first.x / 32 * 32;
    std::uint32_t vector = 0;
    int last_x = -1;
    for (; i < events.size(); ++i) {
      const Event& e = events[i];
      const bool is_same = e.t_us == first.t_us && e.y == first.y && e.polarity == first.polarity;
      if (!is_same || e.x <= last_x || e.x / 32 * 32 != base) break;
      last_x = e.x;
      vector += 1U << static_cast<unsigned>(e.x - base);
    }
    const auto low = static_cast<std::uint32_t>(first.t_us % 64);
    words.push_back({first.polarity, low * 4194304 + static_cast<std::uint32_t>(base) * 2048 + first.y, vector});
  }
  return evt21_bytes(words, legacy);
}

/// Records of DAT version 2, or those of version 1.
inline Bytes encode_dat(const std::vector<Event>& events, int version = 2) {
  Bytes bytes;
  for (const Event& e : events) {
    const std::uint64_t address =
        version < 2 ? e.x + e.y * 512ULL + e.polarity * 131072ULL : e.x + e.y * 16384ULL + e.polarity * 268435456ULL;
    bytes = std::move(bytes) + little_endian(static_cast<std::uint64_t>(e.t_us), 4) + little_endian(address, 4);
  }
  return bytes;
}

/// Records of a DAT file of triggers.
inline Bytes encode_dat_triggers(const std::vector<TriggerEvent>& triggers) {
  Bytes bytes;
  for (const TriggerEvent& trigger : triggers) {
    const std::uint64_t word = trigger.channel * 67108864ULL + (trigger.kind == TriggerKind::rising ? 1 : 0);
    bytes = std::move(bytes) + little_endian(static_cast<std::uint64_t>(trigger.t_us), 4) + little_endian(word, 4);
  }
  return bytes;
}

inline Bytes aedat2_record(std::uint64_t address, std::int64_t t_us) {
  return big_endian(address, 4) + big_endian(static_cast<std::uint64_t>(t_us), 4);
}

/// The seven records of an IMU sample: acceleration x y z, temperature, rotation x y z.
inline Bytes aedat2_imu(std::int64_t t_us, const std::vector<int>& readings) {
  Bytes bytes;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const auto data = static_cast<std::uint64_t>((readings[i] + 65536) % 65536);
    bytes = std::move(bytes) + aedat2_record(0x80000C00 + i * 0x10000000 + data * 4096, t_us);
  }
  return bytes;
}

/// Records of a DAVIS of that size.
inline Bytes encode_davis(const std::vector<Event>& events, int width, int height) {
  Bytes bytes;
  for (const Event& e : events) {
    const auto column = static_cast<std::uint64_t>(width - 1 - e.x);
    const auto row = static_cast<std::uint64_t>(height - 1 - e.y);
    bytes = std::move(bytes) + aedat2_record(row * 4194304 + column * 4096 + e.polarity * 2048ULL, e.t_us);
  }
  return bytes;
}

inline Bytes encode_dvs128(const std::vector<Event>& events) {
  Bytes bytes;
  for (const Event& e : events) {
    const auto address = static_cast<std::uint64_t>((127 - e.y) * 256 + (127 - e.x) * 2 + (1 - e.polarity));
    bytes = std::move(bytes) + aedat2_record(address, e.t_us);
  }
  return bytes;
}

/// The 20 bytes before the events.
inline Bytes es_header(int content, int width, int height, int version = 2) {
  const Bytes numbers = {static_cast<std::uint8_t>(version), 0, 0, static_cast<std::uint8_t>(content)};
  return to_bytes("Event Stream") + numbers + little_endian(static_cast<std::uint64_t>(width), 2) +
         little_endian(static_cast<std::uint64_t>(height), 2);
}

inline Bytes encode_es(const std::vector<Event>& events, int height) {
  Bytes bytes;
  std::int64_t t_us = 0;
  for (const Event& e : events) {
    for (; e.t_us - t_us >= 127; t_us += 127) bytes.push_back(255);
    bytes.push_back(static_cast<std::uint8_t>((e.t_us - t_us) * 2 + e.polarity));
    bytes = std::move(bytes) + little_endian(e.x, 2) + little_endian(static_cast<std::uint64_t>(height - 1 - e.y), 2);
    t_us = e.t_us;
  }
  return bytes;
}

}  // namespace lecalib::test
