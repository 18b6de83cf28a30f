// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/mono_calibrator.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "support/alloc_counter.hpp"
#include "support/edge_stream.hpp"
#include "support/read_events.hpp"
#include "support/shared_data.hpp"

using namespace lecalib;

namespace {

/// The visible edges of a box 0.4 x 0.3 x 0.25 m, as in the simulated recordings.
const std::vector<ModelLine> kBox = {
    {{0, 0, 0}, {0.4, 0, 0}},       {{0, 0, 0}, {0, 0.3, 0}},           {{0, 0, 0}, {0, 0, 0.25}},
    {{0.4, 0, 0}, {0.4, 0, 0.25}},  {{0, 0.3, 0}, {0, 0.3, 0.25}},      {{0, 0, 0.25}, {0.4, 0, 0.25}},
    {{0, 0, 0.25}, {0, 0.3, 0.25}}, {{0.4, 0, 0.25}, {0.4, 0.3, 0.25}}, {{0, 0.3, 0.25}, {0.4, 0.3, 0.25}}};

constexpr Capacities small_capacities() {
  Capacities c;
  c.events_per_window = 20000;
  c.windows = 24;
  c.sensor_width = 346;
  c.sensor_height = 260;
  return c;
}

struct Memory {
  explicit Memory(std::size_t bytes) : block(bytes / sizeof(std::max_align_t) + 1), size(bytes) {}
  Span<std::byte> span() { return {reinterpret_cast<std::byte*>(block.data()), size}; }
  std::vector<std::max_align_t> block;
  std::size_t size;
};

/// Pushes everything and steps to the end, without touching the heap. @return what the last step() said
Status run(MonoCalibrator* calibrator, Span<const Event> events) {
  const test::AllocScope heap;
  while (calibrator->push(&events) == Status::in_progress) {
    while (calibrator->step() == Status::in_progress) {
    }
  }
  const Status hungry = calibrator->step();
  const Status finished = calibrator->finish();
  Status status = Status::in_progress;
  bool progress_grows = true;
  for (float progress = 0; status == Status::in_progress; progress = calibrator->progress()) {
    status = calibrator->step();
    progress_grows = progress_grows && calibrator->progress() >= progress;
  }
  const std::size_t allocations = heap.allocations();
  CHECK(hungry == Status::need_more_data);
  CHECK(finished == Status::ok);
  CHECK(progress_grows);
  CHECK((calibrator->progress() < 1) == (status != Status::ok));
  CHECK(allocations == 0);
  return status;
}

/// Noise events of a sensor that looks at nothing.
std::vector<Event> noise(std::size_t count) {
  Rng rng(3);
  std::vector<Event> events(count);
  for (std::size_t i = 0; i < count; ++i) {
    events[i].t_us = static_cast<std::int64_t>(50 * i);
    events[i].x = static_cast<std::uint16_t>(rng.below(346));
    events[i].y = static_cast<std::uint16_t>(rng.below(260));
    events[i].polarity = static_cast<std::uint8_t>(rng.below(2));
  }
  return events;
}

}  // namespace

TEST_CASE("a mono calibrator takes the memory that required_bytes() says, and not one byte less") {
  const Capacities c = small_capacities();
  constexpr std::size_t bytes = required_bytes(small_capacities());
  Memory memory(bytes);
  MonoCalibrator calibrator;
  CHECK(calibrator.init({memory.span().data(), bytes - 1}, c, {}, kBox) == Status::buffer_too_small);
  CHECK(calibrator.init(memory.span(), c, {}, kBox) == Status::ok);
}

TEST_CASE("a mono calibrator takes no more memory than the README says") {
  Capacities small;
  small.sensor_width = small.sensor_height = 320;
  small.events_per_window = 7000, small.lines_per_window = 24, small.windows = 16, small.model_lines = 16;
  small.edges = false;
  CHECK(required_bytes(small) <= 490'000);
  Capacities large;
  large.sensor_width = 640, large.sensor_height = 480;
  large.events_per_window = 20000, large.lines_per_window = 32, large.windows = 32, large.model_lines = 32;
  CHECK(required_bytes(large) <= 1'800'000);
  CHECK(required_bytes(Capacities{}) <= 8'300'000);
}

TEST_CASE("a mono calibrator refuses wrong arguments and calls out of turn") {
  const Capacities c = small_capacities();
  Memory memory(required_bytes(c));
  MonoCalibrator calibrator;
  Span<const Event> none;
  CalibrationResult result;
  CHECK(calibrator.push(&none) == Status::wrong_state);
  CHECK(calibrator.step() == Status::wrong_state);
  CHECK(calibrator.finish() == Status::wrong_state);
  CHECK(calibrator.result(&result) == Status::wrong_state);

  MonoOptions no_rounds;
  no_rounds.rounds = 0;
  CHECK(calibrator.init(memory.span(), c, no_rounds, kBox) == Status::invalid_argument);
  MonoOptions no_window;
  no_window.window.first_us = 0;
  CHECK(calibrator.init(memory.span(), c, no_window, kBox) == Status::invalid_argument);
  MonoOptions long_window;
  long_window.window.max_us = kLongestWindowUs + 1;
  CHECK(calibrator.init(memory.span(), c, long_window, kBox) == Status::invalid_argument);
  long_window.window.max_us = long_window.window.min_us - 1;
  CHECK(calibrator.init(memory.span(), c, long_window, kBox) == Status::invalid_argument);
  MonoOptions no_threshold;
  no_threshold.detector.crossings.threshold = 0;
  CHECK(calibrator.init(memory.span(), c, no_threshold, kBox) == Status::invalid_argument);
  MonoOptions far_view;
  far_view.matcher.hints.focal_px = 30.0 * c.sensor_width;
  CHECK(calibrator.init(memory.span(), c, far_view, kBox) == Status::invalid_argument);
  MonoOptions few_points;
  few_points.points.points_per_line = 2;
  CHECK(calibrator.init(memory.span(), c, few_points, kBox) == Status::invalid_argument);
  Capacities no_sensor = c;
  no_sensor.sensor_width = 0;
  CHECK(calibrator.init(memory.span(), no_sensor, {}, kBox) == Status::invalid_argument);
  // Each capacity at its ends and one beyond them, in memory that would hold it.
  const auto init_with = [](const Capacities& capacities) {
    Memory enough(required_bytes(capacities));
    MonoCalibrator other;
    return other.init(enough.span(), capacities, {}, kBox);
  };
  const auto check_range = [&](auto Capacities::*capacity, std::uint32_t first, std::uint32_t last) {
    CAPTURE(first);
    Capacities small = c;
    small.windows = 1;
    small.edges = false;
    using Number = std::remove_reference_t<decltype(small.*capacity)>;
    for (const std::uint32_t good : {first, last}) {
      small.*capacity = static_cast<Number>(good);
      CHECK(init_with(small) == Status::ok);
    }
    for (const std::uint32_t bad : {first - 1, last + 1}) {
      small.*capacity = static_cast<Number>(bad);
      CHECK(init_with(small) == Status::invalid_argument);
    }
  };
  check_range(&Capacities::lines_per_window, 1, kMaxLines);
  check_range(&Capacities::sensor_width, 2, 4096);
  check_range(&Capacities::sensor_height, 2, 4096);
  Capacities no_windows = c;
  no_windows.windows = 0;
  CHECK(init_with(no_windows) == Status::invalid_argument);
  Capacities one_event = c;
  one_event.events_per_window = 1;
  CHECK(init_with(one_event) == Status::invalid_argument);
  Capacities few_lines = c;
  few_lines.model_lines = 8;
  CHECK(calibrator.init(memory.span(), few_lines, {}, kBox) == Status::capacity_exceeded);
  CHECK(calibrator.init(memory.span(), c, {}, Span<const ModelLine>(kBox).first(3)) == Status::too_few_lines);
  MonoOptions many_points;
  many_points.points.points_per_line = c.points_per_line + 1;
  CHECK(calibrator.init(memory.span(), c, many_points, kBox) == Status::capacity_exceeded);
  MonoOptions reference;
  reference.detector.find_lines = reference_detector;
  CHECK(calibrator.init(memory.span(), c, reference, kBox) == Status::capacity_exceeded);
  Capacities with_reference = c;
  with_reference.reference_detector = true;
  Memory larger(required_bytes(with_reference));
  CHECK(calibrator.init(larger.span(), with_reference, reference, kBox) == Status::ok);

  REQUIRE(calibrator.init(memory.span(), c, {}, kBox) == Status::ok);
  CHECK(calibrator.result(&result) == Status::wrong_state);
  CHECK(calibrator.finish() == Status::ok);
  CHECK(calibrator.push(&none) == Status::wrong_state);
}

TEST_CASE("a mono calibrator's windows end at a cut, which waits for the one that is full") {
  Memory memory(required_bytes(small_capacities()));
  MonoCalibrator calibrator;
  CHECK(calibrator.cut() == Status::wrong_state);
  REQUIRE(calibrator.init(memory.span(), small_capacities(), {}, kBox) == Status::ok);
  CHECK(calibrator.cut() == Status::ok);
  const std::vector<Event> events = noise(300);  // 15 ms, the first window has 10
  Span<const Event> rest(events);
  REQUIRE(calibrator.push(&rest) == Status::in_progress);
  CHECK(calibrator.cut() == Status::in_progress);
  REQUIRE(calibrator.step() == Status::in_progress);
  REQUIRE(calibrator.push(&rest) == Status::ok);
  CHECK(calibrator.cut() == Status::ok);
  CHECK(calibrator.stats().windows.cut == 100);
  CHECK(calibrator.stats().windows.windows == 1);
  REQUIRE(calibrator.finish() == Status::ok);
  CHECK(calibrator.cut() == Status::wrong_state);
}

TEST_CASE("a mono calibrator finds the edges of a window that follows a cut in one that was thinned") {
  const test::SceneOptions scene;
  const std::vector<Event> events = test::events_of(test::StepEdge{}, scene, 0.24);
  Capacities c = small_capacities();
  c.events_per_window = static_cast<std::uint32_t>(events.size() + 2);
  Memory memory(required_bytes(c));
  MonoCalibrator calibrator;
  REQUIRE(calibrator.init(memory.span(), c, {}, kBox) == Status::ok);
  std::vector<Event> too_many;
  for (const Event& event : events) too_many.insert(too_many.end(), 3, event);
  Span<const Event> rest(too_many);
  REQUIRE(calibrator.push(&rest) == Status::ok);
  REQUIRE(calibrator.cut() == Status::ok);
  CHECK(calibrator.stats().windows.thinned > 0);
  rest = events;
  REQUIRE(calibrator.push(&rest) == Status::ok);
  REQUIRE(calibrator.close_window());
  LineWindow window;
  REQUIRE(calibrator.find_lines(&window) == Status::ok);
  REQUIRE(window.lines.size() > 0);
  CHECK(window.lines[0].edge.crossings > 0);
}

TEST_CASE("without events, or with noise alone, there is a reason and no camera") {
  const Capacities c = small_capacities();
  Memory memory(required_bytes(c));
  MonoCalibrator calibrator;
  CalibrationResult result;
  REQUIRE(calibrator.init(memory.span(), c, {}, kBox) == Status::ok);
  CHECK(run(&calibrator, {}) == Status::too_few_lines);
  CHECK(calibrator.result(&result) == Status::too_few_lines);

  REQUIRE(calibrator.init(memory.span(), c, {}, kBox) == Status::ok);
  CHECK(run(&calibrator, noise(20000)) == Status::no_match);
  CHECK(calibrator.phase() == MonoPhase::failed);
  CHECK(calibrator.progress() < 1);
}

TEST_CASE("a mono calibrator that refuses to start anew does not answer for what came before") {
  const Capacities c = small_capacities();
  Memory memory(required_bytes(c));
  MonoCalibrator calibrator;
  REQUIRE(calibrator.init(memory.span(), c, {}, kBox) == Status::ok);
  REQUIRE(run(&calibrator, {}) == Status::too_few_lines);
  CHECK(calibrator.init({memory.span().data(), required_bytes(c) - 1}, c, {}, kBox) == Status::buffer_too_small);
  CalibrationResult result;
  CHECK(calibrator.phase() == MonoPhase::idle);
  CHECK(calibrator.step() == Status::wrong_state);
  CHECK(calibrator.result(&result) == Status::wrong_state);
}

TEST_CASE("a recording of a box calibrates its camera without a hint, without the heap, with the same bits each time") {
  const auto data = test::shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const std::vector<Event> events = test::read_events(*data / "sim" / "02_box_davis346_sweep" / "events.raw");
  REQUIRE(events.size() == 574933);
  Capacities c = small_capacities();
  c.windows = 64;
  c.events_per_window = 60000;  // no window is thinned
  Memory memory(required_bytes(c));
  CalibrationResult first;
  for (int repeat = 0; repeat < 2; ++repeat) {
    std::memset(memory.span().data(), repeat == 0 ? 0x00 : 0xA5, memory.span().size());
    MonoCalibrator calibrator;
    REQUIRE(calibrator.init(memory.span(), c, {}, kBox) == Status::ok);
    REQUIRE(run(&calibrator, events) == Status::ok);
    CalibrationResult result;
    REQUIRE(calibrator.result(&result) == Status::ok);
    // truth.json: fx 300.88, fy 300.86, cx 189.64, cy 132.88. 4 sigma, and 2 % of f or 3 % of the image.
    const double truth[4] = {300.876, 300.855, 189.642, 132.878};
    for (std::size_t i = 0; i < 4; ++i) {
      const double error = std::abs(result.camera.*kIntrinsics[i] - truth[i]);
      CHECK(error < 4 * result.sigma[i]);
      CHECK(error < (i < 2 ? 0.02 * 300 : 0.03 * 346));
    }
    CHECK(calibrator.views().size() == result.views.size());
    CHECK(calibrator.stats().windows_matched >= 10);
    CHECK(calibrator.stats().edges_used);
    CHECK(std::abs(result.camera.fx - truth[0]) < 0.01 * truth[0]);
    if (repeat == 0) first = result;
    for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
      CHECK(result.camera.*kIntrinsics[i] == first.camera.*kIntrinsics[i]);
      CHECK(result.sigma[i] == first.sigma[i]);
    }
    CHECK(calibrator.init({memory.span().data(), 1}, c, {}, kBox) == Status::buffer_too_small);
    CHECK(calibrator.step() == Status::wrong_state);
    CHECK(calibrator.result(&result) == Status::wrong_state);
  }
}

TEST_CASE("the form that a wide lens sees is found wherever the recording begins") {
  const auto data = test::shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  // A sheet of A4 and the frame printed on it, through a lens that one coefficient leaves a pixel off.
  const std::vector<ModelLine> form = {{{0.0208, 0.1477, 0}, {0.1892, 0.1477, 0}},
                                       {{0.1892, 0.1477, 0}, {0.1892, 0.0258, 0}},
                                       {{0.1892, 0.0258, 0}, {0.0208, 0.0258, 0}},
                                       {{0.0208, 0.0258, 0}, {0.0208, 0.1477, 0}},
                                       {{0, 0, 0}, {0.21, 0, 0}},
                                       {{0.21, 0, 0}, {0.21, 0.297, 0}},
                                       {{0.21, 0.297, 0}, {0, 0.297, 0}},
                                       {{0, 0.297, 0}, {0, 0, 0}}};
  const std::vector<Event> events = test::read_events(*data / "sim" / "09_form_vga_wide_shake" / "events.raw");
  Capacities c = small_capacities();
  c.events_per_window = 400000;
  c.sensor_width = 640;
  c.sensor_height = 480;
  Memory memory(required_bytes(c));
  for (int ms = 0; ms <= 21; ms += 3) {
    CAPTURE(ms);
    std::size_t first = 0;
    while (events[first].t_us < events[0].t_us + 1000 * ms) ++first;
    MonoCalibrator calibrator;
    REQUIRE(calibrator.init(memory.span(), c, {}, form) == Status::ok);
    REQUIRE(run(&calibrator, Span<const Event>(events).subspan(first, events.size() - first)) == Status::ok);
    CalibrationResult result;
    REQUIRE(calibrator.result(&result) == Status::ok);
    CHECK(std::abs(result.camera.fx - 275.31) < 0.01 * 275.31);  // truth.json
  }
}
