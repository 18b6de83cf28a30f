// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <utility>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/events/noise_filter.hpp"
#include "support/alloc_counter.hpp"
#include "support/decode_pieces.hpp"
#include "support/guarded_arena.hpp"
#include "support/random_events.hpp"

namespace lecalib::test {
namespace {

constexpr std::uint16_t kWidth = 32;
constexpr std::uint16_t kHeight = 24;
constexpr std::int64_t kLength_us = 25'400;  // a tick is 100 us

/// All filters off.
NoiseFilterOptions no_filter() {
  NoiseFilterOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.flicker_periods = 0;
  options.hot_min_events = 0;
  options.min_neighbours = 0;
  return options;
}

struct Filtered {
  std::vector<Event> events;
  NoiseFilterStats stats;
};

/// In place, in a window that begins at begin_us.
Filtered filter(std::vector<Event> events, const NoiseFilterOptions& options, std::int64_t begin_us = 0) {
  ArenaMeter meter;
  NoiseFilterWorkspace workspace;
  REQUIRE(carve(meter, NoiseFilterCapacities{kWidth, kHeight}, &workspace));
  GuardedArena memory(meter.peak());
  REQUIRE(carve(memory.arena(), NoiseFilterCapacities{kWidth, kHeight}, &workspace));
  EventWindow window;
  Filtered filtered;
  const AllocScope heap;
  const Status status = filter_noise({begin_us, begin_us + kLength_us, Span<const Event>(events)}, options, &workspace,
                                     events, &window, &filtered.stats);
  const std::size_t allocations = heap.allocations();
  REQUIRE(status == Status::ok);
  CHECK(allocations == 0);
  CHECK(window.begin_us == begin_us);
  CHECK(window.end_us == begin_us + kLength_us);
  filtered.events.assign(window.events.begin(), window.events.end());
  const NoiseFilterStats& stats = filtered.stats;
  CHECK(stats.events == stats.kept + stats.outside + stats.flicker + stats.hot + stats.refractory + stats.isolated);
  CHECK(stats.kept == filtered.events.size());
  return filtered;
}

TEST_CASE("noise: with all filters off only events beside the sensor go") {
  const Filtered filtered =
      filter({{0, 31, 23, 1}, {1, 32, 0, 1}, {2, 0, 24, 0}, {3, 65535, 65535, 0}, {4, 0, 0, 0}}, no_filter());
  CHECK(filtered.events == std::vector<Event>{{0, 31, 23, 1}, {4, 0, 0, 0}});
  CHECK(filtered.stats.outside == 3);
}

TEST_CASE("noise: a hot pixel goes, whatever its polarities; busy neighbours save it") {
  NoiseFilterOptions options = no_filter();
  options.hot_min_events = 6;
  options.hot_ratio = 3;
  std::vector<Event> events;
  for (std::uint8_t i = 0; i < 10; ++i) {
    events.push_back({100 * i, 5, 5, static_cast<std::uint8_t>(i % 2)});  // hot
    events.push_back({100 * i, 20, 20, 1});                               // as often, with a neighbour of 4
    if (i < 4) events.push_back({100 * i, 21, 21, 0});
    if (i < 5) events.push_back({100 * i, 0, 0, 1});  // not often enough
    if (i < 3) events.push_back({100 * i, 6, 4, 1});  // the hot one's neighbour
  }
  const Filtered filtered = filter(events, options);
  CHECK(filtered.stats.hot == 10);
  for (const Event& event : filtered.events) CHECK_FALSE(event == Event{event.t_us, 5, 5, event.polarity});
  options.hot_ratio = 4;
  CHECK(filter(events, options).stats.hot == 0);
}

TEST_CASE("noise: more events than a count holds are hot all the same") {
  NoiseFilterOptions options = no_filter();
  options.hot_min_events = 255;
  CHECK(filter(std::vector<Event>(254, Event{5, 1, 1, 1}), options).stats.hot == 0);
  CHECK(filter(std::vector<Event>(1000, Event{5, 1, 1, 1}), options).stats.hot == 1000);
}

TEST_CASE("noise: within the refractory time a pixel's next events go") {
  NoiseFilterOptions options = no_filter();
  options.refractory_us = 1000;
  const Filtered filtered =
      filter({{0, 1, 1, 1}, {500, 1, 1, 0}, {600, 2, 1, 0}, {950, 1, 1, 1}, {1050, 1, 1, 1}, {1900, 1, 1, 1}}, options);
  CHECK(filtered.events == std::vector<Event>{{0, 1, 1, 1}, {600, 2, 1, 0}, {1050, 1, 1, 1}});
  CHECK(filtered.stats.refractory == 3);
}

/// Random events amid ticks of 100 us, so that rounding to ticks moves no difference over a limit.
std::vector<Event> random_window(Rng* rng, std::size_t count, std::uint32_t max_step_us, std::int64_t begin_us,
                                 std::uint16_t width, std::uint16_t height) {
  std::vector<Event> events = random_events(rng, count, begin_us, max_step_us, width, height);
  while (events.back().t_us >= begin_us + kLength_us) events.pop_back();
  for (Event& event : events) event.t_us = begin_us + (event.t_us - begin_us) / 100 * 100 + 50;
  return events;
}

TEST_CASE("noise: hot pixels go as brute force says") {
  Rng rng(7);
  for (const std::uint8_t min_events : {std::uint8_t{2}, std::uint8_t{5}, std::uint8_t{255}}) {
    for (const std::uint8_t ratio : {std::uint8_t{1}, std::uint8_t{3}}) {
      NoiseFilterOptions options = no_filter();
      options.hot_min_events = min_events;
      options.hot_ratio = ratio;
      std::vector<Event> events = random_window(&rng, 1500, 30, -900, 12, 9);
      for (std::size_t i = 0; i < 300; ++i) events.push_back(Event{20'000, 11, static_cast<std::uint16_t>(i % 2), 1});
      const auto count_at = [&](int x, int y) {
        return std::min<std::ptrdiff_t>(
            255, std::count_if(events.begin(), events.end(), [&](const Event& e) { return e.x == x && e.y == y; }));
      };
      std::vector<Event> expected;
      for (const Event& event : events) {
        std::ptrdiff_t busiest = 0;
        for (int dy = -1; dy <= 1; ++dy) {
          for (int dx = -1; dx <= 1; ++dx) {
            if (dx != 0 || dy != 0) busiest = std::max(busiest, count_at(event.x + dx, event.y + dy));
          }
        }
        const std::ptrdiff_t count = count_at(event.x, event.y);
        if (count < min_events || count <= ratio * busiest) expected.push_back(event);
      }
      const Filtered filtered = filter(events, options, -900);
      CHECK(filtered.events == expected);
      CHECK(filtered.stats.hot == events.size() - expected.size());
    }
  }
}

TEST_CASE("noise: events within the refractory time go as brute force says") {
  Rng rng(8);
  for (const std::int64_t refractory_us : {1, 100, 700, 5000, 25'400}) {
    NoiseFilterOptions options = no_filter();
    options.refractory_us = refractory_us;
    const std::vector<Event> events = random_window(&rng, 2000, 25, 777, 10, 8);
    // An option below a tick counts as one, and so do differences.
    const std::int64_t limit_us = std::max<std::int64_t>(refractory_us, 100);
    std::vector<Event> expected;
    for (const Event& event : events) {
      const bool is_late = std::none_of(expected.begin(), expected.end(), [&](const Event& e) {
        return e.x == event.x && e.y == event.y && event.t_us - e.t_us < limit_us;
      });
      if (is_late) expected.push_back(event);
    }
    CAPTURE(refractory_us);
    const Filtered filtered = filter(events, options, 777);
    CHECK(filtered.events == expected);
    CHECK(filtered.stats.refractory == events.size() - expected.size());
  }
}

TEST_CASE("noise: the refractory time holds from the window's first event to its last, and ends with it") {
  NoiseFilterOptions options = no_filter();
  options.refractory_us = kLength_us;
  const std::vector<Event> events{{-50, 3, 3, 1}, {0, 4, 3, 1}, {kLength_us - 1, 3, 3, 0}, {kLength_us - 1, 4, 3, 0}};
  CHECK(filter(events, options).events == std::vector<Event>{events[0], events[1]});
  // In the next window the same pixels may fire at once.
  const std::vector<Event> next{{kLength_us, 3, 3, 1}, {kLength_us, 3, 3, 1}, {2 * kLength_us - 1, 3, 3, 1}};
  CHECK(filter(next, options, kLength_us).events == std::vector<Event>{next[0]});
}

TEST_CASE("noise: filters leave polarities as they are and judge both alike") {
  Rng rng(10);
  NoiseFilterOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.refractory_us = 300;
  std::vector<Event> events = random_window(&rng, 1500, 30, 0, kWidth, kHeight);
  const std::vector<Event> kept = filter(events, options).events;
  CHECK(kept.size() > 100);
  CHECK(kept.size() < events.size());
  for (Event& event : events) event.polarity ^= 1U;
  std::vector<Event> mirrored = filter(events, options).events;
  for (Event& event : mirrored) event.polarity ^= 1U;
  CHECK(mirrored == kept);
}

TEST_CASE("noise: flicker is dropped first, is counted and remembered from window to window") {
  NoiseFilterOptions options = no_filter();
  options.flicker_periods = 6;
  ArenaMeter meter;
  NoiseFilterWorkspace workspace;
  REQUIRE(carve(meter, NoiseFilterCapacities{kWidth, kHeight}, &workspace));
  GuardedArena memory(meter.peak());
  REQUIRE(carve(memory.arena(), NoiseFilterCapacities{kWidth, kHeight}, &workspace));
  NoiseFilterStats stats;
  for (std::int64_t begin_us = 0; begin_us < 1'000'000; begin_us += 5000) {
    std::vector<Event> events{{begin_us, kWidth, 0, 1}};
    for (std::uint16_t y = 0; y < kHeight; ++y) {
      for (std::uint16_t x = 0; x < kWidth; ++x) {
        events.push_back({begin_us + 500, x, y, static_cast<std::uint8_t>(begin_us / 5000 % 2)});
      }
    }
    EventWindow filtered;
    REQUIRE(filter_noise({begin_us, begin_us + 5000, Span<const Event>(events)}, options, &workspace, events, &filtered,
                         &stats) == Status::ok);
  }
  CHECK(stats.outside == 200);
  CHECK(stats.events == stats.kept + stats.outside + stats.flicker);
  CHECK(stats.flicker > (stats.events - stats.outside) * 9 / 10);
}

/// The definition, pair by pair; times that lie within a tick of the limit are left out of the comparison.
bool has_support(const std::vector<Event>& events, std::size_t i, const NoiseFilterOptions& options,
                 std::int64_t support_us) {
  const auto count = [&](int direction) {
    unsigned neighbours = 0;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (dx == 0 && dy == 0) continue;
        for (std::size_t j = i; j < events.size(); j += static_cast<std::size_t>(direction)) {  // -1 ends by wrapping
          const bool is_there = events[j].x == events[i].x + dx && events[j].y == events[i].y + dy;
          if (!is_there) continue;
          if (std::abs(events[j].t_us - events[i].t_us) <= support_us) ++neighbours;
          break;
        }
      }
    }
    return neighbours >= options.min_neighbours;
  };
  return count(1) || count(-1);
}

TEST_CASE("noise: isolated events go as brute force says") {
  Rng rng(9);
  for (const std::uint8_t min_neighbours : {std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{3}}) {
    for (const std::int64_t support_us : {400, 3000, 0}) {
      NoiseFilterOptions options = no_filter();
      options.min_neighbours = min_neighbours;
      options.support_us = support_us;
      const std::vector<Event> events = random_window(&rng, 600, 80, -12'000, kWidth, kHeight);
      std::vector<Event> expected;
      const std::int64_t limit_us = support_us > 0 ? support_us : kLength_us / 2;
      for (std::size_t i = 0; i < events.size(); ++i) {
        if (has_support(events, i, options, limit_us)) expected.push_back(events[i]);
      }
      CAPTURE(support_us);
      const Filtered filtered = filter(events, options, -12'000);
      CHECK(filtered.events == expected);
      CHECK(filtered.stats.isolated == events.size() - expected.size());
    }
  }
}

TEST_CASE("noise: a thin slow edge stays whole from the window's first event on, sparse noise goes") {
  NoiseFilterOptions options;
  options.width = kWidth;
  options.height = kHeight;
  std::vector<Event> edge;
  // A diagonal, one pixel thin, that moves by two pixels in the window; each pixel fires once, with some jitter.
  for (std::uint16_t y = 0; y < 20; ++y) {
    for (std::uint16_t step = 0; step < 2; ++step) {
      edge.push_back({y * 37 % 20 * 100 + step * kLength_us / 2, static_cast<std::uint16_t>(y + step), y, 1});
    }
  }
  std::vector<Event> events = edge;
  for (std::uint16_t i = 0; i < 8; ++i) events.push_back({3000 * i, static_cast<std::uint16_t>(4 * i), 23, 0});
  const auto is_earlier = [](const Event& a, const Event& b) { return a.t_us < b.t_us; };
  std::sort(edge.begin(), edge.end(), is_earlier);
  std::sort(events.begin(), events.end(), is_earlier);
  const Filtered filtered = filter(events, options);
  CHECK(filtered.events == edge);
  CHECK(filtered.stats.isolated == 8);
}

TEST_CASE("noise: options and memory are checked") {
  std::vector<Event> events{{0, 0, 0, 1}};
  std::vector<std::uint8_t> pixels((kWidth + 2) * (kHeight + 2));
  NoiseFilterWorkspace workspace;
  workspace.pixels = pixels;
  NoiseFilterStats stats;
  EventWindow window{7, 8, {}};
  const EventWindow input{0, 1, Span<const Event>(events)};
  const auto run = [&](const NoiseFilterOptions& options) {
    return filter_noise(input, options, &workspace, events, &window, &stats);
  };
  CHECK(run(no_filter()) == Status::ok);
  const auto broken = [](auto change) {
    NoiseFilterOptions options = no_filter();
    change(&options);
    return options;
  };
  window = {7, 8, {}};
  CHECK(run(broken([](auto* o) { o->width = 0; })) == Status::invalid_argument);
  CHECK(run(broken([](auto* o) { o->height = 0; })) == Status::invalid_argument);
  CHECK(run(broken([](auto* o) { o->hot_ratio = 0; })) == Status::invalid_argument);
  CHECK(run(broken([](auto* o) { o->refractory_us = -1; })) == Status::invalid_argument);
  CHECK(run(broken([](auto* o) { o->support_us = -1; })) == Status::invalid_argument);
  CHECK(run(broken([](auto* o) { o->min_neighbours = 9; })) == Status::invalid_argument);
  CHECK(run(broken([](auto* o) { o->flicker_periods = 9; })) == Status::invalid_argument);
  CHECK(run(broken([](auto* o) { o->flicker_periods = 1; })) == Status::buffer_too_small);  // no memory for it
  CHECK(filter_noise({1, 0, {}}, no_filter(), &workspace, events, &window, &stats) == Status::invalid_argument);
  CHECK(filter_noise(input, no_filter(), &workspace, {}, &window, &stats) == Status::buffer_too_small);
  workspace.pixels = workspace.pixels.first(pixels.size() - 1);
  CHECK(run(no_filter()) == Status::buffer_too_small);
  CHECK(window.begin_us == 7);
  CHECK(stats.events == 1);
}

TEST_CASE("noise: memory is carved to the byte, with and without the flicker filter") {
  for (const bool flicker : {false, true}) {
    const NoiseFilterCapacities capacities{kWidth, kHeight, flicker};
    ArenaMeter meter;
    NoiseFilterWorkspace workspace;
    REQUIRE(carve(meter, capacities, &workspace));
    CHECK(meter.peak() == 34U * 26U + (flicker ? 136U + 32U * 24U : 0U));
    GuardedArena exact(meter.peak());
    CHECK(carve(exact.arena(), capacities, &workspace));
    CHECK(workspace.flicker.holds(kWidth, kHeight) == flicker);
    GuardedArena short_of_one(meter.peak() - 1);
    CHECK_FALSE(carve(short_of_one.arena(), capacities, &workspace));
  }
}

TEST_CASE("noise: times far beside the window, and windows of any length, do no harm") {
  constexpr std::int64_t kMin = INT64_MIN;
  constexpr std::int64_t kMax = INT64_MAX;
  NoiseFilterOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.refractory_us = kMax;
  options.support_us = kMax;
  ArenaMeter meter;
  NoiseFilterWorkspace workspace;
  REQUIRE(carve(meter, NoiseFilterCapacities{kWidth, kHeight}, &workspace));
  GuardedArena memory(meter.peak());
  REQUIRE(carve(memory.arena(), NoiseFilterCapacities{kWidth, kHeight}, &workspace));
  for (const auto& [begin_us, end_us] :
       {std::pair{kMin, kMax}, {std::int64_t{0}, std::int64_t{0}}, {kMin, kMin}, {std::int64_t{5}, std::int64_t{6}}}) {
    std::vector<Event> events{{kMin, 0, 0, 1}, {0, 1, 1, 1}, {kMax, 1, 1, 1}, {kMax, 2, 2, 0}};
    EventWindow window;
    NoiseFilterStats stats;
    CHECK(filter_noise({begin_us, end_us, Span<const Event>(events)}, options, &workspace, events, &window, &stats) ==
          Status::ok);
    CHECK(stats.events == 4);
  }
}

}  // namespace
}  // namespace lecalib::test
