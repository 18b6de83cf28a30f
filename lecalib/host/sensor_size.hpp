// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string_view>

#include "lecalib/host/error.hpp"

namespace lecalib::host {

struct SensorSize {
  std::uint16_t width = 0;
  std::uint16_t height = 0;
};

/// "640x480", 1 to 16384 each.
Result<SensorSize> parse_sensor(std::string_view text);

/// "640x480".
std::string to_string(const SensorSize& size);

}  // namespace lecalib::host
