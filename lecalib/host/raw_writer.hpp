// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "lecalib/core/records.hpp"
#include "lecalib/host/error.hpp"

namespace lecalib::host {

/// Largest width and height that EVT3's addresses can express.
inline constexpr std::uint16_t kMaxEvt3Side = 2048;

/// The text header of a Prophesee RAW file with EVT3 words. @param more further keys and their values
std::string evt3_header(std::uint16_t width, std::uint16_t height, std::map<std::string, std::string> more = {});

/// Makes a Prophesee RAW file piece by piece: text header and EVT3 words.
///
/// EVT3 keeps 24 bits of the time, 16.8 s: a reader takes the first time as it is, modulo 2^24, and counts roll-overs
/// from there. Every 4096 us get their time word, with or without events, so no gap hides a roll-over.
class Evt3Encoder {
 public:
  /// @param width, height  of the sensor, 1 to kMaxEvt3Side each
  Evt3Encoder(std::uint16_t width, std::uint16_t height) : width_(width), height_(height) {}

  /// Appends the header. @return an error when the size cannot be written.
  MaybeError begin(std::string* bytes) const;
  /// Appends the words of further events, or nothing when one of them cannot be written.
  /// @param events inside of the sensor, times >= 0; a time may lie up to 4 s before the one before it, as sensors do
  /// it by microseconds, and up to an hour after it
  /// @return an error that names the first event that cannot be written, counted from the first one of all
  MaybeError append(Span<const Event> events, std::string* bytes);

 private:
  [[nodiscard]] MaybeError check(Span<const Event> events) const;
  void put_time(std::int64_t t_us, std::string* bytes);

  std::uint16_t width_, height_;
  std::uint64_t count_ = 0;   ///< events so far
  std::int64_t last_us_ = 0;  ///< time of the last one
  std::int64_t time_high_ = -1, time_low_ = -1;
  int row_ = -1;
};

/// The bytes of a whole file. @return the content, or an error that names the first event that cannot be written
Result<std::string> encode_evt3(Span<const Event> events, std::uint16_t width, std::uint16_t height);

}  // namespace lecalib::host
