// SPDX-License-Identifier: MIT
// Recordings of two cameras of any content. The first byte says in which turn the two halves of the rest are read: a
// bit for each of eight pieces.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "lecalib/pipeline/stereo_calibrator.hpp"
#include "small_rectangle.hpp"

using namespace lecalib;
using namespace lecalib::fuzz;

namespace {

constexpr StereoCapacities kBoth = {kCapacities, kCapacities};
alignas(kArenaAlign) std::byte g_memory[required_bytes(kBoth)];

/// Cameras that are hardly known are taken too, so that more recordings come to the two of them together.
StereoOptions undemanding() {
  StereoOptions options;
  options.left.solver.plausibility.max_focal_sigma = 10;
  options.right.solver.plausibility.max_focal_sigma = 10;
  return options;
}

/// Steps until the calibrator wants events or has ended. @return whether it wants some
bool run_steps(StereoCalibrator* calibrator, Status* status) {
  *status = Status::in_progress;
  for (int steps = 0; *status == Status::in_progress; ++steps) {
    check(steps < kManySteps);
    *status = calibrator->step();
  }
  return *status == Status::need_more_data;
}

/// @param order bit by bit, over and over: whether the left camera's events come before they are wanted
Status calibrate(StereoCalibrator* calibrator, Span<const Event> (&events)[kStereoSides], unsigned order) {
  Status status = Status::in_progress;
  for (unsigned turn = 0; run_steps(calibrator, &status); ++turn) {
    const StereoSide side = calibrator->wanted();
    const auto i = static_cast<std::size_t>(side);
    if ((order >> turn % 8U & 1U) != 0) (void)calibrator->push(StereoSide::left, &events[0]);
    if (calibrator->push(side, &events[i]) == Status::ok) {
      check(events[i].empty());
      check(calibrator->finish(side) == Status::ok);
    }
  }
  return status;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static StereoCalibrator calibrator;
  static std::vector<Event> recordings[kStereoSides];
  if (size == 0) return 0;
  const std::size_t half = size / 2;
  const Span<const std::uint8_t> bytes[kStereoSides] = {{data + 1, half}, {data + 1 + half, size - 1 - half}};
  Span<const Event> events[kStereoSides];
  for (std::size_t i = 0; i < kStereoSides; ++i) {
    recordings[i].clear();
    push_recording(
        bytes[i], [i](Span<const Event> some) { recordings[i].insert(recordings[i].end(), some.begin(), some.end()); });
    events[i] = recordings[i];
  }
  check(calibrator.init(g_memory, kBoth, undemanding(), kModel) == Status::ok);
  const Status status = calibrate(&calibrator, events, data[0]);
  StereoResult result;
  check(calibrator.result(&result) == status);
  if (status == Status::ok) {
    for (const double value : result.T_right_left.t) check(std::isfinite(value));
    for (std::size_t i = 0; i < 6; ++i) check(result.covariance[7 * i] >= 0);
  }
  return 0;
}
