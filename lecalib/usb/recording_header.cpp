// SPDX-License-Identifier: MIT
#include "lecalib/usb/recording_header.hpp"

#include <ctime>
#include <utility>

#include "lecalib/host/raw_writer.hpp"

namespace lecalib::usb {

std::string recording_header(SensorSize sensor, std::map<std::string, std::string> more) {
  char date[40];
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  std::strftime(date, sizeof date, "%F %T", ::gmtime_r(&now, &utc));
  more["date"] = date;
  std::string header = host::evt3_header(sensor.width, sensor.height, more);
  if (header.size() % 2 == 0) return header;
  more["date"] += "Z";  // the same time in one byte more
  return host::evt3_header(sensor.width, sensor.height, std::move(more));
}

}  // namespace lecalib::usb
