// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "lecalib/segments/event_weight.hpp"
#include "lecalib/segments/shared_stretches.hpp"

using namespace lecalib;

namespace {

/// A line at rest through (x, y), from -half to half along its direction.
MovingLine line_at(float x, float y, double degrees, float half, std::uint8_t id) {
  const double angle = degrees * 0.017453292519943295;
  MovingLine line;
  line.cx = x;
  line.cy = y;
  line.ux = static_cast<float>(std::cos(angle));
  line.uy = static_cast<float>(std::sin(angle));
  line.low[0] = line.low[1] = -half;
  line.high[0] = line.high[1] = half;
  line.events = 1000;
  line.polarities = 2;
  line.id = id;
  return line;
}

SharedStretches shared_of(const std::vector<MovingLine>& lines, std::size_t index) {
  bool own[kMaxLines + 1] = {};
  own[lines[index].id] = true;
  return {SharingOptions{}, {lines.data(), lines.size()}, lines[index], {own}};
}

}  // namespace

TEST_CASE("shared stretches: they are where another line runs nearer than both lines' events scatter") {
  std::vector<MovingLine> lines = {line_at(100, 100, 0, 150, 1), line_at(120, 100, 6, 80, 2)};
  lines[1].m[2] = 4;  // it moves by 4 px in half of the window: so does its crossing
  const SharedStretches shared = shared_of(lines, 0);
  REQUIRE_FALSE(shared.empty());
  const double reach = double{claimed_band(1)} + 2.5;
  const double sine = std::sin(6 * 0.017453292519943295);
  for (const float tau : {-1.0F, 0.0F, 1.0F}) {
    for (float s = -150; s <= 150; s += 0.5F) {
      const double distance = std::fabs((double{s} - 20) * sine + 4 * double{tau});
      const bool beside = std::fabs(double{s} - 20) < 79;
      if (beside && distance < reach - 0.01) CHECK(shared.hold(lines[0], s, tau));
      if (distance > reach + 0.01 || std::fabs(double{s} - 20) > 90) CHECK_FALSE(shared.hold(lines[0], s, tau));
    }
  }
  CHECK(shared.may_have(lines[0], 2, 20, 0));
  CHECK_FALSE(shared.may_have(lines[0], 3, 20, 0));
  CHECK_FALSE(shared.may_have(lines[0], 2, -140, 0));
}

TEST_CASE("shared stretches: many places at once are the same as one after the other") {
  std::vector<MovingLine> lines = {line_at(100, 100, 0, 150, 1), line_at(120, 100, 6, 80, 2),
                                   line_at(60, 100, -5, 90, 3)};
  lines[1].m[2] = 4;
  const SharedStretches shared = shared_of(lines, 0);
  for (std::size_t count = 1; count <= SharedStretches::kBlock; ++count) {
    std::vector<float> s;
    std::vector<float> tau;
    std::uint32_t expected = 0;
    for (std::size_t k = 0; k < count; ++k) {
      s.push_back(-150 + 300 * static_cast<float>(k) / static_cast<float>(count));
      tau.push_back(k % 2 == 0 ? -1.0F : 0.5F);
      expected |= shared.hold(lines[0], s[k], tau[k]) ? 1U << k : 0U;
    }
    CHECK(shared.hold_each(lines[0], s.data(), tau.data(), count) == expected);
  }
}

TEST_CASE("shared stretches: the other polarity, wide angles and far crossings share nothing") {
  std::vector<MovingLine> lines = {line_at(100, 100, 0, 150, 1), line_at(120, 100, 6, 80, 2)};
  lines[1].polarities = 1;
  CHECK(shared_of(lines, 0).empty());
  lines[1] = line_at(120, 100, 25, 80, 2);
  CHECK(shared_of(lines, 0).empty());
  lines[1] = line_at(120, 140, 6, 80, 2);
  CHECK(shared_of(lines, 0).empty());
  CHECK(SharedStretches().empty());
}

TEST_CASE("shared stretches: never more than the allowed share of a line") {
  const std::vector<MovingLine> lines = {line_at(100, 100, 0, 150, 1), line_at(100, 100, 2, 40, 2)};
  const SharedStretches shared = shared_of(lines, 1);
  int held = 0;
  for (int i = -40; i < 40; ++i) held += shared.hold(lines[1], static_cast<float>(i) + 0.5F, 0) ? 1 : 0;
  CHECK(held > 0);
  CHECK(held <= 52);  // 60 %, and one of 16 places
}

TEST_CASE("shared stretches: a line is expected to bend as the one that it crosses does") {
  std::vector<MovingLine> lines = {line_at(100, 100, 0, 150, 1), line_at(120, 100, 6, 40, 2)};
  lines[0].m[4] = 0.4F;
  const LinePriors any;
  CHECK(shared_of(lines, 1).priors(any, lines[1]).bend_mean_px == doctest::Approx(0.4));
  CHECK(shared_of(lines, 1).priors(any, lines[1]).bend_px < any.bend_px);
  lines[1] = line_at(120, 100, 186, 40, 2);  // the other way along: its normal points the other way too
  CHECK(shared_of(lines, 1).priors(any, lines[1]).bend_mean_px == doctest::Approx(-0.4));
  lines[0].covariance[14] = 100;  // nothing is known of that one's bend
  CHECK(shared_of(lines, 1).priors(any, lines[1]).bend_mean_px == 0);
  CHECK(shared_of(lines, 1).priors(any, lines[1]).bend_px == any.bend_px);
}

TEST_CASE("line equations: without events the bend is what is expected of it") {
  LineEquations equations;
  equations.add(0, 0, 0, 1);
  LinePriors priors;
  priors.bend_mean_px = 0.7F;
  float m[kNumLineCoefficients] = {};
  REQUIRE(equations.solve(priors, 1, m, nullptr));
  CHECK(double{m[4]} == doctest::Approx(0.7));
  CHECK(double{m[0]} == doctest::Approx(0.0));
}
