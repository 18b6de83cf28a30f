// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <vector>

#include "lecalib/core/arena.hpp"
#include "lecalib/planes/cloud.hpp"
#include "support/guarded_arena.hpp"
#include "support/moving_edges.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

struct Fixture {
  explicit Fixture(std::size_t events, std::uint16_t width = 346, std::uint16_t height = 260)
      : capacities{events, width, height}, memory(bytes()) {
    REQUIRE(carve(memory.arena(), capacities, &workspace));
    CHECK(memory.arena().peak() == bytes());
    options.width = width;
    options.height = height;
  }
  [[nodiscard]] std::size_t bytes() const {
    ArenaMeter meter;
    CloudWorkspace unused;
    (void)carve(meter, capacities, &unused);
    return meter.peak();
  }
  CloudCapacities capacities;
  GuardedArena memory;
  CloudWorkspace workspace;
  CloudOptions options;
  EventCloud cloud;
  CloudStats stats;
};

}  // namespace

TEST_CASE("cloud: every event stands in its own cell, with z = (t - begin) / c_z") {
  SceneOptions scene;
  scene.noise_events = 5000;
  const std::vector<Event> events = make_events({}, scene);
  Fixture f(events.size());
  f.options.c_z_us_per_px = 2500;
  REQUIRE(build_cloud(window_of(scene, events), f.options, f.workspace, &f.cloud, &f.stats) == Status::ok);
  CHECK(f.cloud.size() == events.size());
  CHECK(f.cloud.depth_px == doctest::Approx(4));
  CHECK(f.cloud.cols == 44);
  CHECK(f.cloud.rows == 33);

  std::vector<std::vector<float>> expected;
  for (const Event& e : events) {
    expected.push_back({static_cast<float>(e.polarity), static_cast<float>(e.x), static_cast<float>(e.y),
                        static_cast<float>(e.t_us - scene.begin_us) / 2500.0F});
  }
  std::vector<std::vector<float>> actual;
  for (std::uint32_t cell = 0; cell < 2 * f.cloud.cells(); ++cell) {
    for (std::uint32_t i = f.cloud.cell_start[cell]; i < f.cloud.cell_start[cell + 1]; ++i) {
      const auto in_image = cell % f.cloud.cells();
      CHECK(static_cast<std::uint32_t>(f.cloud.x[i]) / kCloudCellPx == in_image % f.cloud.cols);
      CHECK(static_cast<std::uint32_t>(f.cloud.y[i]) / kCloudCellPx == in_image / f.cloud.cols);
      CHECK(f.cloud.is_on(i) == (cell >= f.cloud.cells()));
      const Point3 p = f.cloud.point(i);
      actual.push_back({f.cloud.is_on(i) ? 1.0F : 0.0F, p.x, p.y, p.z});
    }
  }
  std::sort(expected.begin(), expected.end());
  std::sort(actual.begin(), actual.end());
  REQUIRE(actual.size() == expected.size());
  for (std::size_t i = 0; i < actual.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k)
      CHECK(actual[i][k] == doctest::Approx(expected[i][k]).epsilon(1e-4));  // a time unit is 1.5e-5 of the window
  }
}

TEST_CASE("cloud: automatic c_z makes every window equally deep") {
  for (const std::int64_t length_us : {500, 5000, 200000}) {
    SceneOptions scene;
    scene.length_us = length_us;
    scene.noise_events = 100;
    const std::vector<Event> events = make_events({}, scene);
    Fixture f(events.size());
    REQUIRE(build_cloud(window_of(scene, events), f.options, f.workspace, &f.cloud, &f.stats) == Status::ok);
    CHECK(f.cloud.depth_px == doctest::Approx(static_cast<double>(f.options.auto_depth_px)));
    for (std::size_t i = 0; i < f.cloud.size(); ++i) CHECK(f.cloud.z(i) <= f.cloud.depth_px);
  }
}

TEST_CASE("cloud: a window beyond the capacity is thinned evenly in time and counted") {
  SceneOptions scene;
  scene.noise_events = 10000;
  const std::vector<Event> events = make_events({}, scene);
  for (const std::size_t capacity : {events.size(), events.size() - 1, std::size_t{3000}, std::size_t{1}}) {
    Fixture f(capacity);
    REQUIRE(build_cloud(window_of(scene, events), f.options, f.workspace, &f.cloud, &f.stats) == Status::ok);
    CHECK(f.cloud.size() == capacity);
    CHECK(f.stats.thinned == events.size() - capacity);
    CHECK(double{f.cloud.kept_share} ==
          doctest::Approx(static_cast<double>(capacity) / static_cast<double>(events.size())));
    const auto early =
        std::count_if(f.cloud.t.begin(), f.cloud.t.end(), [](std::uint16_t t) { return t < kCloudTicks / 2; });
    if (capacity > 1)
      CHECK(static_cast<double>(early) / static_cast<double>(capacity) == doctest::Approx(0.5).epsilon(0.02));
  }
}

TEST_CASE("cloud: events outside of the sensor are dropped and counted, early ones stand at the begin") {
  const std::vector<Event> events = {{900, 5, 5, 1}, {1000, 346, 5, 1}, {1200, 5, 260, 0}, {1500, 345, 259, 0}};
  Fixture f(4);
  REQUIRE(build_cloud({1000, 2000, {events.data(), events.size()}}, f.options, f.workspace, &f.cloud, &f.stats) ==
          Status::ok);
  CHECK(f.stats.outside_sensor == 2);
  REQUIRE(f.cloud.size() == 2);
  CHECK(f.cloud.x[0] == 345);
  CHECK(f.cloud.z(0) == doctest::Approx(0.5 * static_cast<double>(f.cloud.depth_px)).epsilon(1e-4));
  CHECK(f.cloud.tau(0) == doctest::Approx(0).epsilon(1e-4));
  CHECK(f.cloud.z(1) == 0);
  CHECK(f.cloud.is_on(1));
}

TEST_CASE("cloud: times keep their place in windows of microseconds and of years") {
  for (std::int64_t length_us : {std::int64_t{3}, std::int64_t{10'000}, (std::int64_t{1} << 31) - 1,
                                 std::int64_t{1} << 31, std::int64_t{100'000'000'000'000}}) {
    std::vector<Event> events;
    for (int i = 0; i <= 4; ++i) events.push_back({7 + length_us * i / 4, 1, 1, 1});
    Fixture f(events.size());
    REQUIRE(build_cloud({7, 7 + length_us, {events.data(), events.size()}}, f.options, f.workspace, &f.cloud,
                        nullptr) == Status::ok);
    for (std::size_t i = 0; i < events.size(); ++i) {
      const double tau = 2 * static_cast<double>(events[i].t_us - 7) / static_cast<double>(length_us) - 1;
      CHECK(std::abs(double{EventCloud::tau_of(f.cloud.t[i])} - tau) < 1e-4);
    }
  }
}

TEST_CASE("cloud: the noise floor is the quiet cells' rate, edges or not") {
  SceneOptions scene;
  scene.noise_events = 40000;
  const std::vector<Event> noise = make_events({}, scene);
  const double rate = static_cast<double>(noise.size()) / (2.0 * scene.width * scene.height);
  scene.events_per_px = 40;
  const std::vector<Event> events = make_events({{{20, 30, 320, 60}, {25, 40, 325, 70}}}, scene);
  Fixture f(events.size());
  REQUIRE(build_cloud(window_of(scene, events), f.options, f.workspace, &f.cloud, &f.stats) == Status::ok);
  for (const float floor : f.cloud.noise_floor) CHECK(static_cast<double>(floor) == doctest::Approx(rate).epsilon(0.1));
}

TEST_CASE("cloud: arguments are checked, and an empty window is an empty cloud") {
  Fixture f(10);
  const auto build = [&](const EventWindow& window) {
    return build_cloud(window, f.options, f.workspace, &f.cloud, &f.stats);
  };
  CHECK(build({0, 1000, {}}) == Status::ok);
  CHECK(f.cloud.size() == 0);
  CHECK(build({1000, 1000, {}}) == Status::invalid_argument);
  constexpr std::int64_t kLast = std::numeric_limits<std::int64_t>::max();
  CHECK(build({0, kLast, {}}) == Status::ok);
  CHECK(build({-1, kLast, {}}) == Status::invalid_argument);
  CHECK(build({-kLast, kLast, {}}) == Status::invalid_argument);  // a signed difference would be -2
  f.options.auto_depth_px = 0;
  CHECK(build({0, 1000, {}}) == Status::invalid_argument);
  f.options.auto_depth_px = 8;
  f.options.c_z_us_per_px = std::numeric_limits<float>::infinity();
  CHECK(build({0, 1000, {}}) == Status::invalid_argument);
  f.options = {};
  CHECK(build({0, 1000, {}}) == Status::invalid_argument);
  f.options.width = 346;
  f.options.height = 269;  // one row of cells more than the workspace has
  CHECK(build({0, 1000, {}}) == Status::buffer_too_small);
  f.options.height = 260;
  f.workspace.x = {};
  CHECK(build({0, 1000, {}}) == Status::buffer_too_small);
}
