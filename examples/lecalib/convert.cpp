// SPDX-License-Identifier: MIT
/// lecalib convert: a recording in another format.
#include <cinttypes>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "commands.hpp"
#include "event_options.hpp"
#include "lecalib/host/event_writer.hpp"
#include "progress.hpp"

namespace lecalib::command {
namespace {

using host::OutputFormat;

struct Options {
  std::string events, out, format, sensor;
};

OutputFormat output_format(const Options& options) {
  const auto format =
      options.format.empty() ? host::output_format_of_path(options.out) : host::output_format_named(options.format);
  if (!format) fail({"the name tells no format: end it in .raw (EVT3) or .csv, or give --format", options.out});
  return *format;
}

/// What a reader of the new file has to know.
void report(const Options& options, OutputFormat format, const host::EventFile& file, std::int64_t first_us) {
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

void run(const Options& options) {
  const OutputFormat format = output_format(options);
  if (host::is_same_file(options.events, options.out)) {
    fail({"is the recording itself, expected another file to write", options.out});
  }
  host::EventFile file = take(host::EventFile::open(options.events, sensor_size(options.sensor)));
  host::EventWriter writer = take(host::EventWriter::create(options.out, format, file.sensor()));
  Progress progress("converting");
  std::optional<std::int64_t> first_us;
  while (true) {
    const Span<const Event> events = take(file.read());
    if (events.empty()) break;
    if (!first_us) first_us = events[0].t_us;
    if (host::MaybeError error = writer.write(events)) {
      if (error->file.empty()) error->file = options.events;
      fail(*std::move(error));
    }
    progress.update(file.fraction_read());
  }
  check(writer.commit());
  report(options, format, file, first_us.value_or(0));
}

}  // namespace

void add_convert(CLI::App& app) {
  CLI::App* command = app.add_subcommand("convert", "Write a recording in another format");
  const auto options = std::make_shared<Options>();
  command->footer(
      "EVT3 (.raw) is small and carries the sensor's size; it keeps the time of the first event modulo 16.8 s.\n"
      "CSV (.csv, .txt: t_us,x,y,p) keeps every time. Triggers, frames and IMU samples are left out.");
  add_events_option(command, &options->events);
  command->add_option("OUT", options->out, "File to write; one that exists is replaced once all is written")
      ->type_name("FILE")
      ->required();
  command->add_option("--format", options->format, "Default: by the end of the file's name")
      ->type_name("NAME")
      ->check(CLI::IsMember({"evt3", "csv"}));
  add_sensor_option(command, &options->sensor);
  command->callback([options] { run(*options); });
}

}  // namespace lecalib::command
