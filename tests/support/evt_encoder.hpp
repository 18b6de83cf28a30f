// SPDX-License-Identifier: MIT
/// Writers of EVT2 and EVT3 words that share nothing with the decoders under test.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lecalib/core/records.hpp"

namespace lecalib::test {

using Bytes = std::vector<std::uint8_t>;

inline Bytes to_bytes(const std::string& text) { return {text.begin(), text.end()}; }

inline Bytes operator+(Bytes left, const Bytes& right) {
  left.insert(left.end(), right.begin(), right.end());
  return left;
}

/// 4 bits of type above the content.
struct Word {
  unsigned type;
  std::uint32_t content;
};

inline Bytes evt3_bytes(const std::vector<Word>& words) {
  Bytes bytes;
  for (const Word& word : words) {
    bytes.push_back(static_cast<std::uint8_t>(word.content));
    bytes.push_back(static_cast<std::uint8_t>(word.type * 16 + word.content / 256));
  }
  return bytes;
}

inline Bytes evt2_bytes(const std::vector<Word>& words) {
  Bytes bytes;
  for (const Word& word : words) {
    bytes.push_back(static_cast<std::uint8_t>(word.content));
    bytes.push_back(static_cast<std::uint8_t>(word.content / 256));
    bytes.push_back(static_cast<std::uint8_t>(word.content / 65536));
    bytes.push_back(static_cast<std::uint8_t>(word.type * 16 + word.content / 16777216));
  }
  return bytes;
}

/// The six words of an IMU sample of EVT2, all with these lower bits of time: acceleration x y z, rotation x y z.
inline std::vector<Word> evt2_imu(std::uint32_t low, const std::vector<int>& readings) {
  std::vector<Word> words;
  for (const int reading : readings) {
    const auto value = static_cast<std::uint32_t>((reading + 65536) % 65536);
    words.push_back({words.empty() ? 13U : 15U, low * 4194304U + value * 2U});
  }
  return words;
}

/// A TIME_HIGH whenever it changes, then a word for each event.
inline Bytes encode_evt2(const std::vector<Event>& events) {
  std::vector<Word> words;
  std::int64_t high = -1;
  for (const Event& event : events) {
    if (event.t_us / 64 != high) {
      high = event.t_us / 64;
      words.push_back({8, static_cast<std::uint32_t>(high % (1 << 28))});
    }
    const auto low = static_cast<std::uint32_t>(event.t_us % 64);
    words.push_back({event.polarity, low << 22U | static_cast<std::uint32_t>(event.x << 11) | event.y});
  }
  return evt2_bytes(words);
}

/// TIME_HIGH with every new 16 us, and four times per roll-over in longer gaps (sensors send it every 16 us); vectors
/// where neighbours of a row fire together, 12 wide where they span more than 8 pixels.
inline Bytes encode_evt3(const std::vector<Event>& events) {
  std::vector<Word> words;
  std::int64_t t_us = -16;
  int row = -1;
  for (std::size_t i = 0; i < events.size();) {
    const Event& first = events[i];
    constexpr std::int64_t kQuarter = 1 << 22;
    while (i > 0 && first.t_us - t_us > kQuarter) {
      t_us += kQuarter;
      words.push_back({8, static_cast<std::uint32_t>(t_us / 4096 % 4096)});
    }
    if (first.t_us / 16 != t_us / 16) words.push_back({8, static_cast<std::uint32_t>(first.t_us / 4096 % 4096)});
    if (first.t_us != t_us) words.push_back({6, static_cast<unsigned>(first.t_us % 4096)});
    t_us = first.t_us;
    if (first.y != row) words.push_back({0, first.y});
    row = first.y;
    unsigned bits = 1;
    std::size_t next = i + 1;
    for (; next < events.size(); ++next) {
      const Event& other = events[next];
      const bool is_same = other.t_us == first.t_us && other.y == first.y && other.polarity == first.polarity;
      if (!is_same || other.x <= events[next - 1].x || other.x >= first.x + 12) break;
      bits |= 1U << static_cast<unsigned>(other.x - first.x);
    }
    const unsigned x_and_polarity = first.x + (first.polarity != 0 ? 2048U : 0U);
    if (next == i + 1) {
      words.push_back({2, x_and_polarity});
    } else {
      words.push_back({3, x_and_polarity});
      words.push_back({bits < 256 ? 5U : 4U, bits});
    }
    i = next;
  }
  return evt3_bytes(words);
}

}  // namespace lecalib::test
