// SPDX-License-Identifier: MIT
/// lecalib convert: a recording in another format.
#include <cinttypes>
#include <cstdio>
#include <iterator>
#include <memory>
#include <optional>
#include <string>

#include "commands.hpp"
#include "event_options.hpp"
#include "lecalib/host/event_writer.hpp"
#include "lecalib/host/side_writer.hpp"
#include "progress.hpp"

namespace lecalib::command {
namespace {

using host::OutputFormat;

struct ConvertOptions {
  std::string events, out, format, sensor;
  std::string imu, triggers;  ///< files; empty: not wanted
};

OutputFormat output_format(const ConvertOptions& options) {
  const auto format =
      options.format.empty() ? host::output_format_of_path(options.out) : host::output_format_named(options.format);
  if (!format) fail({"the name tells no format: end it in .raw (EVT3) or .csv, or give --format", options.out});
  return *format;
}

/// Every file is another one: a mistake must not cost the recording.
void check_names(const ConvertOptions& options) {
  const std::string names[] = {options.events, options.out, options.imu, options.triggers};
  for (std::size_t i = 1; i < std::size(names); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (names[i].empty() || names[k].empty() || !host::is_same_file(names[k], names[i])) continue;
      fail({k == 0 ? "is the recording itself, expected another file to write" : "is written twice", names[i]});
    }
  }
}

void report_side(const ConvertOptions& options, const host::SideWriter& side, std::uint64_t dropped, std::FILE* to) {
  if (!options.imu.empty()) {
    std::fprintf(to, "%" PRIu64 " IMU samples written to %s\n", side.imu_samples(), options.imu.c_str());
  }
  if (side.imu_samples_left_out() > 0) {
    std::fprintf(to, "%" PRIu64 " IMU samples left out, no later than the one before\n", side.imu_samples_left_out());
  }
  if (!options.triggers.empty()) {
    std::fprintf(to, "%" PRIu64 " triggers written to %s\n", side.triggers(), options.triggers.c_str());
  }
  const bool is_wanted = !options.imu.empty() || !options.triggers.empty();
  if (is_wanted && dropped > 0) {
    std::fprintf(to, "%" PRIu64 " IMU samples or triggers left out: too many at once\n", dropped);
  }
}

/// What a reader of the new file has to know.
void report(const ConvertOptions& options, OutputFormat format, const host::EventFile& file, std::int64_t first_us) {
  // Whoever reads the events from a pipe does not want these lines among them.
  const bool is_stream = host::is_written_directly(options.out);
  std::FILE* const to = is_stream ? stderr : stdout;
  std::fprintf(to, "%" PRIu64 " events written to %s\n", file.stats().events, options.out.c_str());
  if (format == OutputFormat::evt3 && file.sensor_is_guess()) {
    std::fprintf(to, "sensor of %s by the largest coordinates (--sensor sets it)\n",
                 host::to_string(file.sensor()).c_str());
  }
  const std::uint64_t dropped = file.stats().outside + file.stats().unplaced;
  if (dropped > 0) std::fprintf(to, "%" PRIu64 " events beside the sensor or without a time left out\n", dropped);
  constexpr std::int64_t kEvt3Range = std::int64_t{1} << 24;
  if (format == OutputFormat::evt3 && first_us >= kEvt3Range) {
    const std::int64_t shift_us = first_us / kEvt3Range * kEvt3Range;
    std::fprintf(to, "times read from it will be less by %" PRId64 " us: EVT3 keeps 24 bits of the first\n", shift_us);
  }
}

void run_convert(const ConvertOptions& options) {
  const OutputFormat format = output_format(options);
  check_names(options);
  // RAW wants the sensor's size, which triggers alone do not tell.
  const bool wants_side = !options.imu.empty() || !options.triggers.empty();
  const auto needs =
      wants_side && format == OutputFormat::csv ? host::EventFile::Needs::anything : host::EventFile::Needs::events;
  host::EventFile file = take(host::EventFile::open(options.events, sensor_size(options.sensor), needs));
  host::EventWriter writer = take(host::EventWriter::create(options.out, format, file.sensor()));
  host::SideWriter side = take(host::SideWriter::create(options.imu, options.triggers));
  Progress progress("converting");
  std::optional<std::int64_t> first_us;
  while (true) {
    const Span<const Event> events = take(file.read());
    check(side.write(file.imu_samples(), file.triggers()));
    if (events.empty()) break;
    if (!first_us) first_us = events[0].t_us;
    if (host::MaybeError error = writer.write(events)) {
      if (error->file.empty()) error->file = options.events;
      fail(*std::move(error));
    }
    progress.update(file.fraction_read());
  }
  check(writer.commit());
  check(side.commit());
  report(options, format, file, first_us.value_or(0));
  report_side(options, side, file.side_dropped(), host::is_written_directly(options.out) ? stderr : stdout);
}

}  // namespace

void add_convert(CLI::App& app) {
  CLI::App* command = app.add_subcommand("convert", "Write a recording in another format");
  const auto options = std::make_shared<ConvertOptions>();
  command->footer(
      "EVT3 (.raw) is small and carries the sensor's size; it keeps the time of the first event modulo 16.8 s.\n"
      "CSV (.csv, .txt: t_us,x,y,p) keeps every time. Frames are left out, triggers and IMU samples go to files of "
      "their own.");
  add_events_option(command, &options->events);
  command->add_option("OUT", options->out, "File to write; one that exists is replaced once all is written")
      ->type_name("FILE")
      ->required();
  command->add_option("--format", options->format, "Default: by the end of the file's name")
      ->type_name("NAME")
      ->check(CLI::IsMember({"evt3", "csv"}));
  command
      ->add_option(
          "--imu", options->imu,
          "Write IMU samples too: CSV t_us,wx,wy,wz,ax,ay,az,temperature_c, rad/s and m/s^2 about and along the "
          "camera's axes x right, y down, z forward; calibrate --gyro reads it")
      ->type_name("FILE");
  command->add_option("--triggers", options->triggers, "Write triggers too: CSV t_us,channel,kind")->type_name("FILE");
  add_sensor_option(command, &options->sensor);
  command->callback([options] { run_convert(*options); });
}

}  // namespace lecalib::command
