// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cstddef>
#include <string>
#include <vector>

#include "c/run_in_c.h"
#include "lecalib/pipeline/mono_calibrator.hpp"
#include "support/alloc_counter.hpp"
#include "support/read_events.hpp"
#include "support/shared_data.hpp"

using namespace lecalib;

namespace {

constexpr lecalib_capacities kCapacities = {320, 320, 20000, 24, 16, 16, false};

constexpr lecalib_model_line kBox[] = {
    {{0, 0, 0}, {0.4, 0, 0}},  {{0, 0, 0.25}, {0.4, 0, 0.25}}, {{0, 0.3, 0.25}, {0.4, 0.3, 0.25}},
    {{0, 0, 0}, {0, 0.3, 0}},  {{0, 0, 0.25}, {0, 0.3, 0.25}}, {{0.4, 0, 0.25}, {0.4, 0.3, 0.25}},
    {{0, 0, 0}, {0, 0, 0.25}}, {{0.4, 0, 0}, {0.4, 0, 0.25}},  {{0, 0.3, 0}, {0, 0.3, 0.25}}};

/// The events of the firmware example's recording.
std::vector<Event> clip_events() { return test::read_events(test::source_dir() / "examples/firmware/clip.raw"); }

std::vector<lecalib_event> in_c(const std::vector<Event>& events) {
  std::vector<lecalib_event> out;
  for (const Event& event : events) out.push_back({event.t_us, event.x, event.y, event.polarity});
  return out;
}

struct Outcome {
  Status status = Status::in_progress;
  CalibrationResult result;
  std::size_t views = 0;
  CoverageHint hint = CoverageHint::none;
};

/// The same by the C++ interface.
Outcome run_in_cpp(const std::vector<Event>& events) {
  Capacities c;
  c.sensor_width = c.sensor_height = 320;
  c.events_per_window = 20000, c.lines_per_window = 24, c.windows = 16, c.model_lines = 16;
  c.edges = false;
  std::vector<ModelLine> model;
  for (const lecalib_model_line& line : kBox) {
    model.push_back({{line.p[0], line.p[1], line.p[2]}, {line.q[0], line.q[1], line.q[2]}});
  }
  std::vector<std::max_align_t> memory(required_bytes(c) / sizeof(std::max_align_t) + 1);
  MonoCalibrator calibrator;
  REQUIRE(calibrator.init({reinterpret_cast<std::byte*>(memory.data()), memory.size() * sizeof(std::max_align_t)}, c,
                          {}, model) == Status::ok);
  Span<const Event> rest(events);
  while (calibrator.push(&rest) == Status::in_progress) {
    while (calibrator.step() == Status::in_progress) {
    }
  }
  REQUIRE(calibrator.finish() == Status::ok);
  while (calibrator.step() == Status::in_progress) {
  }
  Outcome out;
  out.status = calibrator.result(&out.result);
  out.views = out.result.views.size();
  out.result.views = {};
  out.hint = calibrator.coverage().hints[0];
  return out;
}

}  // namespace

TEST_CASE("c interface: a program in C gets the same camera as one in C++, without heap") {
  const std::vector<Event> events = clip_events();
  const std::vector<lecalib_event> c_events = in_c(events);
  const std::size_t bytes = lecalib_required_bytes(&kCapacities);
  std::vector<std::max_align_t> memory(bytes / sizeof(std::max_align_t) + 1);
  lecalib_camera camera{};
  lecalib_calibrator* calibrator = nullptr;
  const test::AllocScope heap;
  const lecalib_status status = run_in_c(memory.data(), bytes, &kCapacities, kBox, std::size(kBox), c_events.data(),
                                         c_events.size(), &calibrator, &camera);
  const std::size_t allocations = heap.allocations();
  CHECK(allocations == 0);
  const Outcome expected = run_in_cpp(events);
  CHECK(status == static_cast<lecalib_status>(expected.status));
  CHECK(expected.status == Status::ok);
  CHECK(lecalib_progress(calibrator) == 1);
  CHECK(expected.hint != CoverageHint::none);
  CHECK(lecalib_hint(calibrator) == static_cast<lecalib_coverage_hint>(expected.hint));
  CHECK(camera.views == expected.views);
  CHECK(camera.rms_px == expected.result.rms_px);
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    CHECK(camera.intrinsics[i] == expected.result.camera.*kIntrinsics[i]);
    CHECK(camera.sigma[i] == expected.result.sigma[i]);
  }
}

TEST_CASE("c interface: too little memory and calls out of turn are told by their status") {
  const std::size_t bytes = lecalib_required_bytes(&kCapacities);
  std::vector<std::max_align_t> memory(bytes / sizeof(std::max_align_t) + 1);
  lecalib_calibrator* calibrator = nullptr;
  for (const std::size_t too_few : {std::size_t{16}, bytes - 1}) {
    const lecalib_status status =
        lecalib_init(memory.data(), too_few, &kCapacities, kBox, std::size(kBox), &calibrator);
    CHECK(status == LECALIB_BUFFER_TOO_SMALL);
    CHECK(calibrator == nullptr);
  }
  char* const odd = reinterpret_cast<char*>(memory.data()) + 1;
  CHECK(lecalib_init(odd, bytes - 1, &kCapacities, kBox, std::size(kBox), &calibrator) == LECALIB_BUFFER_TOO_SMALL);
  REQUIRE(lecalib_init(memory.data(), bytes, &kCapacities, kBox, std::size(kBox), &calibrator) == LECALIB_OK);
  CHECK(lecalib_step(calibrator) == LECALIB_NEED_MORE_DATA);
  lecalib_camera camera{};
  CHECK(lecalib_result(calibrator, &camera) == LECALIB_WRONG_STATE);
  CHECK(lecalib_progress(calibrator) == 0);
  CHECK(lecalib_hint(calibrator) == LECALIB_HINT_NONE);
  CHECK(lecalib_finish(calibrator) == LECALIB_OK);
  CHECK(lecalib_step(calibrator) == LECALIB_TOO_FEW_LINES);
}

TEST_CASE("c interface: statuses and hints have the names that they have in C++") {
  CHECK(lecalib_status_name(LECALIB_TOO_FEW_LINES) == std::string(to_string(Status::too_few_lines)));
  CHECK(lecalib_hint_name(LECALIB_HINT_FILL_LEFT) == std::string(to_string(CoverageHint::fill_left)));
}
