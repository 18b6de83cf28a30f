// SPDX-License-Identifier: MIT
#include "event_options.hpp"

#include <algorithm>
#include <cstdio>

#include "lecalib/planes/cloud.hpp"

namespace lecalib::command {
namespace {

constexpr std::uint16_t kMinSensorSide = 2;
static_assert(kMaxSensorSide == 4096, "the message in open_events() names it");

}  // namespace

void add_events_option(CLI::App* command, std::string* events) {
  command->add_option("EVENTS", *events, "Recording: RAW, DAT, AEDAT 2 or 4, Event Stream or text (t x y p)")
      ->required()
      ->type_name("");
}

void add_sensor_option(CLI::App* command, std::string* sensor) {
  command
      ->add_option("--sensor", *sensor,
                   "Size of the sensor, px, as in 640x480; needed when the input does not state it")
      ->type_name("WxH");
}

SensorSize sensor_size(const std::string& sensor) {
  return sensor.empty() ? SensorSize{} : take(host::parse_sensor(sensor));
}

host::EventFile open_events(const std::string& path, const std::string& sensor) {
  host::EventFile file = take(host::EventFile::open(path, sensor_size(sensor)));
  const SensorSize size = file.sensor();
  if (std::min(size.width, size.height) < kMinSensorSide || std::max(size.width, size.height) > kMaxSensorSide) {
    fail({"lines are found on sensors of 2x2 to 4096x4096 px, this one has " + host::to_string(size), path});
  }
  if (file.sensor_is_guess()) {
    std::fprintf(stderr, "lecalib: %s does not state the sensor's size, its events suggest %s (--sensor sets it)\n",
                 path.c_str(), host::to_string(file.sensor()).c_str());
  }
  return file;
}

}  // namespace lecalib::command
