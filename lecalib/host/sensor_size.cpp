// SPDX-License-Identifier: MIT
#include "lecalib/host/sensor_size.hpp"

#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

/// Of files that are read, counted or converted, all of which larger sensors than the calibrator's (kMaxSensorSide) can
/// do: DAT has 14 bits for a coordinate.
constexpr unsigned long long kMaxFileSensorSide = 16384;

}  // namespace

Result<SensorSize> parse_sensor(std::string_view text) {
  const std::vector<Field> fields = split(text, 'x');
  if (fields.size() == 2) {
    const auto width = parse_count(fields[0].text);
    const auto height = parse_count(fields[1].text);
    if (width && height && *width >= 1 && *height >= 1 && *width <= kMaxFileSensorSide &&
        *height <= kMaxFileSensorSide) {
      return SensorSize{static_cast<std::uint16_t>(*width), static_cast<std::uint16_t>(*height)};
    }
  }
  return Error{"sensor size " + quoted(text) + ": expected WxH in pixels, as in 640x480",
               "",
               0,
               0,
               std::nullopt,
               Status::invalid_argument};
}

std::string to_string(const SensorSize& size) { return std::to_string(size.width) + "x" + std::to_string(size.height); }

}  // namespace lecalib::host
