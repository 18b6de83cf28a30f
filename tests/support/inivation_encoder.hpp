// SPDX-License-Identifier: MIT
/// A writer of what DAVIS346 and DVXplorer send over USB, which shares nothing with the decoders under test.
#pragma once

#include <utility>
#include <vector>

#include "support/record_encoder.hpp"

namespace lecalib::test {

/// A word with a code and 12 bits of data.
inline Bytes usb_word(unsigned code, unsigned data) { return little_endian(code * 4096ULL + data, 2); }

/// Words that lead from one time to a later one: how often 32768 us passed, 4095 at a time, and the rest.
inline Bytes usb_time(std::int64_t from_us, std::int64_t to_us) {
  Bytes bytes;
  for (std::int64_t wraps = to_us / 32768 - from_us / 32768; wraps > 0; wraps -= 4095) {
    bytes = std::move(bytes) + usb_word(7, static_cast<unsigned>(std::min<std::int64_t>(wraps, 4095)));
  }
  return bytes + little_endian(static_cast<std::uint64_t>(32768 + to_us % 32768), 2);
}

/// Row words where the row changes; times from 0 on.
inline Bytes encode_davis_usb(const std::vector<Event>& events) {
  Bytes bytes = usb_time(0, 0);
  std::int64_t t_us = 0;
  int row = -1;
  for (const Event& e : events) {
    if (e.t_us != t_us) bytes = std::move(bytes) + usb_time(t_us, e.t_us);
    if (e.y != row) bytes = std::move(bytes) + usb_word(1, e.y);
    bytes = std::move(bytes) + usb_word(e.polarity != 0 ? 3 : 2, e.x);
    t_us = e.t_us;
    row = e.y;
  }
  return bytes;
}

/// Every event alone in a group, by turns as group 1 and as group 2 behind or before another one.
inline Bytes encode_dvxplorer_usb(const std::vector<Event>& events) {
  Bytes bytes = usb_time(0, 0);
  std::int64_t t_us = 0;
  int column = -1;
  for (std::size_t i = 0; i < events.size(); ++i) {
    const Event& e = events[i];
    if (e.t_us != t_us) bytes = std::move(bytes) + usb_time(t_us, e.t_us);
    if (e.x != column) bytes = std::move(bytes) + usb_word(1, e.x + (i % 5 == 0 ? 2048U : 0U));
    const unsigned group = e.y / 8U;
    const unsigned pixels = (1U << e.y % 8U) + (e.polarity == 0 ? 256U : 0U);
    if (i % 3 == 0) {
      bytes = std::move(bytes) + usb_word(4, group) + usb_word(3, pixels);
    } else if (i % 3 == 1 && group >= 3) {
      bytes = std::move(bytes) + usb_word(4, group - 3 + 3 * 64) + usb_word(2, pixels);
    } else {
      bytes = std::move(bytes) + usb_word(4, group + 2 + 2 * 64 + 2048) + usb_word(2, pixels);
    }
    t_us = e.t_us;
    column = e.x;
  }
  return bytes;
}

/// The words of an IMU sample; `format` tells which of the readings there are, and their ranges.
inline Bytes usb_imu(unsigned format, const std::vector<int>& readings) {
  Bytes bytes = usb_word(0, 5) + usb_word(5, 3 * 256 + format);
  for (const int reading : readings) {
    const auto value = static_cast<unsigned>((reading + 65536) % 65536);
    bytes = std::move(bytes) + usb_word(5, value / 256) + usb_word(5, value % 256);
  }
  return bytes + usb_word(0, 7);
}

/// A frame of two columns of three rows, read twice, with the words around it.
inline Bytes usb_frame() {
  Bytes bytes = usb_word(0, 8) + usb_word(5, 1 * 256 + 1) + usb_word(5, 2 * 256 + 90) + usb_word(0, 14) +
                usb_word(6, 100) + usb_word(0, 15);
  for (const unsigned column : {11U, 12U, 11U, 12U}) {
    bytes = std::move(bytes) + usb_word(0, column) + usb_word(4, 700) + usb_word(4, 701) + usb_word(4, 702) +
            usb_word(0, 13);
  }
  return bytes + usb_word(0, 10);
}
constexpr std::uint64_t kUsbFrameWords = 6 + 4 * 5 + 1;

}  // namespace lecalib::test
