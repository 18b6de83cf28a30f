// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/pipeline/line_detector.hpp"
#include "support/guarded_arena.hpp"

namespace lecalib::test {
namespace {

constexpr std::uint16_t kWidth = 346;
constexpr std::uint16_t kHeight = 260;

/// Background activity of a noisy DAVIS: every pixel fires at random, 5 times a second, in either polarity.
std::vector<Event> noise(std::int64_t duration_us, std::uint64_t seed) {
  constexpr std::int64_t kRateHz = 5;
  Rng rng(seed);
  std::vector<Event> events(static_cast<std::size_t>(kRateHz * kWidth * kHeight * duration_us / 1'000'000));
  for (Event& event : events) {
    event.t_us = rng.below(static_cast<std::uint32_t>(duration_us));
    event.x = static_cast<std::uint16_t>(rng.below(kWidth));
    event.y = static_cast<std::uint16_t>(rng.below(kHeight));
    event.polarity = static_cast<std::uint8_t>(rng.below(2));
  }
  std::sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.t_us < b.t_us; });
  return events;
}

/// Lines found in events that are cut into windows of one length.
std::size_t count_lines(const std::vector<Event>& events, std::int64_t window_us, DetectorKind kind) {
  DetectorCapacities capacities;
  capacities.width = kWidth;
  capacities.height = kHeight;
  GuardedArena memory(detector_bytes(capacities));
  DetectorWorkspace workspace;
  REQUIRE(carve(memory.arena(), capacities, &workspace));
  DetectorOptions options;
  options.kind = kind;
  options.cloud.width = kWidth;
  options.cloud.height = kHeight;
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

TEST_CASE("noise only: background activity makes fewer than one line per second") {
  for (const std::int64_t window_us : {5'000, 10'000, 20'000, 50'000, 100'000}) {
    CAPTURE(window_us);
    const auto seed = static_cast<std::uint64_t>(window_us);
    CHECK(count_lines(noise(1'000'000, seed), window_us, DetectorKind::fast) < 1);
    CHECK(count_lines(noise(200'000, seed), window_us, DetectorKind::reference) < 1);
  }
}

}  // namespace
}  // namespace lecalib::test
