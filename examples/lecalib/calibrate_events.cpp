// SPDX-License-Identifier: MIT
/// From the events of one camera, recorded (lecalib calibrate EVENTS) or live, to the camera.
#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "calibrate.hpp"
#include "event_options.hpp"
#include "lecalib/host/cpu_clock.hpp"
#include "lecalib/host/gyro_file.hpp"
#include "lecalib/host/heap_arena.hpp"

namespace lecalib::command {
namespace {

using host::EventFile;
using host::thread_cpu_ns;

/// The search for the model's faces takes every four lines that meet: a second at this size, hours at 2000.
constexpr std::size_t kMaxModelLines = 128;

/// Windows are not to be thinned: edges need all of their events.
constexpr std::uint32_t kMaxWindowEvents = 400000;

double to_milliseconds(std::uint64_t ns) { return static_cast<double>(ns) * 1e-6; }

class FileSource : public EventSource {
 public:
  explicit FileSource(EventFile file) : file_(std::move(file)) {}
  [[nodiscard]] SensorSize sensor() const override { return file_.sensor(); }
  Span<const Event> read() override { return take(file_.read()); }
  void show(const MonoCalibrator& /*calibrator*/, Progress* progress) const override {
    progress->update(file_.fraction_read());
  }
  [[nodiscard]] DecoderStats stats() const override { return file_.stats(); }
  [[nodiscard]] std::uint64_t decode_cpu_ns() const override { return file_.decode_cpu_ns(); }

 private:
  EventFile file_;
};

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

}  // namespace

std::vector<std::unique_ptr<EventSource>> open_recordings(const std::vector<std::string>& paths,
                                                          const std::string& sensor) {
  std::vector<std::unique_ptr<EventSource>> files;
  for (const std::string& path : paths) {
    files.push_back(std::make_unique<FileSource>(open_events(path, sensor)));
    const SensorSize first = files.front()->sensor();
    const SensorSize size = files.back()->sensor();
    if (size.width != first.width || size.height != first.height) {
      fail({"the sensor has " + host::to_string(size) + " px, that of " + paths.front() + " has " +
                host::to_string(first),
            path});
    }
  }
  return files;
}

Capacities capacities_for(SensorSize sensor, const CalibrateOptions& options, const host::Model& model) {
  if (model.lines.size() > kMaxModelLines) {
    fail({"expected at most " + std::to_string(kMaxModelLines) + " lines to search a recording for, the model has " +
              std::to_string(model.lines.size()),
          options.model.empty() ? options.target : options.model});
  }
  Capacities capacities;
  capacities.events_per_window = kMaxWindowEvents;
  capacities.model_lines = std::max(capacities.model_lines, static_cast<std::uint32_t>(model.lines.size()));
  capacities.sensor_width = sensor.width;
  capacities.sensor_height = sensor.height;
  return capacities;
}

MonoOptions mono_options(const CalibrateOptions& options, SensorSize sensor) {
  MonoOptions mono;
  options.apply(&mono.solver);
  mono.matcher.hints = options.hints();
  mono.matcher.width = sensor.width;
  mono.matcher.height = sensor.height;
  if (!valid(mono.matcher)) {
    fail({"--focal: a sensor of " + host::to_string(sensor) + " px is not searched for a focal length so far out"});
  }
  mono.use_edges = !options.lines_only;
  mono.detector.clock_ns = &thread_cpu_ns;
  return mono;
}

void report_counts(const std::vector<std::unique_ptr<EventSource>>& sources, const MonoStats& stats,
                   const std::string& prefix, host::Diagnostics* diagnostics) {
  DecoderStats decoded;
  std::uint64_t decode_ns = 0;
  for (const auto& source : sources) {
    add_counts(source->stats(), &decoded);
    decode_ns += source->decode_cpu_ns();
  }
  const auto add = [&prefix](std::vector<host::NamedCount>* to, const char* name, std::uint64_t value) {
    to->push_back({prefix + name, value});
  };
  add(&diagnostics->counts, "events", decoded.events);
  add(&diagnostics->counts, "windows", stats.windows.windows);
  add(&diagnostics->counts, "lines", stats.lines);
  add(&diagnostics->counts, "windows_kept", stats.windows_kept);
  add(&diagnostics->counts, "windows_matched", stats.windows_matched);
  add(&diagnostics->counts, "matches", stats.matches);
  add(&diagnostics->counts, "turns", stats.turns);
  if (stats.edges_used) {
    add(&diagnostics->counts, "edges",
        stats.edges.lines - stats.edges.without_edge - stats.edges.blurred - stats.edges.faint);
    add(&diagnostics->counts, "flanks", stats.edges.flanks);
  }
  add(&diagnostics->dropped, "events_outside", decoded.outside);
  add(&diagnostics->dropped, "events_unplaced", decoded.unplaced);
  add(&diagnostics->dropped, "events_backward", stats.windows.backward);
  add(&diagnostics->dropped, "events_thinned", stats.windows.thinned);
  add(&diagnostics->dropped, "events_cut", stats.windows.cut);
  add(&diagnostics->dropped, "lines", stats.lines_dropped);
  add(&diagnostics->dropped, "crossings", stats.crossings_dropped);
  if (stats.edges_used) {
    add(&diagnostics->dropped, "matches_without_edge", stats.edges.without_edge);
    add(&diagnostics->dropped, "edges_blurred", stats.edges.blurred);
    add(&diagnostics->dropped, "edges_faint", stats.edges.faint);
  }
  diagnostics->cpu_ms.push_back({prefix + "decode", to_milliseconds(decode_ns)});
  for (std::size_t i = 0; i < kNumDetectorStages; ++i) {
    diagnostics->cpu_ms.push_back(
        {prefix + to_string(static_cast<DetectorStage>(i)), to_milliseconds(stats.stage_ns[i])});
  }
}

void calibrate_from(const std::vector<std::unique_ptr<EventSource>>& sources, const CalibrateOptions& options,
                    const host::Model& model, host::CalibrationReport* report) {
  const Capacities capacities = capacities_for(sources.front()->sensor(), options, model);
  MonoOptions mono = mono_options(options, sources.front()->sensor());
  std::vector<GyroSample> gyro;
  if (options.gyro == kGyroOfRecording) {
    gyro = take(host::read_gyro_of_recording(options.events.front(), sensor_size(options.sensor)));
  } else if (!options.gyro.empty()) {
    gyro = take(host::read_gyro(options.gyro));
    report->diagnostics.inputs.push_back(options.gyro);
  }
  mono.gyro_samples = gyro;
  mono.gyro = options.gyro_options();
  const host::HeapArena block(required_bytes(capacities));
  MonoCalibrator calibrator;
  const Status ready = calibrator.init(block.memory(), capacities, mono, model.lines);
  if (is_error(ready)) fail({std::string("cannot start with this model: ") + to_string(ready)});

  for (const auto& source : sources) {
    Progress progress("reading events, finding lines");
    for (Span<const Event> events = source->read(); !events.empty(); events = source->read()) {
      if (source->has_gap()) (void)calibrator.cut();
      if (!push_all(events, &calibrator)) break;
      source->show(calibrator, &progress);
    }
  }
  const std::uint64_t begin_ns = thread_cpu_ns();
  (void)calibrator.finish();
  Progress progress("matching and solving");
  while (calibrator.step() == Status::in_progress) progress.update(static_cast<double>(calibrator.progress()));

  report_counts(sources, calibrator.stats(), "", &report->diagnostics);
  report->diagnostics.cpu_ms.push_back({"match_and_solve", to_milliseconds(thread_cpu_ns() - begin_ns)});
  CalibrationResult result;
  result.status = calibrator.result(&result);
  add_result(result, calibrator.views(), {}, model.names, report);
  add_coverage(calibrator.coverage(), report);
  add_search(calibrator, model.names, report);
}

void calibrate_events(const CalibrateOptions& options, const host::Model& model, host::CalibrationReport* report) {
  const std::vector<std::unique_ptr<EventSource>> files = open_recordings(options.events, options.sensor);
  report->diagnostics.inputs.insert(report->diagnostics.inputs.end(), options.events.begin(), options.events.end());
  calibrate_from(files, options, model, report);
}

}  // namespace lecalib::command
