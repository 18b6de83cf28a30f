// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "lecalib/events/window_builder.hpp"
#include "support/alloc_counter.hpp"
#include "support/decode_pieces.hpp"
#include "support/random_events.hpp"

namespace lecalib::test {
namespace {

struct Window {
  std::int64_t begin_us;
  std::int64_t end_us;
  std::vector<Event> events;
};

bool operator==(const Window& a, const Window& b) {
  return a.begin_us == b.begin_us && a.end_us == b.end_us && a.events == b.events;
}

Window copy(const EventWindow& window) {
  return {window.begin_us, window.end_us, {window.events.begin(), window.events.end()}};
}

std::vector<Window> build(WindowBuilder* builder, const std::vector<Event>& events, std::size_t piece_size) {
  std::vector<Window> windows;
  EventWindow window;
  for (std::size_t first = 0; first < events.size(); first += piece_size) {
    Span<const Event> piece = Span<const Event>(events).subspan(first, piece_size);
    while (builder->push(&piece, &window) == Status::ok) windows.push_back(copy(window));
    CHECK(piece.empty());
  }
  if (builder->finish(&window) == Status::ok) windows.push_back(copy(window));
  CHECK(builder->finish(&window) == Status::need_more_data);
  return windows;
}

/// The same, event by event with all of them at hand; events in order of time.
std::vector<Window> build_by_definition(const std::vector<Event>& events, std::int64_t length_us,
                                        std::uint64_t max_events) {
  std::vector<Window> windows;
  std::int64_t begin_us = events.front().t_us;
  for (std::size_t i = 0; i < events.size();) {
    if (length_us == 0 && windows.empty() == false) begin_us = events[i].t_us;
    while (length_us > 0 && begin_us + length_us <= events[i].t_us) begin_us += length_us;
    Window window{begin_us, 0, {}};
    const auto is_inside = [&](const Event& event) {
      const bool in_time = length_us == 0 || event.t_us < begin_us + length_us;
      const bool in_count =
          max_events == 0 || window.events.size() < max_events || event.t_us == window.events.back().t_us;
      return in_time && in_count;
    };
    for (; i < events.size() && is_inside(events[i]); ++i) window.events.push_back(events[i]);
    const bool by_time = length_us > 0 && i < events.size() && events[i].t_us >= begin_us + length_us;
    window.end_us = by_time ? begin_us + length_us : window.events.back().t_us + 1;
    begin_us = window.end_us;
    windows.push_back(window);
  }
  return windows;
}

std::vector<Event> at_times(const std::vector<std::int64_t>& times) {
  std::vector<Event> events;
  for (const std::int64_t t_us : times) events.push_back({t_us, 0, 0, 0});
  return events;
}

TEST_CASE("windows: by time, by count and by both, as brute force cuts them, in pieces of any size") {
  Rng rng(1);
  const std::vector<Event> events = random_events(&rng, 3000, -5000, 150, 100, 100);
  std::vector<Event> storage(4000);
  for (const std::int64_t length_us : {0, 1, 70, 1000, 100'000'000}) {
    for (const std::uint64_t max_events : {0U, 1U, 33U, 5000U}) {
      if (length_us == 0 && max_events == 0) continue;
      const std::vector<Window> expected = build_by_definition(events, length_us, max_events);
      for (const std::size_t piece_size : {1U, 7U, 3000U}) {
        WindowBuilder builder;
        REQUIRE(builder.init({length_us, max_events, 0}, storage) == Status::ok);
        CHECK(build(&builder, events, piece_size) == expected);
        CHECK(builder.stats().windows == expected.size());
        CHECK(builder.stats().events == events.size());
        CHECK(builder.stats().thinned == 0);
      }
    }
  }
}

TEST_CASE("windows: a long gap is passed over at once, in rhythm") {
  std::vector<Event> storage(8);
  WindowBuilder builder;
  REQUIRE(builder.init({10, 0, 0}, storage) == Status::ok);
  const std::int64_t far = 4'000'000'000'000'000'003;
  const std::vector<Window> windows = build(&builder, at_times({0, 9, 10, 55, far}), 5);
  REQUIRE(windows.size() == 4);
  CHECK(windows[1].begin_us == 10);
  CHECK(windows[2].begin_us == 50);
  CHECK(windows[3].begin_us == far - 3);
  CHECK(builder.stats().empty_windows == 3 + static_cast<std::uint64_t>((far - 3 - 60) / 10));
}

TEST_CASE("windows: on a grid those of two sensors agree, whenever their events begin") {
  std::vector<Event> storage(16);
  for (const std::int64_t shift_us : {0, -1000, 7}) {
    std::vector<std::int64_t> begins[2];
    for (int sensor = 0; sensor < 2; ++sensor) {
      WindowOptions options;
      options.length_us = 10;
      options.on_grid = true;
      WindowBuilder builder;
      REQUIRE(builder.init(options, storage) == Status::ok);
      std::vector<std::int64_t> times;
      for (std::int64_t t = sensor == 0 ? 3 : 18; t < 200; t += sensor == 0 ? 4 : 11) times.push_back(t + shift_us);
      for (const Window& window : build(&builder, at_times(times), 3)) begins[sensor].push_back(window.begin_us);
    }
    for (const std::int64_t begin_us : begins[1]) {
      CHECK(begin_us % 10 == 0);
      CHECK(std::count(begins[0].begin(), begins[0].end(), begin_us) == 1);
    }
    CHECK(begins[0].front() <= 3 + shift_us);
    CHECK(begins[0].front() > 3 + shift_us - 10);
  }
}

TEST_CASE("windows: on a grid that would begin before all times, the first one begins with its event") {
  constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  std::vector<Event> storage(8);
  for (const std::int64_t length_us : {std::int64_t{1}, std::int64_t{3}, std::int64_t{1000}, kMax}) {
    for (const std::int64_t t_us : {kMin, kMin + 1, kMax - 1}) {
      WindowOptions options;
      options.length_us = length_us;
      options.on_grid = true;
      WindowBuilder builder;
      REQUIRE(builder.init(options, storage) == Status::ok);
      const std::vector<Window> windows = build(&builder, at_times({t_us, t_us + 1}), 2);
      REQUIRE_FALSE(windows.empty());
      CHECK(windows.front().begin_us <= t_us);
      const bool on_grid = windows.front().begin_us % length_us == 0;
      CHECK((on_grid || windows.front().begin_us == t_us));
    }
  }
}

TEST_CASE("windows: the whole range of times does no harm") {
  constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  std::vector<Event> storage(8);
  for (const std::int64_t length_us : {std::int64_t{0}, std::int64_t{1}, std::int64_t{1000}, kMax}) {
    WindowBuilder builder;
    REQUIRE(builder.init({length_us, 2, kMax}, storage) == Status::ok);
    std::size_t count = 0;
    for (const Window& window : build(&builder, at_times({kMin, kMin, 0, kMax, kMax, kMin, kMax, 5}), 3)) {
      CHECK(window.begin_us <= window.end_us);
      count += window.events.size();
    }
    CHECK(count == 8 - builder.stats().backward);
  }
}

TEST_CASE("windows: disorder of the sensor stays in the current window") {
  std::vector<Event> storage(16);
  WindowBuilder builder;
  REQUIRE(builder.init({100, 0, 50}, storage) == Status::ok);
  const std::vector<Window> windows = build(&builder, at_times({0, 60, 10, 9, 100, 55, 49}), 1);
  REQUIRE(windows.size() == 2);
  CHECK(windows[0].events == at_times({0, 60, 10}));
  CHECK(windows[1].begin_us == 100);
  CHECK(windows[1].events == at_times({100, 55}));
  CHECK(builder.stats().late == 2);
  CHECK(builder.stats().backward == 2);
}

TEST_CASE("windows: single false stamps are dropped, a clock set back is followed") {
  std::vector<Event> storage(1000);
  WindowBuilder builder;
  REQUIRE(builder.init({1000, 0, 10}, storage) == Status::ok);
  std::vector<std::int64_t> times;
  for (int i = 0; i < 300; ++i) times.push_back(i % 20 == 19 ? 5 : 10'000 + 10 * i);
  for (int i = 0; i < 300; ++i) times.push_back(10 * i);
  const std::vector<Window> windows = build(&builder, at_times(times), 7);
  CHECK(builder.stats().restarts == 1);
  CHECK(builder.stats().backward == 15 + WindowBuilder::kRestartAfter - 2);
  REQUIRE(windows.size() == 6);
  CHECK(windows[2].begin_us == 12'000);
  CHECK(windows[2].end_us == 12'981);
  CHECK(windows[3].begin_us == 140);
  std::size_t count = 0;
  for (const Window& window : windows) count += window.events.size();
  CHECK(count + builder.stats().backward == times.size());
}

TEST_CASE("windows: beyond the storage events are thinned evenly and counted") {
  std::vector<Event> storage(101);
  for (const std::size_t count : {99U, 100U, 101U, 1000U, 12'345U}) {
    CAPTURE(count);
    std::vector<std::int64_t> times;
    for (std::size_t i = 0; i < count; ++i) times.push_back(static_cast<std::int64_t>(i));
    WindowBuilder builder;
    REQUIRE(builder.init({1'000'000, 0, 0}, storage) == Status::ok);
    const std::vector<Window> windows = build(&builder, at_times(times), count);
    REQUIRE(windows.size() == 1);
    const std::vector<Event>& kept = windows[0].events;
    CHECK(kept.size() + builder.stats().thinned == count);
    CHECK(kept.size() <= 100);
    CHECK(kept.size() >= std::min<std::size_t>(count, 50));
    // One of each 2^k: gaps are below twice that, wherever one looks.
    std::int64_t stride = 1;
    while (static_cast<std::size_t>(stride) * 100 < count) stride *= 2;
    for (std::size_t i = 0; i < kept.size(); ++i) CHECK(kept[i].t_us / stride == static_cast<std::int64_t>(i));
  }
}

TEST_CASE("windows: a limit to the rate thins each window by its own length, and only windows of a length") {
  std::vector<Event> storage(1000);
  std::vector<std::int64_t> times;
  for (std::int64_t t = 0; t < 4000; ++t) times.push_back(t);
  WindowOptions options = {400, 0, 0};
  for (const std::uint32_t rate : {0U, 250'000U, 1'000'000U}) {
    CAPTURE(rate);
    options.max_rate_per_s = rate;
    WindowBuilder builder;
    REQUIRE(builder.init(options, storage) == Status::ok);
    const std::size_t room = rate == 250'000U ? 100 : 400;
    std::size_t kept = 0;
    for (const Window& window : build(&builder, at_times(times), 97)) {
      CHECK(window.events.size() <= room);
      CHECK(window.events.size() >= room / 2);
      kept += window.events.size();
    }
    CHECK(kept + builder.stats().thinned == times.size());
  }
  options.length_us = 0;
  options.max_events = 500;
  options.max_rate_per_s = 1;
  WindowBuilder by_count;
  REQUIRE(by_count.init(options, storage) == Status::ok);
  for (const Window& window : build(&by_count, at_times(times), 97)) CHECK(window.events.size() == 500);
  options.length_us = std::numeric_limits<std::int64_t>::max();
  options.max_rate_per_s = std::numeric_limits<std::uint32_t>::max();
  WindowBuilder endless;
  REQUIRE(endless.init(options, storage) == Status::ok);
  CHECK(build(&endless, at_times(times), 97).front().events.size() == 500);
}

TEST_CASE("windows: thinning does not favour the even columns of a vector word") {
  std::vector<Event> storage(1000);
  WindowBuilder builder;
  REQUIRE(builder.init({1'000'000, 0, 0}, storage) == Status::ok);
  std::vector<Event> events;
  for (std::uint16_t i = 0; i < 8000; ++i) events.push_back({i, static_cast<std::uint16_t>(i % 12), 0, 0});
  std::vector<int> columns(12, 0);
  const std::vector<Window> windows = build(&builder, events, 8000);
  REQUIRE(windows.size() == 1);
  for (const Event& event : windows[0].events) ++columns[event.x];
  for (const int column : columns) CHECK(std::abs(column - 1000 / 12) < 5 * std::sqrt(1000.0 / 12));
}

TEST_CASE("windows: the length may change between two windows") {
  std::vector<Event> storage(16);
  WindowBuilder builder;
  CHECK(builder.set_length_us(10) == Status::wrong_state);
  REQUIRE(builder.init({10, 0, 0}, storage) == Status::ok);
  const std::vector<Event> events = at_times({0, 5, 12, 25, 31, 69});
  Span<const Event> input(events);
  EventWindow window;
  REQUIRE(builder.push(&input, &window) == Status::ok);
  CHECK(builder.set_length_us(20) == Status::ok);
  REQUIRE(builder.push(&input, &window) == Status::ok);
  CHECK(copy(window) == Window{10, 30, at_times({12, 25})});
  CHECK(builder.set_length_us(5) == Status::ok);
  REQUIRE(builder.push(&input, &window) == Status::ok);
  CHECK(copy(window) == Window{30, 35, at_times({31})});
  CHECK(builder.set_length_us(0) == Status::invalid_argument);
  CHECK(builder.set_length_us(-1) == Status::invalid_argument);
}

TEST_CASE("windows: no window holds what was pushed on both sides of a cut, and what is dropped is counted") {
  std::vector<Event> storage(100);
  WindowBuilder builder;
  REQUIRE(builder.init({1000}, storage) == Status::ok);
  builder.cut();  // of nothing
  const std::vector<Event> before = {{100, 1, 1, 0}, {1200, 2, 2, 0}, {1300, 3, 3, 1}};
  const std::vector<Event> after = {{1750, 4, 4, 1}, {2749, 5, 5, 0}};
  EventWindow window;
  Span<const Event> piece(before);
  REQUIRE(builder.push(&piece, &window) == Status::ok);
  CHECK(copy(window) == Window{100, 1100, {before[0]}});
  REQUIRE(builder.push(&piece, &window) == Status::need_more_data);
  builder.cut();
  CHECK(builder.stats().cut == 2);
  CHECK(builder.finish(&window) == Status::need_more_data);
  piece = after;
  REQUIRE(builder.push(&piece, &window) == Status::need_more_data);
  REQUIRE(builder.finish(&window) == Status::ok);
  CHECK(copy(window) == Window{1750, 2750, after});
  builder.cut();
  piece = before;  // the clock may begin anew
  REQUIRE(builder.push(&piece, &window) == Status::ok);
  CHECK(window.begin_us == 100);
  CHECK(builder.stats().cut == 2);
  CHECK(builder.stats().events == 6);
}

TEST_CASE("windows: options and storage are checked") {
  std::vector<Event> storage(4);
  WindowBuilder builder;
  EventWindow window{1, 2, {}};
  Span<const Event> nothing;
  CHECK(builder.push(&nothing, &window) == Status::wrong_state);
  CHECK(builder.finish(&window) == Status::wrong_state);
  CHECK(builder.init({0, 0, 0}, storage) == Status::invalid_argument);
  CHECK(builder.init({-1, 5, 0}, storage) == Status::invalid_argument);
  CHECK(builder.init({1, 0, -1}, storage) == Status::invalid_argument);
  CHECK(builder.init({1, 0, 0}, Span<Event>(storage).first(1)) == Status::buffer_too_small);
  CHECK(builder.init({1, 0, 0}, Span<Event>(storage).first(2)) == Status::ok);
  CHECK(builder.push(&nothing, &window) == Status::need_more_data);
  CHECK(builder.finish(&window) == Status::need_more_data);
  CHECK(window.begin_us == 1);
}

TEST_CASE("windows: nothing is allocated") {
  Rng rng(5);
  const std::vector<Event> events = random_events(&rng, 1000, 0, 50, 100, 100);
  std::vector<Event> storage(16);
  Span<const Event> input(events);
  EventWindow window;
  const AllocScope heap;
  WindowBuilder builder;
  Status status = builder.init({100, 0, 0}, storage);
  while (builder.push(&input, &window) == Status::ok) {
  }
  CHECK(heap.allocations() == 0);
  CHECK(status == Status::ok);
}

}  // namespace
}  // namespace lecalib::test
