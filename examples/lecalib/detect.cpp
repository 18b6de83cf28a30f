// SPDX-License-Identifier: MIT
/// lecalib detect: the straight moving lines of a recording, window by window.
#include "detect.hpp"

#include <charconv>
#include <limits>
#include <memory>

#include "commands.hpp"
#include "event_options.hpp"
#include "lecalib/core/time.hpp"
#include "lecalib/host/file_io.hpp"
#include "lecalib/host/text.hpp"

namespace lecalib::command {
namespace {

/// Refuses what CLI11 would bend into a whole number: "" into 0, too large ones into the largest, -1 as well where none
/// is below 0.
template <class Number>
std::string check_whole(const std::string& text) {
  Number value = 0;
  const char* const end = text.data() + text.size();
  const std::from_chars_result result = std::from_chars(text.data(), end, value);
  return result.ec == std::errc() && result.ptr == end ? "" : "expected a whole number, found '" + text + "'";
}

/// Of --c-z: below 1 us, the clock's step, or above a second per pixel nothing is gained.
std::string check_c_z(const std::string& text) {
  const std::optional<double> value = host::parse_number(text);
  return value && (*value == 0 || (*value >= 1 && *value <= 1e6))
             ? ""
             : "expected 0 (automatic) or 1 to 1000000 us per px, found '" + text + "'";
}

void check_range(const WindowRange& range) {
  if (range.window_us && *range.window_us <= 0) fail({"--window-us: expected a length above 0"});
  if (!range.from_us || !range.to_us) return;
  if (*range.from_us >= *range.to_us) {
    fail({"--from-us " + std::to_string(*range.from_us) + " is not before --to-us " + std::to_string(*range.to_us)});
  }
  if (distance_us(*range.from_us, *range.to_us) > std::numeric_limits<std::int64_t>::max()) {
    fail({"--from-us to --to-us: expected less than 2^63 us"});
  }
}

/// A result takes the place neither of the recording nor of another result.
void check_paths(const DetectOptions& options) {
  const std::string* const paths[] = {&options.events, &options.out, &options.stats, &options.svg};
  for (const std::string* const& path : paths) {
    for (const std::string* const* other = paths; other != &path; ++other) {
      if (path->empty() || !host::is_same_file(**other, *path)) continue;
      fail({other == paths ? "is the recording, expected another name for the result"
                           : "is named for two results, expected a name for each",
            *path});
    }
  }
}

void run_detect(const DetectOptions& options) {
  check_range(options.range);
  check_paths(options);
  detect_recording(options);
}

void add_windows(CLI::App* command, DetectOptions* options) {
  command
      ->add_option("--window-us", options->range.window_us,
                   "Length of the windows, us (default: follows the motion, so that lines travel about 6 px)")
      ->check(check_whole<std::int64_t>)
      ->type_name("N");
  command->add_option("--from-us", options->range.from_us, "Leave out events before this time of the recording, us")
      ->check(check_whole<std::int64_t>)
      ->type_name("A");
  command
      ->add_option(
          "--to-us", options->range.to_us,
          "Leave out events from this time on, us. With --from-us and without --window-us the range is one window")
      ->check(check_whole<std::int64_t>)
      ->type_name("B");
  command
      ->add_option("--max-events", options->max_events,
                   "Events of a window that are looked at; more are thinned evenly")
      ->capture_default_str()
      ->check(CLI::Range(1'000, 10'000'000).description(""))
      ->type_name("N");
  command
      ->add_option("--max-rate", options->max_rate_per_s,
                   "Events per second that are looked at; more are thinned evenly, to keep up with a sensor. 0: all")
      ->capture_default_str()
      ->check(check_whole<std::uint32_t>)
      ->type_name("PER_S");
}

void add_detector(CLI::App* command, DetectOptions* options) {
  command
      ->add_option("--detector", options->detector,
                   "fast: seeds from sums over cells; reference: normals and planes as in the paper, slower")
      ->check(CLI::IsMember({"fast", "reference"}).description(""))
      ->capture_default_str()
      ->type_name("NAME");
  command
      ->add_option("--c-z", options->c_z_us_per_px,
                   "Time that counts as one pixel of depth, us per px; 0: automatic, so that the window is 8 px deep. "
                   "The paper uses 5000. The fast detector's lines do not depend on it")
      ->check(check_c_z)
      ->capture_default_str()
      ->type_name("US_PER_PX");
  CLI::Option* const filter = command->add_flag(
      "--noise-filter", options->filters_noise,
      "Take out hot pixels and events without neighbours first, as calibrate does; costs some recall");
  command->add_flag("--no-noise-filter", "Leave them in (default)")->excludes(filter);
}

void add_results(CLI::App* command, DetectOptions* options) {
  command
      ->add_option("--stats", options->stats,
                   "JSON to write: counts, CPU time per event and stage, memory, what was dropped")
      ->type_name("FILE");
  command->add_option("--svg", options->svg, "Picture to write: events and lines of one window")->type_name("FILE");
  command
      ->add_option("--svg-window", options->svg_window,
                   "Which window to draw, from 0 (default: the one with most lines)")
      ->check(check_whole<std::size_t>)
      ->needs("--svg")
      ->type_name("N");
}

}  // namespace

void add_detect(CLI::App& app) {
  CLI::App* command = app.add_subcommand("detect", "Find the straight moving lines of a recording");
  const auto options = std::make_shared<DetectOptions>();
  add_events_option(command, &options->events);
  add_sensor_option(command, &options->sensor);
  command
      ->add_option("--out", options->out,
                   "CSV to write, one row per line and window end: t_us,end,line,x1,y1,x2,y2,sigma_px,events,polarity")
      ->required()
      ->type_name("FILE");
  add_windows(command, options.get());
  add_detector(command, options.get());
  add_results(command, options.get());
  command->callback([options] { run_detect(*options); });
}

}  // namespace lecalib::command
