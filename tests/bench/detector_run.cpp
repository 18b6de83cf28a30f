// SPDX-License-Identifier: MIT
#include "bench/detector_run.hpp"

#include <cstdio>
#include <cstdlib>
#include <utility>

#include "lecalib/events/window_builder.hpp"
#include "lecalib/host/cpu_clock.hpp"
#include "lecalib/host/event_file.hpp"
#include "lecalib/host/heap_arena.hpp"
#include "lecalib/pipeline/window_length.hpp"

namespace lecalib::bench {
namespace {

using host::thread_cpu_ns;

DetectorCapacities capacities_for(LineFinder finder, std::size_t events, std::uint16_t width, std::uint16_t height) {
  DetectorCapacities capacities;
  capacities.events = events;
  capacities.width = width;
  capacities.height = height;
  if (finder == fast_detector) capacities.surface_points = capacities.regions = 0;
  return capacities;
}

/// A detector with its memory.
class Detector {
 public:
  Detector(LineFinder finder, const DetectorCapacities& capacities)
      : bytes_(detector_bytes(capacities)), block_(bytes_), lines_(capacities.lines) {
    Arena arena(block_.memory());
    if (!carve(arena, capacities, &workspace_)) std::abort();
    options_.find_lines = finder;
    options_.cloud.width = capacities.width;
    options_.cloud.height = capacities.height;
    options_.clock_ns = &thread_cpu_ns;
  }

  void run(const EventWindow& window) {
    const std::uint64_t begin_ns = thread_cpu_ns();
    const Status status = detect_lines(window, options_, &workspace_, lines_, &count_, &stats_);
    ns_ = thread_cpu_ns() - begin_ns;
    if (status == Status::ok) return;
    std::fprintf(stderr, "line detection: %s\n", to_string(status));
    std::exit(EXIT_FAILURE);
  }

  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  /// Of the last run.
  [[nodiscard]] std::uint64_t ns() const { return ns_; }
  [[nodiscard]] const DetectorStats& stats() const { return stats_; }
  [[nodiscard]] Span<const EventLine> lines() const { return {lines_.data(), count_}; }

 private:
  std::size_t bytes_;
  host::HeapArena block_;
  DetectorWorkspace workspace_;
  DetectorOptions options_;
  DetectorStats stats_;
  std::vector<EventLine> lines_;
  std::size_t count_ = 0;
  std::uint64_t ns_ = 0;
};

}  // namespace

std::size_t arena_bytes(LineFinder finder, std::size_t events, std::uint16_t width, std::uint16_t height) {
  return detector_bytes(capacities_for(finder, events, width, height));
}

Measurement measure(const std::vector<Scene>& scenes, LineFinder finder, std::size_t capacity, int repeats) {
  Detector detector(finder, capacities_for(finder, capacity, scenes.front().width, scenes.front().height));
  Measurement sum;
  sum.bytes_per_event = static_cast<double>(detector.bytes()) / static_cast<double>(capacity);
  for (const Scene& scene : scenes) {
    detector.run(scene.window());
    std::uint64_t fastest_ns = detector.ns();
    DetectorStats fastest = detector.stats();
    for (int i = 1; i < repeats; ++i) {
      detector.run(scene.window());
      if (detector.ns() >= fastest_ns) continue;
      fastest_ns = detector.ns();
      fastest = detector.stats();
    }
    sum.events += static_cast<double>(scene.events.size());
    sum.total_ns += static_cast<double>(fastest_ns);
    for (std::size_t i = 0; i < kNumDetectorStages; ++i) sum.stage_ns[i] += static_cast<double>(fastest.stage_ns[i]);
    sum.quality.add(scene, detector.lines());
  }
  return sum;
}

host::Result<Throughput> measure_recording(const std::string& path, const std::string& sensor, LineFinder finder) {
  SensorSize given;
  if (!sensor.empty()) {
    const auto size = host::parse_sensor(sensor);
    if (!size.ok()) return size.error();
    given = size.value();
  }
  const std::uint64_t begin_ns = thread_cpu_ns();
  auto opened = host::EventFile::open(path, given);
  if (!opened.ok()) return opened.error();
  host::EventFile file = std::move(opened).value();

  const DetectorCapacities capacities =
      capacities_for(finder, DetectorCapacities().events, file.sensor().width, file.sensor().height);
  Detector detector(finder, capacities);
  std::vector<Event> storage(capacities.events);
  std::vector<float> travels(capacities.lines);
  WindowOptions options;
  options.length_us = WindowLengthOptions().first_us;
  WindowBuilder builder;
  if (is_error(builder.init(options, storage))) std::abort();

  Throughput sum;
  for (bool at_end = false; !at_end;) {
    const auto read = file.read();
    if (!read.ok()) return read.error();
    Span<const Event> events = read.value();
    at_end = events.empty();
    EventWindow window;
    while (true) {
      const std::uint64_t push_ns = thread_cpu_ns();
      const Status status = at_end ? builder.finish(&window) : builder.push(&events, &window);
      sum.window_ns += static_cast<double>(thread_cpu_ns() - push_ns);
      if (status != Status::ok) break;
      detector.run(window);
      sum.detect_ns += static_cast<double>(detector.ns());
      sum.lines += static_cast<double>(detector.lines().size());
      (void)builder.set_length_us(next_window_length({}, window.end_us - window.begin_us, detector.lines(), travels));
    }
  }
  sum.decode_ns = static_cast<double>(file.decode_cpu_ns());
  sum.read_ns = static_cast<double>(thread_cpu_ns() - begin_ns) - sum.decode_ns - sum.window_ns - sum.detect_ns;
  sum.events = static_cast<double>(builder.stats().events);
  sum.windows = static_cast<double>(builder.stats().windows);
  return sum;
}

}  // namespace lecalib::bench
