// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

#include "lecalib/events/decoder.hpp"
#include "lecalib/host/error.hpp"

namespace lecalib::host {

/// "640x480", 1 to 16384 each.
Result<SensorSize> parse_sensor(std::string_view text);

/// "640x480".
std::string to_string(const SensorSize& size);

}  // namespace lecalib::host
