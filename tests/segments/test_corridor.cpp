// SPDX-License-Identifier: MIT
#include "lecalib/segments/corridor.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <set>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/planes/cloud.hpp"

using namespace lecalib;

namespace {

constexpr std::uint16_t kWidth = 190, kHeight = 150;

struct Window {
  std::vector<std::uint16_t> x, y, t;
  std::vector<std::uint32_t> cell_start;
  EventCloud cloud;

  explicit Window(std::size_t count) : x(count), y(count), t(count), cell_start(2 * cloud_cells(kWidth, kHeight) + 1) {
    Rng rng(41);
    std::vector<Event> events(count);
    for (std::size_t i = 0; i < count; ++i) {
      events[i].t_us = static_cast<std::int64_t>(i);
      events[i].x = static_cast<std::uint16_t>(rng.below(kWidth));
      events[i].y = static_cast<std::uint16_t>(rng.below(kHeight));
      events[i].polarity = static_cast<std::uint8_t>(rng.below(2));
    }
    CloudOptions options;
    options.width = kWidth, options.height = kHeight;
    const CloudWorkspace workspace{
        {x.data(), count}, {y.data(), count}, {t.data(), count}, {cell_start.data(), cell_start.size()}};
    const EventWindow window{0, static_cast<std::int64_t>(count), {events.data(), count}};
    REQUIRE(build_cloud(window, options, workspace, &cloud, nullptr) == Status::ok);
  }
};

MovingLine aslant(double degrees) {
  MovingLine line;
  const double angle = degrees * 0.017453292519943295;
  line.cx = 95, line.cy = 75;
  line.ux = static_cast<float>(std::cos(angle));
  line.uy = static_cast<float>(std::sin(angle));
  line.m[0] = 0.4F, line.m[1] = 0.6F, line.m[2] = 3, line.m[3] = 0.5F, line.m[4] = -0.3F;
  return line;
}

}  // namespace

TEST_CASE("corridor: the events near a line are those that brute force finds, each once, with its place") {
  const Window window(5003);
  constexpr float kRounding = 1e-3F;  // px, in which either may be right
  for (const double degrees : {0.0, 33.0, 90.0, 135.0, 200.0}) {
    const MovingLine line = aslant(degrees);
    for (const unsigned polarities : {1U, 2U, 3U}) {
      for (const std::uint32_t stride : {1U, 3U}) {
        std::set<std::uint32_t> found;
        for_each_near_line(window.cloud, line, -70, 85, 4, polarities, stride, [&](const LineEvent& event) {
          CHECK(found.insert(event.index).second);
          CHECK(std::fabs(event.residual_px - (event.across_px - line.offset(event.along_px, event.tau))) < kRounding);
          CHECK(event.tau == window.cloud.tau(event.index));
        });
        CHECK(found.size() > 20);
        for (std::uint32_t i = 0; i < window.cloud.size(); ++i) {
          const float s = line.along(window.cloud.x[i], window.cloud.y[i]);
          const float d = line.across(window.cloud.x[i], window.cloud.y[i]);
          const float r = std::fabs(d - line.offset(s, window.cloud.tau(i)));
          const bool wanted = i % stride == 0 && (polarities >> (window.cloud.is_on(i) ? 1U : 0U) & 1U) != 0;
          const bool inside = wanted && s > -70 + kRounding && s < 85 - kRounding && r < 4 - kRounding;
          const bool beside = !wanted || s < -70 - kRounding || s > 85 + kRounding || r > 4 + kRounding;
          if (inside) CHECK(found.count(i) == 1);
          if (beside) CHECK(found.count(i) == 0);
        }
      }
    }
  }
}
