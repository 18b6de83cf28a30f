// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "lecalib/core/records.hpp"
#include "lecalib/host/error.hpp"

namespace lecalib::host {

/// Largest width and height that EVT3's addresses can express.
inline constexpr std::uint16_t kMaxEvt3Side = 2048;

/// The bytes of a Prophesee RAW file: text header and EVT3 words.
///
/// EVT3 keeps 24 bits of the time, 16.8 s: a reader takes the first time as it is, modulo 2^24, and counts roll-overs
/// from there. Every 4096 us get their time word, with or without events, so no gap hides a roll-over.
/// @param events in order of time, times >= 0, inside of the sensor
/// @return the file's content, or an error that names the first event that cannot be written
Result<std::string> encode_evt3(Span<const Event> events, std::uint16_t width, std::uint16_t height);

}  // namespace lecalib::host
