// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "lecalib/core/records.hpp"
#include "lecalib/host/sensor_size.hpp"

namespace lecalib::host {

/// A picture of one window: its events as pixels (ON grey, OFF red; those of a line in a colour of its own, so that the
/// planes which the lines sweep show), the lines found at the window's begin (blue) and end (yellow) with their bend,
/// and a caption. Coordinates are the sensor's, whose size bounds the picture's.
/// @param caption plain text below the picture; is escaped here.
std::string draw_window(const EventWindow& events, const LineWindow& lines, const SensorSize& sensor,
                        const std::string& caption);

}  // namespace lecalib::host
