// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>

#include "lecalib/events/decoder.hpp"

namespace lecalib::usb {

/// The header of a recording that begins now: EVT3, with the date. It has an even number of bytes, so that words do not
/// lie across pages of a file. @param more further keys and their values
std::string recording_header(SensorSize sensor, std::map<std::string, std::string> more);

}  // namespace lecalib::usb
