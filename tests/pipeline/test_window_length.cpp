// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <array>
#include <vector>

#include "lecalib/pipeline/window_length.hpp"

using namespace lecalib;

namespace {

/// A horizontal line that moves down by `travel` px and slides along itself by `slide` px.
EventLine moving(float length, float travel, float slide = 0) {
  EventLine line{};
  line.begin = {10, 20, 10 + length, 20};
  line.end = {10 + slide, 20 + travel, 10 + slide + length, 20 + travel};
  return line;
}

std::int64_t next(std::int64_t length_us, const std::vector<EventLine>& lines) {
  std::vector<float> scratch(lines.size());
  WindowLengthOptions options;
  options.travel_px = 5;
  return next_window_length(options, length_us, lines, scratch);
}

}  // namespace

TEST_CASE("the window's length brings the lines' travel to the wanted one") {
  CHECK(next(10'000, {moving(100, 5)}) == 10'000);
  CHECK(next(10'000, {moving(100, -6.25F)}) == 8'000);
  CHECK(next(10'000, {moving(100, 50)}) == 6'000);     // by a factor of 0.6 at most
  CHECK(next(10'000, {moving(100, 0.1F)}) == 13'000);  // and 1.3
}

TEST_CASE("sliding along itself is no travel") { CHECK(next(10'000, {moving(100, 0, 40)}) == 13'000); }

TEST_CASE("the upper quartile is weighted by length") {
  // 80 of 100 px travel 5 px or less: the short fast line does not count.
  CHECK(next(10'000, {moving(50, 5), moving(30, 4), moving(20, 10)}) == 10'000);
  // 70 of 100 px are not three quarters: the fast one sets the pace.
  CHECK(next(10'000, {moving(40, 5), moving(30, 4), moving(30, 10)}) == 6'000);
}

TEST_CASE("without lines the window grows to its bound, and shrinks to the other") {
  std::int64_t length = 5'000;
  for (int i = 0; i < 100; ++i) length = next(length, {});
  CHECK(length == WindowLengthOptions{}.max_us);
  for (int i = 0; i < 100; ++i) length = next(length, {moving(10, 100)});
  CHECK(length == WindowLengthOptions{}.min_us);
}

TEST_CASE("a wanted travel of zero leaves the length alone") {
  WindowLengthOptions options;
  options.travel_px = 0;
  CHECK(next_window_length(options, 7'000, {}, {}) == 7'000);
}
