// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/stereo_calibrator.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include "lecalib/math/so3.hpp"
#include "support/alloc_counter.hpp"
#include "support/guarded_arena.hpp"
#include "support/read_events.hpp"
#include "support/shared_data.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

constexpr Capacities kOne = [] {
  Capacities c;
  c.events_per_window = 20000;
  c.windows = 24;
  c.model_lines = 12;
  c.sensor_width = 346;
  c.sensor_height = 260;
  return c;
}();
constexpr StereoCapacities kBoth = {kOne, kOne};

/// Of a tenth of a second before a box.
std::vector<Event> shipped_events() { return test::read_events(test::source_dir() / "examples/data/events.raw"); }

/// A calibrator in memory that is as large as it says, between red zones.
struct Bench {
  std::vector<ModelLine> box = test::box_edges(0.4, 0.3, 0.25);
  test::GuardedArena memory{required_bytes(kBoth)};
  std::unique_ptr<StereoCalibrator> calibrator = std::make_unique<StereoCalibrator>();

  Status init(const StereoOptions& options = {}) { return calibrator->init(memory.memory(), kBoth, options, box); }

  /// Gives each camera its events as they are wanted, in pieces, without touching the heap.
  Status run(const std::vector<Event>& left, const std::vector<Event>& right, std::size_t piece) {
    Span<const Event> events[kStereoSides] = {left, right};
    const test::AllocScope heap;
    Status status = calibrator->step();
    while (status == Status::in_progress || status == Status::need_more_data) {
      if (status == Status::need_more_data) {
        const StereoSide side = calibrator->wanted();
        Span<const Event>& rest = events[static_cast<std::size_t>(side)];
        Span<const Event> some = rest.first(piece);
        const std::size_t given = some.size();
        const Status pushed = calibrator->push(side, &some);
        rest = rest.subspan(given - some.size());
        if (pushed == Status::ok && rest.empty()) (void)calibrator->finish(side);
      }
      status = calibrator->step();
    }
    const std::size_t allocations = heap.allocations();
    CHECK(allocations == 0);
    return status;
  }
};

TEST_CASE("stereo calibrator: one recording as both cameras', in pieces of any size, gives the same bits") {
  const std::vector<Event> events = shipped_events();
  StereoResult first;
  for (const std::size_t piece : {std::size_t{1000}, std::size_t{7777}, events.size()}) {
    Bench bench;
    REQUIRE(bench.init() == Status::ok);
    REQUIRE(bench.run(events, events, piece) == Status::ok);
    CHECK(bench.calibrator->progress() == 1);
    StereoResult result;
    REQUIRE(bench.calibrator->result(&result) == Status::ok);
    CHECK(result.left.status == Status::ok);
    CHECK(result.right.status == Status::ok);
    CHECK(result.instants >= 10);
    // Both saw the same, so what the cameras are is the same, and nothing is between them.
    CHECK(result.right.camera.fx == doctest::Approx(result.left.camera.fx).epsilon(1e-6));
    for (std::size_t i = 0; i < 6; ++i) {
      const auto k = static_cast<Eigen::Index>(i % 3);
      const double off = i < 3 ? so3_log(rotation_of(result.T_right_left))(k) : translation_of(result.T_right_left)(k);
      CHECK(std::abs(off) <= 0.01 * std::sqrt(result.covariance[7 * i]));
    }
    if (piece == 1000) first = result;
    CHECK(std::memcmp(&first.T_right_left, &result.T_right_left, sizeof(Pose)) == 0);
    CHECK(std::memcmp(first.covariance, result.covariance, sizeof result.covariance) == 0);
  }
}

TEST_CASE("stereo calibrator: a pair tells more of its cameras than each by itself") {
  const std::vector<Event> events = shipped_events();
  Bench bench;
  REQUIRE(bench.init() == Status::ok);
  REQUIRE(bench.run(events, events, 5000) == Status::ok);
  StereoResult together;
  REQUIRE(bench.calibrator->result(&together) == Status::ok);
  MonoOptions options;
  options.windows_on_grid = true;
  test::GuardedArena memory(required_bytes(kOne));
  const auto alone = std::make_unique<MonoCalibrator>();
  REQUIRE(alone->init(memory.memory(), kOne, options, bench.box) == Status::ok);
  Span<const Event> rest = events;
  while (alone->push(&rest) == Status::in_progress) {
    while (alone->step() == Status::in_progress) {
    }
  }
  (void)alone->finish();
  while (alone->step() == Status::in_progress) {
  }
  CalibrationResult single;
  REQUIRE(alone->result(&single) == Status::ok);
  for (const IntrinsicIndex i : {kFx, kFy}) CHECK(together.left.sigma[i] < single.sigma[i]);
}

TEST_CASE("stereo calibrator: windows stay paired where one camera begins late, pauses and ends early") {
  const std::vector<Event> events = shipped_events();
  const std::int64_t begin_us = events.front().t_us;
  std::vector<Event> part;
  for (const Event& event : events) {
    const std::int64_t t_us = event.t_us - begin_us;
    if (t_us >= 15'000 && t_us < 90'000 && (t_us < 40'000 || t_us >= 46'000)) part.push_back(event);
  }
  Bench bench;
  REQUIRE(bench.init() == Status::ok);
  REQUIRE(bench.run(events, part, 3000) == Status::ok);
  StereoResult result;
  REQUIRE(bench.calibrator->result(&result) == Status::ok);
  CHECK(result.instants >= 4);
  CHECK(so3_log(rotation_of(result.T_right_left)).norm() <= 0.01);
  CHECK(translation_of(result.T_right_left).norm() <= 0.01);
}

TEST_CASE("stereo calibrator: where both clocks are set back, as between recordings, windows stay paired") {
  const std::vector<Event> events = shipped_events();
  const auto middle = static_cast<std::ptrdiff_t>(events.size() / 2);
  // The left camera begins its first recording in the middle, the right one ends its first in the middle.
  std::vector<Event> left(events.begin() + middle / 2, events.end());
  std::vector<Event> right(events.begin(), events.begin() + middle + middle / 2);
  left.insert(left.end(), events.begin(), events.end());
  right.insert(right.end(), events.begin(), events.end());
  Bench bench;
  REQUIRE(bench.init() == Status::ok);
  REQUIRE(bench.run(left, right, 3000) == Status::ok);
  StereoResult result;
  REQUIRE(bench.calibrator->result(&result) == Status::ok);
  // Of both recordings: in each of the two series of times.
  const Span<const View> views = bench.calibrator->camera(StereoSide::left).views();
  CHECK(result.instants >= views.size() / 2);
  CHECK(so3_log(rotation_of(result.T_right_left)).norm() <= 0.01);
  CHECK(translation_of(result.T_right_left).norm() <= 0.01);
}

TEST_CASE("stereo calibrator: says how many instants did not agree, and an init() that fails leaves nothing behind") {
  const std::vector<Event> events = shipped_events();
  StereoOptions strict;
  strict.pose.agreement = -1;
  Bench bench;
  REQUIRE(bench.init(strict) == Status::ok);
  CHECK(bench.run(events, events, 5000) == Status::no_match);
  CHECK(bench.calibrator->failed_in() == StereoPhase::between);
  StereoResult result;
  CHECK(bench.calibrator->result(&result) == Status::no_match);
  CHECK(result.instants == 0);
  CHECK(result.disagreeing > 0);

  REQUIRE(bench.init() == Status::ok);
  REQUIRE(bench.run(events, events, 5000) == Status::ok);
  StereoOptions gyro;
  const GyroSample samples[1] = {};
  gyro.left.gyro_samples = samples;
  CHECK(bench.init(gyro) == Status::invalid_argument);
  CHECK(bench.calibrator->step() == Status::wrong_state);
  CHECK(bench.calibrator->result(&result) == Status::wrong_state);
}

TEST_CASE("stereo calibrator: refuses cameras whose clocks are apart, though their poses agree roughly") {
  const std::vector<Event> events = shipped_events();
  std::vector<Event> later = events;
  for (Event& event : later) event.t_us += 30'000;
  Bench bench;
  REQUIRE(bench.init() == Status::ok);
  CHECK(bench.run(events, later, 5000) == Status::implausible_result);
  CHECK(bench.calibrator->failed_in() == StereoPhase::between);
  StereoResult result;
  CHECK(bench.calibrator->result(&result) == Status::implausible_result);
  CHECK(result.tie_chi2_per_dof > 2);
  REQUIRE(bench.init() == Status::ok);
  REQUIRE(bench.run(events, events, 5000) == Status::ok);
  REQUIRE(bench.calibrator->result(&result) == Status::ok);
  CHECK(result.tie_chi2_per_dof < 1e-3);
}

TEST_CASE("stereo calibrator: refuses wrong arguments and calls out of turn") {
  Bench bench;
  StereoCalibrator& calibrator = *bench.calibrator;
  StereoResult result;
  Span<const Event> none;
  CHECK(calibrator.step() == Status::wrong_state);
  CHECK(calibrator.push(StereoSide::left, &none) == Status::wrong_state);
  CHECK(calibrator.finish(StereoSide::right) == Status::wrong_state);
  CHECK(calibrator.result(&result) == Status::wrong_state);

  const Span<std::byte> memory = bench.memory.memory();
  CHECK(calibrator.init({memory.data(), memory.size() - 1}, kBoth, {}, bench.box) == Status::buffer_too_small);
  StereoCapacities unlike = kBoth;
  unlike.right.windows = 8;
  CHECK(calibrator.init(memory, unlike, {}, bench.box) == Status::invalid_argument);
  StereoOptions gyro;
  const GyroSample samples[1] = {};
  gyro.right.gyro_samples = samples;
  CHECK(bench.init(gyro) == Status::invalid_argument);
  CHECK(calibrator.init(memory, kBoth, {}, {}) == Status::too_few_lines);

  REQUIRE(bench.init() == Status::ok);
  CHECK(calibrator.step() == Status::need_more_data);
  CHECK(calibrator.wanted() == StereoSide::left);
  REQUIRE(calibrator.finish(StereoSide::left) == Status::ok);
  CHECK(calibrator.wanted() == StereoSide::right);
  CHECK(calibrator.push(StereoSide::left, &none) == Status::wrong_state);
  REQUIRE(calibrator.finish(StereoSide::right) == Status::ok);
  Status status = Status::in_progress;
  while (status == Status::in_progress) status = calibrator.step();
  CHECK(status == Status::too_few_lines);
  CHECK(calibrator.failed_in() == StereoPhase::left);
  CHECK(calibrator.result(&result) == Status::too_few_lines);
}

}  // namespace
}  // namespace lecalib
