// SPDX-License-Identifier: MIT
/// How much of a camera's events a calibration takes in while they come: a fake camera sends a box over and over, and
/// its stream goes through the driver, the ring, the decoder and the calibrator of `lecalib live`. Only USB is left
/// out.
///
///     bench_live [--quick] [--davis] [--seconds S] [RATE...]
///
/// RATE in million events per second. Per rate: what was taken in, what was left out and how often, buffers lost, how
/// old the events were when they were decoded (median, worst), what decoding and finding lines cost, peak memory. The
/// exit code is 1 when an event is neither taken nor counted; speeds are for the reader.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "lecalib/host/cpu_clock.hpp"
#include "lecalib/host/heap_arena.hpp"
#include "lecalib/host/simulator.hpp"
#include "lecalib/pipeline/mono_calibrator.hpp"
#include "lecalib/usb/camera.hpp"
#include "lecalib/usb/live_decoder.hpp"
#include "support/box_stream.hpp"
#include "support/fake_evk4.hpp"
#include "support/fake_fx3.hpp"
#include "support/scripted_bus.hpp"

namespace {

using namespace lecalib;
using Clock = std::chrono::steady_clock;

struct Options {
  bool quick = false;
  bool davis = false;
  double seconds = 5;
  std::vector<double> rates;
};

/// A camera on a bus.
struct Bench {
  test::ScriptedBus bus;
  std::shared_ptr<test::FakeDevice> fake;
  double bytes_per_event = 0;
  SensorSize sensor;
};

struct Outcome {
  DecoderStats decoded;
  usb::LeftOut left_out;
  std::uint64_t taken = 0;
  std::uint64_t buffers_lost = 0;
  std::uint64_t decode_ns = 0, lines_ns = 0;
  std::uint64_t windows = 0, lines = 0;
  double seconds = 0;
  std::vector<double> age_ms;
};

/// A box before an EVK4, or in a quick run the shipped one.
std::vector<Event> box_before(SensorSize sensor, bool quick) {
  if (quick || sensor.width < 1280) return test::box_events(sensor);
  host::SimulatorOptions options;
  options.camera.width = sensor.width;
  options.camera.height = sensor.height;
  options.camera.fx = options.camera.fy = sensor.width;
  options.camera.cx = 0.5 * (sensor.width - 1);
  options.camera.cy = 0.5 * (sensor.height - 1);
  options.duration_s = 0.1;
  auto recording = host::simulate("box:0.40x0.30x0.25", options);
  if (!recording.ok()) throw std::runtime_error(recording.error().message);
  return std::move(recording).value().events;
}

Bench make_bench(const Options& options) {
  Bench bench;
  bench.sensor = options.davis ? SensorSize{346, 260} : SensorSize{1280, 720};
  const std::vector<Event> events = box_before(bench.sensor, options.quick);
  std::size_t count = 0;
  if (options.davis) {
    bench.fake = std::make_shared<test::FakeFx3>();
    count = test::repeat_as_davis(events, &bench.fake->stream);
  } else {
    bench.fake = std::make_shared<test::FakeEvk4>();
    count = test::repeat_as_evt3(events, bench.sensor, &bench.fake->stream);
  }
  bench.bytes_per_event = static_cast<double>(bench.fake->stream.recording.size()) / static_cast<double>(count);
  bench.bus.plug_in(bench.fake);
  return bench;
}

/// Gives events to the calibrator, which works on each window as soon as it is full.
void push_all(Span<const Event> events, MonoCalibrator* calibrator) {
  while (calibrator->push(&events) == Status::in_progress) {
    while (calibrator->step() == Status::in_progress) {
    }
  }
}

/// Reads until the stream has ended, and stops the camera once its time is over.
Outcome calibrate_live(const Bench& bench, double seconds, usb::Camera* camera, usb::StreamBuffer* ring,
                       MonoCalibrator* calibrator) {
  Outcome outcome;
  usb::LiveDecoder decoder;
  (void)decoder.begin(camera->file_header());
  const auto begin = Clock::now();
  const auto elapsed_s = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  double read_bytes = 0, read_buffers = 0;
  while (true) {
    usb::BufferRing::Buffer buffer;
    if (outcome.seconds == 0 && elapsed_s() >= seconds) {
      camera->stop();
      outcome.seconds = elapsed_s();
    }
    const auto wait = ring->read(std::chrono::milliseconds(50), &buffer);
    if (wait == usb::StreamBuffer::Wait::ended) break;
    if (wait == usb::StreamBuffer::Wait::nothing) continue;
    read_bytes += static_cast<double>(buffer.bytes.size());
    const double buffer_s = read_bytes / ++read_buffers / bench.fake->stream.bytes_per_s;
    outcome.age_ms.push_back(1e3 * buffer_s * static_cast<double>(1 + ring->waiting()));
    decoder.take(buffer, ring->waiting());
    Span<const Event> events;
    do {
      const std::uint64_t decode_begin = host::thread_cpu_ns();
      if (is_error(decoder.next(&events))) throw std::runtime_error(decoder.error().expected);
      const std::uint64_t lines_begin = host::thread_cpu_ns();
      outcome.decode_ns += lines_begin - decode_begin;
      if (decoder.has_gap()) (void)calibrator->cut();
      outcome.taken += events.size();
      push_all(events, calibrator);
      outcome.lines_ns += host::thread_cpu_ns() - lines_begin;
    } while (!events.empty());
  }
  outcome.decoded = decoder.stats();
  outcome.left_out = decoder.left_out();
  outcome.buffers_lost = ring->dropped() + decoder.left_out().buffers;
  outcome.windows = calibrator->stats().windows.windows;
  outcome.lines = calibrator->stats().lines;
  return outcome;
}

Outcome run(const Options& options, double rate_per_s) {
  Bench bench = make_bench(options);
  bench.fake->stream.bytes_per_s = rate_per_s * bench.bytes_per_event;
  auto camera = usb::open_camera(&bench.bus, "");
  if (!camera.ok()) throw std::runtime_error(camera.error().message);
  Capacities capacities;
  capacities.events_per_window = 400'000;
  capacities.sensor_width = bench.sensor.width;
  capacities.sensor_height = bench.sensor.height;
  const host::HeapArena memory(required_bytes(capacities));
  const host::Model model = host::make_target("box:0.40x0.30x0.25").value();
  MonoCalibrator calibrator;
  usb::StreamBuffer ring;
  if (is_error(calibrator.init(memory.memory(), capacities, {}, model.lines)) || is_error(ring.init({}))) {
    throw std::runtime_error("cannot start");
  }
  if (const auto error = camera.value()->start({}, &ring)) throw std::runtime_error(error->message);
  return calibrate_live(bench, options.seconds, camera.value().get(), &ring, &calibrator);
}

/// @return whether every event was taken or counted
bool print(double rate, Outcome outcome) {
  rusage usage{};
  (void)::getrusage(RUSAGE_SELF, &usage);
  std::sort(outcome.age_ms.begin(), outcome.age_ms.end());
  const auto age = [&](double share) {
    return outcome.age_ms[static_cast<std::size_t>(share * static_cast<double>(outcome.age_ms.size() - 1))];
  };
  const auto events = static_cast<double>(outcome.decoded.events);
  const auto taken = static_cast<double>(outcome.taken);
  std::printf("%8.1f %8.1f %8.1f %8.1f %8llu %8llu %8.0f %8.0f %8.1f %8.1f %8.0f %8llu %8llu\n", rate,
              1e-6 * events / outcome.seconds, 1e-6 * taken / outcome.seconds,
              100 * static_cast<double>(outcome.left_out.events) / events,
              static_cast<unsigned long long>(outcome.left_out.times),
              static_cast<unsigned long long>(outcome.buffers_lost), age(0.5), age(1),
              static_cast<double>(outcome.decode_ns) / events, static_cast<double>(outcome.lines_ns) / taken,
              static_cast<double>(usage.ru_maxrss) / 1024, static_cast<unsigned long long>(outcome.windows),
              static_cast<unsigned long long>(outcome.lines));
  std::fflush(stdout);
  return outcome.taken + outcome.left_out.events == outcome.decoded.events && outcome.taken > 0;
}

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--quick") == 0) {
      options.quick = true;
      options.seconds = 0.2;
    } else if (std::strcmp(argv[i], "--davis") == 0) {
      options.davis = true;
    } else if (std::strcmp(argv[i], "--seconds") == 0 && i + 1 < argc) {
      options.seconds = std::strtod(argv[++i], nullptr);
    } else {
      options.rates.push_back(std::strtod(argv[i], nullptr));
    }
  }
  if (options.rates.empty())
    options.rates = options.quick ? std::vector<double>{1, 50} : std::vector<double>{2, 10, 30};
  return options;
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  std::printf("%8s %8s %8s %8s %8s %8s %8s %8s %8s %8s %8s %8s %8s\n", "Mev/s", "came", "taken", "left %", "times",
              "lost", "age ms", "worst", "ns/dec.", "ns/line", "peak MB", "windows", "lines");
  bool is_right = true;
  for (const double rate : options.rates) is_right = print(rate, run(options, 1e6 * rate)) && is_right;
  return is_right ? 0 : 1;
}
