// SPDX-License-Identifier: MIT
// A recording of any content, from its bytes to a camera or a refusal, with capacities that are soon full.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "lecalib/events/event_stream.hpp"
#include "lecalib/pipeline/mono_calibrator.hpp"

using namespace lecalib;

namespace {

constexpr Capacities kCapacities = [] {
  Capacities capacities;
  capacities.events_per_window = 2000;
  capacities.lines_per_window = 12;
  capacities.windows = 12;
  capacities.model_lines = 4;
  capacities.sensor_width = 64;
  capacities.sensor_height = 48;
  return capacities;
}();

// A rectangle, metres.
constexpr ModelLine kModel[] = {{{-0.15, -0.1, 0}, {0.15, -0.1, 0}},
                                {{0.15, -0.1, 0}, {0.15, 0.1, 0}},
                                {{0.15, 0.1, 0}, {-0.15, 0.1, 0}},
                                {{-0.15, 0.1, 0}, {-0.15, -0.1, 0}}};

alignas(kArenaAlign) std::byte g_memory[required_bytes(kCapacities)];

// More than the stages' own limits allow for so small a problem: beyond it something runs in circles.
constexpr int kManySteps = 1000000;

void check(bool condition) {
  if (!condition) std::abort();
}

Status run_steps(MonoCalibrator* calibrator) {
  Status status = Status::in_progress;
  for (int steps = 0; status == Status::in_progress; ++steps) {
    check(steps < kManySteps);
    status = calibrator->step();
  }
  return status;
}

void push_all(MonoCalibrator* calibrator, Span<const Event> events) {
  while (calibrator->push(&events) == Status::in_progress) check(run_steps(calibrator) == Status::need_more_data);
  check(events.empty());
}

void push_recording(MonoCalibrator* calibrator, Span<const std::uint8_t> bytes) {
  EventStreamDecoder decoder;
  Event events[256];
  std::size_t count = 0;
  Status status = Status::ok;
  while (!bytes.empty() && !is_error(status)) {
    status = decoder.decode(&bytes, events, &count);
    push_all(calibrator, Span<const Event>(events, count));
  }
  (void)decoder.finish(events, &count);
  push_all(calibrator, Span<const Event>(events, count));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static MonoCalibrator calibrator;
  check(calibrator.init(g_memory, kCapacities, {}, kModel) == Status::ok);
  push_recording(&calibrator, {data, size});
  check(calibrator.finish() == Status::ok);
  const Status status = run_steps(&calibrator);
  CalibrationResult result;
  check(calibrator.result(&result) == status);
  if (status == Status::ok) {
    for (std::size_t i = 0; i < kNumIntrinsics; ++i) check(std::isfinite(result.camera.*kIntrinsics[i]));
  }
  return 0;
}
