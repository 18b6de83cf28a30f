// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/pipeline/line_detector.hpp"
#include "support/guarded_arena.hpp"

namespace lecalib::test {
namespace {

struct Sensor {
  std::uint16_t width, height;
};

/// Background activity: every pixel fires at random, in either polarity. Times are uniform per millisecond, so that the
/// events come in order and no sort is needed.
std::vector<Event> noise(const Sensor& sensor, std::uint32_t rate_hz, std::int64_t duration_us, std::uint64_t seed) {
  constexpr std::int64_t kStepUs = 1000;
  Rng rng(seed);
  const std::int64_t per_second = std::int64_t{rate_hz} * sensor.width * sensor.height;
  std::vector<Event> events;
  for (std::int64_t begin_us = 0; begin_us < duration_us; begin_us += kStepUs) {
    const auto first = static_cast<std::ptrdiff_t>(events.size());
    const std::int64_t end = per_second * (begin_us + kStepUs) / 1'000'000;
    while (static_cast<std::int64_t>(events.size()) < end) {
      Event event{};
      event.t_us = begin_us + rng.below(kStepUs);
      event.x = static_cast<std::uint16_t>(rng.below(sensor.width));
      event.y = static_cast<std::uint16_t>(rng.below(sensor.height));
      event.polarity = static_cast<std::uint8_t>(rng.below(2));
      events.push_back(event);
    }
    std::sort(events.begin() + first, events.end(), [](const Event& a, const Event& b) { return a.t_us < b.t_us; });
  }
  return events;
}

/// Lines found in events that are cut into windows of one length.
std::size_t count_lines(const Sensor& sensor, const std::vector<Event>& events, std::int64_t window_us,
                        LineFinder finder) {
  DetectorCapacities capacities;
  capacities.width = sensor.width;
  capacities.height = sensor.height;
  GuardedArena memory(detector_bytes(capacities));
  DetectorWorkspace workspace;
  REQUIRE(carve(memory.arena(), capacities, &workspace));
  DetectorOptions options;
  options.find_lines = finder;
  options.cloud.width = sensor.width;
  options.cloud.height = sensor.height;
  std::vector<EventLine> lines(64);
  std::size_t total = 0;
  for (std::size_t i = 0; i < events.size();) {
    const std::int64_t begin_us = events[i].t_us / window_us * window_us;
    std::size_t end = i;
    while (end < events.size() && events[end].t_us < begin_us + window_us) ++end;
    const EventWindow window{begin_us, begin_us + window_us, {events.data() + i, end - i}};
    std::size_t count = 0;
    REQUIRE(detect_lines(window, options, &workspace, lines, &count, nullptr) == Status::ok);
    total += count;
    i = end;
  }
  return total;
}

// Fewer than one line per second is wanted; a part of a second must then hold none.
TEST_CASE("noise only: background activity makes fewer than one line per second, windows of any length") {
  constexpr Sensor kDavis{346, 260};
  for (const std::int64_t window_us : {5'000, 10'000, 20'000, 50'000, 100'000}) {
    CAPTURE(window_us);
    const auto seed = static_cast<std::uint64_t>(window_us);
    CHECK(count_lines(kDavis, noise(kDavis, 5, 1'000'000, seed), window_us, fast_detector) < 1);
    CHECK(count_lines(kDavis, noise(kDavis, 5, 200'000, seed), window_us, reference_detector) < 1);
  }
}

TEST_CASE("noise only: 1, 5 and 20 Hz per pixel make fewer than one line per second, whatever the sensor's size") {
  // Nothing moves, so the windows have grown long. At 1280 x 720 and 1 Hz, windows of 20 to 70 ms have about one event
  // per cell and polarity.
  for (const Sensor& sensor : {Sensor{346, 260}, Sensor{1280, 720}}) {
    for (const std::uint32_t rate_hz : {1U, 5U, 20U}) {
      for (const std::int64_t window_us : {30'000, 60'000, 100'000}) {
        CAPTURE(sensor.width);
        CAPTURE(rate_hz);
        CAPTURE(window_us);
        const std::int64_t duration_us = sensor.width * rate_hz > 6000 ? window_us : 3 * window_us;
        CHECK(count_lines(sensor, noise(sensor, rate_hz, duration_us, rate_hz), window_us, fast_detector) < 1);
      }
    }
  }
}

}  // namespace
}  // namespace lecalib::test
