// SPDX-License-Identifier: MIT
// A recording of any content, from its bytes to a camera or a refusal, with capacities that are soon full.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "lecalib/pipeline/mono_calibrator.hpp"
#include "small_rectangle.hpp"

using namespace lecalib;
using namespace lecalib::fuzz;

namespace {

alignas(kArenaAlign) std::byte g_memory[required_bytes(kCapacities)];

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

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static MonoCalibrator calibrator;
  check(calibrator.init(g_memory, kCapacities, {}, kModel) == Status::ok);
  push_recording({data, size}, [](Span<const Event> events) { push_all(&calibrator, events); });
  check(calibrator.finish() == Status::ok);
  const Status status = run_steps(&calibrator);
  CalibrationResult result;
  check(calibrator.result(&result) == status);
  if (status == Status::ok) {
    for (std::size_t i = 0; i < kNumIntrinsics; ++i) check(std::isfinite(result.camera.*kIntrinsics[i]));
  }
  return 0;
}
