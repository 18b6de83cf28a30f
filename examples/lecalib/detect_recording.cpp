// SPDX-License-Identifier: MIT
/// file -> windows -> lines -> CSV, picture and statistics.
#include <cinttypes>
#include <cstdio>
#include <string>

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

DetectorCapacities capacities_for(const DetectOptions& options, SensorSize sensor) {
  DetectorCapacities capacities;
  capacities.events = options.max_events;
  capacities.width = sensor.width;
  capacities.height = sensor.height;
  if (options.kind() == DetectorKind::fast) capacities.surface_points = capacities.regions = 0;
  return capacities;
}

DetectorOptions detector_options(const DetectOptions& options, SensorSize sensor) {
  DetectorOptions detector;
  detector.kind = options.kind();
  detector.cloud.width = sensor.width;
  detector.cloud.height = sensor.height;
  detector.clock_ns = &host::thread_cpu_ns;
  return detector;
}

/// The picture of the window asked for, or of the one with most lines.
class Picture {
 public:
  explicit Picture(const DetectOptions& options) : options_(options) {}

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
  const DetectOptions& options_;
  std::string svg_;
  std::size_t most_ = 0;
};

}  // namespace

void detect_recording(const DetectOptions& options) {
  host::EventFile file = open_events(options.events, options.sensor);
  const DetectorCapacities capacities = capacities_for(options, file.sensor());
  DetectTotals totals;
  totals.arena_bytes = required_bytes(capacities);
  const host::HeapArena block(totals.arena_bytes);
  Arena arena(block.memory());
  Memory memory;
  if (!carve(arena, capacities, &memory)) fail({"not enough memory"});

  const DetectorOptions detector = detector_options(options, file.sensor());
  WindowSource windows(&file, options.range, memory.window_events);
  Picture picture(options);
  host::LinesCsv csv;
  Progress progress("detecting lines");
  EventWindow window;
  for (std::size_t index = 0; windows.next(&window); ++index) {
    std::size_t count = 0;
    DetectorStats stats;
    const std::uint64_t begin_ns = host::thread_cpu_ns();
    const Status status = detect_lines(window, detector, &memory.detector, memory.lines, &count, &stats);
    totals.detector_ns += host::thread_cpu_ns() - begin_ns;
    if (is_error(status)) fail({std::string("line detection stopped: ") + to_string(status), options.events});
    totals.add(stats);
    const LineWindow found{window.begin_us, window.end_us, memory.lines.first(count)};
    csv.add(found);
    picture.offer(index, window, found, file.sensor());
    if (options.range.is_adaptive()) {
      windows.set_length_us(next_window_length({}, window.end_us - window.begin_us, found.lines, memory.travels));
    }
    progress.update(file.fraction_read());
  }
  if (windows.stats().windows == 0) fail({"no events in the range asked for", options.events});

  totals.lines = csv.num_lines();
  picture.write();
  if (!options.stats.empty()) check(host::write_file(options.stats, detect_stats_json(file, windows, totals)));
  check(host::write_file(options.out, csv.text()));
  std::printf("%zu lines in %" PRIu64 " windows of %" PRIu64 " events: %s\n", totals.lines, windows.stats().windows,
              windows.stats().events, options.out.c_str());
}

}  // namespace lecalib::command
