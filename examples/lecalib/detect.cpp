// SPDX-License-Identifier: MIT
/// lecalib detect: the straight moving lines of a recording, window by window.
#include <charconv>
#include <cinttypes>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "commands.hpp"
#include "event_options.hpp"
#include "lecalib/events/window_builder.hpp"
#include "lecalib/host/cpu_clock.hpp"
#include "lecalib/host/event_file.hpp"
#include "lecalib/host/file_io.hpp"
#include "lecalib/host/heap_arena.hpp"
#include "lecalib/host/json_writer.hpp"
#include "lecalib/host/lines_csv.hpp"
#include "lecalib/host/window_svg.hpp"
#include "lecalib/pipeline/line_detector.hpp"
#include "lecalib/pipeline/window_length.hpp"
#include "progress.hpp"

namespace lecalib::command {
namespace {

using host::EventFile;
using host::thread_cpu_ns;

struct Options {
  std::string events;
  std::string sensor;
  std::string out;
  std::string stats;
  std::string svg;
  std::optional<std::size_t> svg_window;
  std::optional<std::int64_t> window_us;
  std::optional<std::int64_t> from_us;
  std::optional<std::int64_t> to_us;
  std::size_t max_events = DetectorCapacities().events;
  std::string detector = "fast";

  [[nodiscard]] DetectorKind kind() const { return detector == "fast" ? DetectorKind::fast : DetectorKind::reference; }

  /// Both ends are given and no length: the range is the one window.
  [[nodiscard]] bool is_one_window() const { return from_us && to_us && !window_us; }
  [[nodiscard]] bool is_adaptive() const { return !window_us && !is_one_window(); }
};

/// later - earlier for any two times, later >= earlier.
std::uint64_t distance_us(std::int64_t earlier, std::int64_t later) {
  return static_cast<std::uint64_t>(later) - static_cast<std::uint64_t>(earlier);
}

/// Refuses what CLI11 would bend into a whole number: "" into 0, too large ones into the largest, -1 as well where none
/// is below 0.
template <class Number>
std::string check_whole(const std::string& text) {
  Number value = 0;
  const char* const end = text.data() + text.size();
  const std::from_chars_result result = std::from_chars(text.data(), end, value);
  return result.ec == std::errc() && result.ptr == end ? "" : "expected a whole number, found '" + text + "'";
}

/// All memory of the detection, carved from one block.
struct Memory {
  Span<Event> window_events;
  Span<EventLine> lines;
  Span<float> travels;
  DetectorWorkspace detector;
};

template <class Carver>
bool carve(Carver& carver, const DetectorCapacities& capacities, Memory* out) {
  return carver.carve(capacities.events, &out->window_events) && carver.carve(capacities.lines, &out->lines) &&
         carver.carve(capacities.lines, &out->travels) && carve(carver, capacities, &out->detector);
}

std::size_t required_bytes(const DetectorCapacities& capacities) {
  ArenaMeter meter;
  Memory memory;
  (void)carve(meter, capacities, &memory);
  return meter.peak();
}

/// What happened over all windows.
struct Totals {
  std::uint64_t windows_ns = 0;
  std::uint64_t detector_ns = 0;
  std::uint64_t stage_ns[kNumDetectorStages] = {};
  std::uint64_t guesses_dropped = 0;
  std::uint64_t lines_dropped = 0;

  void add(const DetectorStats& stats) {
    for (std::size_t i = 0; i < kNumDetectorStages; ++i) stage_ns[i] += stats.stage_ns[i];
    guesses_dropped += stats.guesses_dropped;
    lines_dropped += stats.lines_dropped;
  }
};

/// Cuts the events of a file into windows.
class WindowSource {
 public:
  WindowSource(EventFile* file, const Options& options, Span<Event> storage) : file_(file), options_(options) {
    WindowOptions window;
    window.length_us = options.window_us.value_or(WindowLengthOptions().first_us);
    if (options.is_one_window()) window.length_us = *options.to_us - *options.from_us;
    if (is_error(builder_.init(window, storage))) fail({"the window's length is out of range"});
  }

  /// @return false when there is no further window.
  bool next(EventWindow* window) {
    while (true) {
      const std::uint64_t begin_ns = thread_cpu_ns();
      const Status status = at_end_ ? builder_.finish(window) : builder_.push(&events_, window);
      cpu_ns_ += thread_cpu_ns() - begin_ns;
      if (status == Status::ok) break;
      if (at_end_) return false;
      read();
    }
    if (options_.is_one_window()) {
      window->begin_us = *options_.from_us;
      window->end_us = *options_.to_us;
    }
    return true;
  }

  void set_length_us(std::int64_t length_us) { (void)builder_.set_length_us(length_us); }
  [[nodiscard]] const WindowStats& stats() const { return builder_.stats(); }
  [[nodiscard]] std::uint64_t cpu_ns() const { return cpu_ns_; }

 private:
  /// The next events of the file that lie in the range asked for.
  void read() {
    const Span<const Event> events = take(file_->read());
    const std::uint64_t begin_ns = thread_cpu_ns();
    const bool is_beyond = !events.empty() && options_.to_us && events[0].t_us >= *options_.to_us &&
                           distance_us(*options_.to_us, events[0].t_us) >= kDisorderUs;
    at_end_ = events.empty() || is_beyond;
    events_ = events;
    if (options_.from_us || options_.to_us) {
      in_range_.clear();
      for (const Event& event : events) {
        const bool is_early = options_.from_us && event.t_us < *options_.from_us;
        if (!is_early && !(options_.to_us && event.t_us >= *options_.to_us)) in_range_.push_back(event);
      }
      events_ = in_range_;
    }
    cpu_ns_ += thread_cpu_ns() - begin_ns;
  }

  /// Events may stand so much later in the file than their time says.
  static constexpr std::uint64_t kDisorderUs = 1'000'000;

  EventFile* file_;
  const Options& options_;
  WindowBuilder builder_;
  std::vector<Event> in_range_;
  Span<const Event> events_;
  bool at_end_ = false;
  std::uint64_t cpu_ns_ = 0;
};

/// The picture of the window asked for, or of the one with most lines.
class Picture {
 public:
  explicit Picture(const Options& options) : options_(options) {}

  void offer(std::size_t index, const EventWindow& events, const LineWindow& lines, SensorSize sensor) {
    if (options_.svg.empty()) return;
    const bool is_wanted =
        options_.svg_window ? index == *options_.svg_window : svg_.empty() || lines.lines.size() > most_;
    if (!is_wanted) return;
    most_ = lines.lines.size();
    svg_ = host::draw_window(events, lines, sensor,
                             "window " + std::to_string(index) + ", " + std::to_string(events.begin_us) + " to " +
                                 std::to_string(events.end_us) + " us: " + std::to_string(events.events.size()) +
                                 " events, " + std::to_string(most_) + " lines");
  }

  void write() const {
    if (options_.svg.empty()) return;
    if (svg_.empty()) fail({"the recording has no window " + std::to_string(*options_.svg_window)});
    check(host::write_file(options_.svg, svg_));
  }

 private:
  const Options& options_;
  std::string svg_;
  std::size_t most_ = 0;
};

std::string stats_json(const EventFile& file, const WindowSource& windows, const Totals& totals, std::size_t lines,
                       std::size_t arena_bytes) {
  const WindowStats& cut = windows.stats();
  const double events = cut.events > 0 ? static_cast<double>(cut.events) : 1;
  const auto per_event = [events](std::uint64_t ns) { return static_cast<double>(ns) / events; };
  host::JsonWriter json;
  json.begin_object();
  json.member("events", cut.events);
  json.member("windows", cut.windows);
  json.member("lines", lines);
  json.key("cpu_ns_per_event");
  json.begin_object();
  json.member("decode", per_event(file.decode_cpu_ns()));
  json.member("windows", per_event(windows.cpu_ns()));
  for (std::size_t i = 0; i < kNumDetectorStages; ++i) {
    json.member(to_string(static_cast<DetectorStage>(i)), per_event(totals.stage_ns[i]));
  }
  json.member("total", per_event(windows.cpu_ns() + totals.detector_ns));
  json.end();
  json.member("arena_bytes", arena_bytes);
  json.key("dropped");
  json.begin_object();
  json.member("outside", file.stats().outside);
  json.member("unplaced", file.stats().unplaced);
  json.member("time_backward", cut.backward);
  json.member("thinned", cut.thinned);
  json.member("guesses", totals.guesses_dropped);
  json.member("lines", totals.lines_dropped);
  json.end();
  json.end();
  return json.text();
}

void check_range(const Options& options) {
  if (options.window_us && *options.window_us <= 0) fail({"--window-us: expected a length above 0"});
  if (!options.from_us || !options.to_us) return;
  if (*options.from_us >= *options.to_us) {
    fail(
        {"--from-us " + std::to_string(*options.from_us) + " is not before --to-us " + std::to_string(*options.to_us)});
  }
  if (distance_us(*options.from_us, *options.to_us) > std::numeric_limits<std::int64_t>::max()) {
    fail({"--from-us to --to-us: expected less than 2^63 us"});
  }
}

/// A result takes the place neither of the recording nor of another result.
void check_paths(const Options& options) {
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

DetectorCapacities capacities_for(const Options& options, SensorSize sensor) {
  DetectorCapacities capacities;
  capacities.events = options.max_events;
  capacities.width = sensor.width;
  capacities.height = sensor.height;
  if (options.kind() == DetectorKind::fast) capacities.surface_points = capacities.regions = 0;
  return capacities;
}

void run(const Options& options) {
  check_range(options);
  check_paths(options);
  EventFile file = open_events(options.events, options.sensor);

  const DetectorCapacities capacities = capacities_for(options, file.sensor());
  const std::size_t arena_bytes = required_bytes(capacities);
  const host::HeapArena block(arena_bytes);
  Arena arena(block.memory());
  Memory memory;
  if (!carve(arena, capacities, &memory)) fail({"not enough memory"});

  DetectorOptions detector;
  detector.kind = options.kind();
  detector.cloud.width = capacities.width;
  detector.cloud.height = capacities.height;
  detector.clock_ns = &thread_cpu_ns;

  WindowSource windows(&file, options, memory.window_events);
  Picture picture(options);
  host::LinesCsv csv;
  Totals totals;
  Progress progress("detecting lines");
  EventWindow window;
  for (std::size_t index = 0; windows.next(&window); ++index) {
    std::size_t count = 0;
    DetectorStats stats;
    const std::uint64_t begin_ns = thread_cpu_ns();
    const Status status = detect_lines(window, detector, &memory.detector, memory.lines, &count, &stats);
    totals.detector_ns += thread_cpu_ns() - begin_ns;
    if (is_error(status)) fail({std::string("line detection stopped: ") + to_string(status), options.events});
    totals.add(stats);
    const LineWindow found{window.begin_us, window.end_us, memory.lines.first(count)};
    csv.add(found);
    picture.offer(index, window, found, file.sensor());
    if (options.is_adaptive()) {
      windows.set_length_us(next_window_length({}, window.end_us - window.begin_us, found.lines, memory.travels));
    }
    progress.update(file.fraction_read());
  }
  if (windows.stats().windows == 0) fail({"no events in the range asked for", options.events});

  picture.write();
  if (!options.stats.empty()) {
    check(host::write_file(options.stats, stats_json(file, windows, totals, csv.num_lines(), arena_bytes)));
  }
  check(host::write_file(options.out, csv.text()));
  std::printf("%zu lines in %" PRIu64 " windows of %" PRIu64 " events: %s\n", csv.num_lines(), windows.stats().windows,
              windows.stats().events, options.out.c_str());
}

}  // namespace

void add_detect(CLI::App& app) {
  CLI::App* command = app.add_subcommand("detect", "Find the straight moving lines of a recording");
  const auto options = std::make_shared<Options>();
  add_events_option(command, &options->events);
  add_sensor_option(command, &options->sensor);
  command
      ->add_option("--out", options->out,
                   "CSV to write, one row per line and window end: t_us,end,line,x1,y1,x2,y2,sigma_px,events,polarity")
      ->required()
      ->type_name("FILE");
  command
      ->add_option("--window-us", options->window_us,
                   "Length of the windows, us (default: follows the motion, so that lines travel about 5 px)")
      ->check(check_whole<std::int64_t>)
      ->type_name("N");
  command->add_option("--from-us", options->from_us, "Leave out events before this time of the recording, us")
      ->check(check_whole<std::int64_t>)
      ->type_name("A");
  command
      ->add_option(
          "--to-us", options->to_us,
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
      ->add_option("--detector", options->detector,
                   "fast: seeds from sums over cells; reference: normals and planes as in the paper, slower")
      ->check(CLI::IsMember({"fast", "reference"}).description(""))
      ->capture_default_str()
      ->type_name("NAME");
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
  command->callback([options] { run(*options); });
}

}  // namespace lecalib::command
