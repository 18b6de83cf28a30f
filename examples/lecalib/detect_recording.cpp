// SPDX-License-Identifier: MIT
/// file -> windows -> noise filter, if wanted -> lines -> CSV, picture and statistics.
#include <cinttypes>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "commands.hpp"
#include "detect.hpp"
#include "event_options.hpp"
#include "lecalib/host/cpu_clock.hpp"
#include "lecalib/host/file_io.hpp"
#include "lecalib/host/heap_arena.hpp"
#include "lecalib/host/lines_csv.hpp"
#include "lecalib/host/window_svg.hpp"
#include "lecalib/pipeline/window_length.hpp"
#include "progress.hpp"

namespace lecalib::command {
namespace {

struct Capacities {
  DetectorCapacities detector;
  NoiseFilterCapacities noise;  ///< 0 x 0 without it
};

/// All memory of the detection, carved from one block.
struct Memory {
  Span<Event> window_events;
  Span<EventLine> lines;
  Span<float> travels;
  NoiseFilterWorkspace noise;
  DetectorWorkspace detector;
};

template <class Carver>
bool carve(Carver& carver, const Capacities& capacities, Memory* out) {
  const DetectorCapacities& detector = capacities.detector;
  return carver.carve(detector.events, &out->window_events) && carver.carve(detector.lines, &out->lines) &&
         carver.carve(detector.lines, &out->travels) && carve(carver, capacities.noise, &out->noise) &&
         carve(carver, detector, &out->detector);
}

std::size_t required_bytes(const Capacities& capacities) {
  ArenaMeter meter;
  Memory memory;
  (void)carve(meter, capacities, &memory);
  return meter.peak();
}

Capacities capacities_for(const DetectOptions& options, SensorSize sensor) {
  Capacities capacities;
  capacities.detector.events = options.max_events;
  capacities.detector.width = sensor.width;
  capacities.detector.height = sensor.height;
  if (options.find_lines() == fast_detector) capacities.detector.surface_points = capacities.detector.regions = 0;
  if (options.filters_noise) capacities.noise = {sensor.width, sensor.height};
  return capacities;
}

/// From the events of a window to its lines, with everything that happens counted.
class Detection {
 public:
  Detection(const DetectOptions& options, SensorSize sensor) : filters_noise_(options.filters_noise) {
    const Capacities capacities = capacities_for(options, sensor);
    totals_.arena_bytes = required_bytes(capacities);
    block_ = std::make_unique<host::HeapArena>(totals_.arena_bytes);
    Arena arena(block_->memory());
    if (!carve(arena, capacities, &memory_)) fail({"not enough memory"});
    noise_.width = detector_.cloud.width = sensor.width;
    noise_.height = detector_.cloud.height = sensor.height;
    detector_.find_lines = options.find_lines();
    detector_.cloud.c_z_us_per_px = static_cast<float>(options.c_z_us_per_px);
    detector_.clock_ns = &host::thread_cpu_ns;
  }

  /// @param[in,out] window its events lie in memory().window_events; those that are noise are taken out.
  Status run(EventWindow* window, LineWindow* found) {
    Status status = filters_noise_ ? filter(window) : Status::ok;
    if (is_error(status)) return status;
    std::size_t count = 0;
    DetectorStats stats;
    const std::uint64_t begin_ns = host::thread_cpu_ns();
    status = detect_lines(*window, detector_, &memory_.detector, memory_.lines, &count, &stats);
    totals_.detector_ns += host::thread_cpu_ns() - begin_ns;
    totals_.add(stats);
    *found = {window->begin_us, window->end_us, memory_.lines.first(count)};
    return status;
  }

  [[nodiscard]] const Memory& memory() const { return memory_; }
  [[nodiscard]] const DetectTotals& totals() const { return totals_; }

 private:
  Status filter(EventWindow* window) {
    const std::uint64_t begin_ns = host::thread_cpu_ns();
    const Status status = filter_noise(*window, noise_, &memory_.noise, memory_.window_events, window, &totals_.noise);
    totals_.noise_ns += host::thread_cpu_ns() - begin_ns;
    return status;
  }

  bool filters_noise_;
  NoiseFilterOptions noise_;
  DetectorOptions detector_;
  std::unique_ptr<host::HeapArena> block_;
  Memory memory_;
  DetectTotals totals_;
};

/// The picture of the window asked for, or of the one with most lines. Keeps that window and draws it once.
class Picture {
 public:
  explicit Picture(const DetectOptions& options) : options_(options) {}

  void offer(std::size_t index, const EventWindow& events, const LineWindow& lines) {
    if (options_.svg.empty()) return;
    const bool is_wanted =
        options_.svg_window ? index == *options_.svg_window : !index_ || lines.lines.size() > lines_.size();
    if (!is_wanted) return;
    index_ = index;
    window_ = events;
    events_.assign(events.events.begin(), events.events.end());
    lines_.assign(lines.lines.begin(), lines.lines.end());
  }

  void write(SensorSize sensor) const {
    if (options_.svg.empty()) return;
    if (!index_) fail({"the recording has no window " + std::to_string(*options_.svg_window)});
    const std::string caption = "window " + std::to_string(*index_) + ", " + std::to_string(window_.begin_us) + " to " +
                                std::to_string(window_.end_us) + " us: " + std::to_string(events_.size()) +
                                " events, " + std::to_string(lines_.size()) + " lines";
    check(
        host::write_file(options_.svg, host::draw_window({window_.begin_us, window_.end_us, events_},
                                                         {window_.begin_us, window_.end_us, lines_}, sensor, caption)));
  }

 private:
  const DetectOptions& options_;
  std::optional<std::size_t> index_;
  EventWindow window_;
  std::vector<Event> events_;
  std::vector<EventLine> lines_;
};

}  // namespace

void detect_recording(const DetectOptions& options) {
  host::EventFile file = open_events(options.events, options.sensor);
  Detection detection(options, file.sensor());
  const Memory& memory = detection.memory();
  WindowSource windows(&file, options.range, options.max_rate_per_s, memory.window_events);
  Picture picture(options);
  host::LinesCsv csv(file.sensor());
  Progress progress("detecting lines");
  EventWindow window;
  for (std::size_t index = 0; windows.next(&window); ++index) {
    LineWindow found;
    const Status status = detection.run(&window, &found);
    if (is_error(status)) fail({std::string("line detection stopped: ") + to_string(status), options.events});
    csv.add(found);
    picture.offer(index, window, found);
    if (options.range.is_adaptive()) {
      windows.set_length_us(next_window_length({}, window.end_us - window.begin_us, found.lines, memory.travels));
    }
    progress.update(file.fraction_read());
  }
  if (windows.stats().windows == 0) fail({"no events in the range asked for", options.events});

  picture.write(file.sensor());
  if (!options.stats.empty()) {
    DetectTotals totals = detection.totals();
    totals.lines = csv.num_lines();
    check(host::write_file(options.stats, detect_stats_json(file, windows, totals)));
  }
  check(host::write_file(options.out, csv.text()));
  std::printf("%zu lines in %" PRIu64 " windows of %" PRIu64 " events: %s\n", csv.num_lines(), windows.stats().windows,
              windows.stats().events, options.out.c_str());
}

}  // namespace lecalib::command
