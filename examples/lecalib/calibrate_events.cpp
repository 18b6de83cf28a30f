// SPDX-License-Identifier: MIT
/// lecalib calibrate EVENTS: from recordings of one camera to the camera.
#include <algorithm>
#include <vector>

#include "calibrate.hpp"
#include "event_options.hpp"
#include "lecalib/host/cpu_clock.hpp"
#include "lecalib/host/gyro_file.hpp"
#include "lecalib/host/heap_arena.hpp"
#include "lecalib/pipeline/mono_calibrator.hpp"
#include "progress.hpp"

namespace lecalib::command {
namespace {

using host::EventFile;
using host::thread_cpu_ns;

/// The search for the model's faces takes every four lines that meet: a second at this size, hours at 2000.
constexpr std::size_t kMaxModelLines = 128;

/// Windows are not to be thinned: edges need all of their events.
constexpr std::uint32_t kMaxWindowEvents = 400000;

double milliseconds(std::uint64_t ns) { return static_cast<double>(ns) * 1e-6; }

std::vector<EventFile> open_all(const CalibrateOptions& options) {
  std::vector<EventFile> files;
  for (const std::string& path : options.events) {
    files.push_back(open_events(path, options.sensor));
    const SensorSize first = files.front().sensor();
    const SensorSize size = files.back().sensor();
    if (size.width != first.width || size.height != first.height) {
      fail({"the sensor has " + host::to_string(size) + " px, that of " + files.front().path() + " has " +
                host::to_string(first),
            path});
    }
  }
  return files;
}

/// Gives events to the calibrator, which works on each window as soon as it is full.
/// @return false when it takes no more
bool push_all(Span<const Event> events, MonoCalibrator* calibrator) {
  Status status = calibrator->push(&events);
  while (status == Status::in_progress) {
    while (calibrator->step() == Status::in_progress) {
    }
    status = calibrator->push(&events);
  }
  return status == Status::ok;
}

void add_counts(const std::vector<EventFile>& files, const MonoStats& stats, host::Diagnostics* diagnostics) {
  DecoderStats decoded;
  std::uint64_t decode_ns = 0;
  for (const EventFile& file : files) {
    decoded.events += file.stats().events;
    decoded.outside += file.stats().outside;
    decoded.unplaced += file.stats().unplaced;
    decode_ns += file.decode_cpu_ns();
  }
  diagnostics->counts = {{"events", decoded.events},
                         {"windows", stats.windows.windows},
                         {"lines", stats.lines},
                         {"windows_kept", stats.windows_kept},
                         {"windows_matched", stats.windows_matched},
                         {"matches", stats.matches},
                         {"turns", stats.turns}};
  if (stats.edges_used) {
    diagnostics->counts.push_back(
        {"edges", stats.edges.lines - stats.edges.without_edge - stats.edges.blurred - stats.edges.faint});
    diagnostics->counts.push_back({"flanks", stats.edges.flanks});
  }
  diagnostics->dropped = {{"events_outside", decoded.outside},
                          {"events_unplaced", decoded.unplaced},
                          {"events_backward", stats.windows.backward},
                          {"events_thinned", stats.windows.thinned + stats.thinned},
                          {"lines", stats.lines_dropped},
                          {"crossings", stats.crossings_dropped}};
  diagnostics->cpu_ms.push_back({"decode", milliseconds(decode_ns)});
  for (std::size_t i = 0; i < kNumDetectorStages; ++i) {
    diagnostics->cpu_ms.push_back({to_string(static_cast<DetectorStage>(i)), milliseconds(stats.stage_ns[i])});
  }
}

}  // namespace

void calibrate_events(const CalibrateOptions& options, const host::Model& model, host::CalibrationReport* report) {
  if (model.lines.size() > kMaxModelLines) {
    fail({"expected at most " + std::to_string(kMaxModelLines) + " lines to search a recording for, the model has " +
              std::to_string(model.lines.size()),
          options.model.empty() ? options.target : options.model});
  }
  std::vector<EventFile> files = open_all(options);
  report->diagnostics.inputs.insert(report->diagnostics.inputs.end(), options.events.begin(), options.events.end());

  Capacities capacities;
  capacities.events_per_window = kMaxWindowEvents;
  capacities.model_lines = std::max(capacities.model_lines, static_cast<std::uint32_t>(model.lines.size()));
  capacities.sensor_width = files.front().sensor().width;
  capacities.sensor_height = files.front().sensor().height;
  MonoOptions mono;
  options.apply(&mono.solver);
  mono.matcher.hints = options.hints();
  mono.use_edges = !options.lines_only;
  mono.detector.clock_ns = &thread_cpu_ns;
  std::vector<GyroSample> gyro;
  if (!options.gyro.empty()) {
    gyro = take(host::read_gyro(options.gyro));
    report->diagnostics.inputs.push_back(options.gyro);
  }
  mono.gyro_samples = gyro;
  mono.gyro = options.gyro_noise;
  const host::HeapArena block(required_bytes(capacities));
  MonoCalibrator calibrator;
  const Status ready = calibrator.init(block.memory(), capacities, mono, model.lines);
  if (is_error(ready)) fail({std::string("cannot start with this model: ") + to_string(ready)});

  for (EventFile& file : files) {
    Progress progress("reading events, finding lines");
    for (Span<const Event> events = take(file.read()); !events.empty(); events = take(file.read())) {
      if (!push_all(events, &calibrator)) break;
      progress.update(file.fraction_read());
    }
  }
  const std::uint64_t begin_ns = thread_cpu_ns();
  (void)calibrator.finish();
  Progress progress("matching and solving");
  while (calibrator.step() == Status::in_progress) progress.update(static_cast<double>(calibrator.progress()));

  add_counts(files, calibrator.stats(), &report->diagnostics);
  report->diagnostics.cpu_ms.push_back({"match_and_solve", milliseconds(thread_cpu_ns() - begin_ns)});
  CalibrationResult result;
  result.status = calibrator.result(&result);
  add_result(result, calibrator.views(), {}, model.names, report);
  add_coverage(calibrator.coverage(), report);
}

}  // namespace lecalib::command
