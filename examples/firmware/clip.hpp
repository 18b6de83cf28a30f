// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "lecalib/core/span.hpp"

/// The recording that lies beside the program in flash: EVT3 with its header, of a 320 x 320 sensor. On a product these
/// bytes come from the sensor.
lecalib::Span<const std::uint8_t> clip();
