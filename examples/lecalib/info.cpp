// SPDX-License-Identifier: MIT
/// lecalib info: what a recording holds.
#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "commands.hpp"
#include "event_options.hpp"
#include "lecalib/core/time.hpp"
#include "lecalib/host/event_file.hpp"
#include "lecalib/host/json_writer.hpp"
#include "progress.hpp"

namespace lecalib::command {
namespace {

using host::EventFile;
using host::JsonWriter;

constexpr double kUsPerSecond = 1e6;

struct InfoOptions {
  std::string events;
  std::string sensor;
  bool json = false;
};

/// What a pass over all events shows.
struct Summary {
  std::uint64_t events = 0;
  std::uint64_t on = 0;
  std::int64_t first_us = 0;
  std::int64_t last_us = 0;
  std::uint16_t max_x = 0;
  std::uint16_t max_y = 0;

  void add(const Event& event) {
    first_us = events == 0 ? event.t_us : std::min(first_us, event.t_us);
    last_us = events == 0 ? event.t_us : std::max(last_us, event.t_us);
    max_x = std::max(max_x, event.x);
    max_y = std::max(max_y, event.y);
    on += event.polarity;
    ++events;
  }
  [[nodiscard]] double duration_s() const { return static_cast<double>(distance_us(first_us, last_us)) / kUsPerSecond; }
  [[nodiscard]] double rate() const { return duration_s() > 0 ? static_cast<double>(events) / duration_s() : 0; }
  [[nodiscard]] double on_share() const {
    return events > 0 ? static_cast<double>(on) / static_cast<double>(events) : 0;
  }
};

/// From when to when something came.
struct TimeRange {
  std::int64_t first_us = 0;
  std::int64_t last_us = 0;
  bool is_empty = true;

  void add(std::int64_t t_us) {
    first_us = is_empty ? t_us : std::min(first_us, t_us);
    last_us = is_empty ? t_us : std::max(last_us, t_us);
    is_empty = false;
  }
};

/// What came beside events.
struct Side {
  TimeRange triggers, imu_samples;

  void add(const EventFile& file) {
    for (const TriggerEvent& trigger : file.triggers()) triggers.add(trigger.t_us);
    for (const ImuSample& sample : file.imu_samples()) imu_samples.add(sample.t_us);
  }
};

struct Counter {
  const char* name;
  std::uint64_t value;
  const char* meaning;
};

std::vector<Counter> counters(const DecoderStats& stats) {
  return {{"outside", stats.outside, "events beside the sensor, dropped"},
          {"unplaced", stats.unplaced, "events before the first time stamp or row, dropped"},
          {"triggers", stats.triggers, "signals at inputs, or of the camera itself"},
          {"imu_samples", stats.imu_samples, "measurements of the inertial sensor"},
          {"other_words", stats.other_words, "words that are no events (frames, ...)"},
          {"undefined_words", stats.undefined_words, "words the format does not define"},
          {"time_wraps", stats.time_wraps, "roll-overs of the sensor's clock"},
          {"time_resets", stats.time_resets, "new beginnings of the sensor's clock"},
          {"time_steps_back", stats.time_steps_back, "times earlier than the one before"}};
}

const char* sensor_source(const EventFile& file, const InfoOptions& options) {
  if (!is_known(file.sensor())) return "nothing";
  if (file.sensor_is_guess()) return "largest coordinates";
  return options.sensor.empty() ? "the file" : "--sensor";
}

void print_range(const char* name, const TimeRange& range) {
  if (range.is_empty) return;
  std::printf("%-9s %.6f to %.6f s\n", name, static_cast<double>(range.first_us) / kUsPerSecond,
              static_cast<double>(range.last_us) / kUsPerSecond);
}

void print_events(const Summary& summary) {
  std::printf("time      %.6f to %.6f s (%.6f s)\n", static_cast<double>(summary.first_us) / kUsPerSecond,
              static_cast<double>(summary.last_us) / kUsPerSecond, summary.duration_s());
  std::printf("rate      %.4g events/s\n", summary.rate());
  std::printf("ON        %.1f %%\n", 100 * summary.on_share());
  std::printf("largest   x %u, y %u\n", summary.max_x, summary.max_y);
}

void print_text(const EventFile& file, const Summary& summary, const Side& side, const InfoOptions& options) {
  std::printf("file      %s\n", file.path().c_str());
  std::printf("format    %s\n", file.format_name());
  if (is_known(file.sensor())) {
    std::printf("sensor    %s px (from %s)\n", host::to_string(file.sensor()).c_str(), sensor_source(file, options));
  }
  std::printf("events    %" PRIu64 "\n", summary.events);
  if (summary.events > 0) print_events(summary);
  print_range("triggers", side.triggers);
  print_range("IMU", side.imu_samples);
  for (const Counter& counter : counters(file.stats())) {
    if (counter.value > 0) std::printf("%-15s %" PRIu64 " (%s)\n", counter.name, counter.value, counter.meaning);
  }
}

void add_range(const char* name, const TimeRange& range, JsonWriter* json) {
  if (range.is_empty) return;
  json->key(name);
  json->begin_object();
  json->member("first_us", range.first_us);
  json->member("last_us", range.last_us);
  json->end();
}

void print_json(const EventFile& file, const Summary& summary, const Side& side, const InfoOptions& options) {
  JsonWriter json;
  json.begin_object();
  json.member("file", file.path());
  json.member("format", file.format_name());
  json.member("width", file.sensor().width);
  json.member("height", file.sensor().height);
  json.member("sensor_from", sensor_source(file, options));
  json.member("events", summary.events);
  json.member("first_us", summary.first_us);
  json.member("last_us", summary.last_us);
  json.member("events_per_s", summary.rate());
  json.member("on_share", summary.on_share());
  json.member("max_x", summary.max_x);
  json.member("max_y", summary.max_y);
  add_range("triggers", side.triggers, &json);
  add_range("imu", side.imu_samples, &json);
  json.key("decoder");
  json.begin_object();
  for (const Counter& counter : counters(file.stats())) json.member(counter.name, counter.value);
  json.end();
  json.end();
  std::fputs(json.text().c_str(), stdout);
}

void run_info(const InfoOptions& options) {
  EventFile file = take(EventFile::open(options.events, sensor_size(options.sensor), EventFile::Needs::anything));
  Summary summary;
  Side side;
  Progress progress("reading");
  while (true) {
    const Span<const Event> events = take(file.read());
    side.add(file);
    if (events.empty()) break;
    for (const Event& event : events) summary.add(event);
    progress.update(file.fraction_read());
  }
  (options.json ? print_json : print_text)(file, summary, side, options);
}

}  // namespace

void add_info(CLI::App& app) {
  CLI::App* command = app.add_subcommand("info", "Say what a recording holds");
  const auto options = std::make_shared<InfoOptions>();
  add_events_option(command, &options->events);
  add_sensor_option(command, &options->sensor);
  command->add_flag("--json", options->json, "Print JSON");
  command->callback([options] { run_info(*options); });
}

}  // namespace lecalib::command
