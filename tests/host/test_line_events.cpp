// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/host/line_events.hpp"

using namespace lecalib;
using namespace lecalib::host;

namespace {

constexpr std::int64_t kBegin = 1'000'000, kEnd = 1'010'000;

/// From (20, 50) to (120, 50), moving down by 10 px, turning by 4 px, with its middle 3 px further down.
EventLine example(std::int8_t polarity) {
  EventLine line{};
  line.begin = {20, 50, 120, 50};
  line.end = {20, 60, 120, 64};
  line.bend_px = 3;
  line.polarity = polarity;
  return line;
}

/// Where the example stands: y at x, when `share` of the window has passed.
double example_y(double x, double share) {
  const double s = (x - 20) / 100;
  return 50 + share * (10 + 4 * s) + 3 * 4 * s * (1 - s);
}

Event at(double x, double y, double share, std::uint8_t polarity) {
  return {kBegin + static_cast<std::int64_t>(share * (kEnd - kBegin)), static_cast<std::uint16_t>(std::lround(x)),
          static_cast<std::uint16_t>(std::lround(y)), polarity};
}

std::vector<int> owners(const std::vector<Event>& events, const std::vector<EventLine>& lines) {
  return line_of_events({kBegin, kEnd, events}, lines);
}

}  // namespace

TEST_CASE("line events: events belong to a line where it stands at their time, bend included") {
  Rng rng(1);
  const std::vector<EventLine> lines = {example(1)};
  for (int i = 0; i < 1000; ++i) {
    const double x = rng.uniform(20, 120);
    const double share = rng.uniform();
    const double y = example_y(std::round(x), share);
    const double beside = rng.below(2) == 0 ? 3 : -3;
    CHECK(owners({at(x, y, share, 1), at(x, y + beside, share, 1)}, lines) == std::vector<int>{0, -1});
  }
  // In the wrong half of the window it is elsewhere.
  CHECK(owners({at(60, example_y(60, 0), 1, 1), at(60, example_y(60, 1), 0, 1)}, lines) == std::vector<int>{-1, -1});
}

TEST_CASE("line events: a line's ends bound what belongs to it") {
  const std::vector<EventLine> lines = {example(1)};
  CHECK(owners({at(20, 50, 0, 1), at(120, 50, 0, 1)}, lines) == std::vector<int>{0, 0});
  CHECK(owners({at(17, 50, 0, 1), at(123, 50, 0, 1)}, lines) == std::vector<int>{-1, -1});
}

TEST_CASE("line events: the polarity decides, and a line of both takes both") {
  const std::vector<Event> events = {at(20, 50, 0, 1), at(20, 50, 0, 0)};
  CHECK(owners(events, {example(1)}) == std::vector<int>{0, -1});
  CHECK(owners(events, {example(-1)}) == std::vector<int>{-1, 0});
  CHECK(owners(events, {example(0)}) == std::vector<int>{0, 0});
}

TEST_CASE("line events: of two lines the nearer one owns the event") {
  EventLine lower = example(1);
  for (Segment* segment : {&lower.begin, &lower.end}) {
    segment->y1 += 3;
    segment->y2 += 3;
  }
  CHECK(owners({at(20, 51, 0, 1), at(20, 52, 0, 1)}, {example(1), lower}) == std::vector<int>{0, 1});
}

TEST_CASE("line events: lines without length and windows of any times are no trouble") {
  EventLine dot{};
  dot.begin = dot.end = {5, 5, 5, 5};
  CHECK(owners({at(5, 5, 0, 1)}, {dot}) == std::vector<int>{-1});
  const std::vector<Event> events = {{INT64_MIN, 20, 50, 1}, {INT64_MAX, 20, 60, 1}};
  const std::vector<EventLine> lines = {example(1)};
  CHECK(line_of_events({INT64_MIN, INT64_MAX, events}, lines) == std::vector<int>{0, 0});
  CHECK(line_of_events({0, 0, events}, lines).size() == 2);
}
