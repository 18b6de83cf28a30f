// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>
#include <vector>

#include "lecalib/core/arena.hpp"
#include "lecalib/segments/failed_lines.hpp"
#include "lecalib/segments/line_fit.hpp"
#include "lecalib/segments/line_growth.hpp"
#include "lecalib/segments/line_merge.hpp"
#include "lecalib/segments/line_shape.hpp"
#include "support/cloud_of.hpp"
#include "support/dense_algebra.hpp"
#include "support/guarded_arena.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

struct Workspace {
  explicit Workspace(const EventCloud& cloud) : memory(bytes(cloud)) {
    const LineCapacities capacities{cloud.size(), cloud.width, cloud.height, true};
    REQUIRE(carve(memory.arena(), capacities, &workspace));
    for (std::uint8_t& owner : workspace.owner) owner = 0;
  }
  static std::size_t bytes(const EventCloud& cloud) {
    ArenaMeter meter;
    LineWorkspace unused;
    (void)carve(meter, LineCapacities{cloud.size(), cloud.width, cloud.height, true}, &unused);
    return meter.peak();
  }
  GuardedArena memory;
  LineWorkspace workspace;
};

/// A guess of an edge from its middle part only.
MovingLine guess_of(const MovingEdge& edge, float from, float to) {
  const auto part = [&](const Segment& s) {
    return Segment{s.x1 + from * (s.x2 - s.x1), s.y1 + from * (s.y2 - s.y1), s.x1 + to * (s.x2 - s.x1),
                   s.y1 + to * (s.y2 - s.y1)};
  };
  MovingLine line;
  REQUIRE(line_between(part(edge.begin), part(edge.end), &line));
  line.polarities = edge.polarity != 0 ? 2 : 1;
  return line;
}

FitOutcome grow_and_fit(const EventCloud& cloud, const Workspace& memory, MovingLine* line, std::uint8_t id = 1) {
  if (!grow_line(cloud, GrowthOptions{}, LinePriors{}, memory.workspace, {}, {}, line))
    return FitOutcome::too_few_events;
  return fit_line(cloud, LineFitOptions{}, memory.workspace, FitClaim{id, {}, 1, {}}, line);
}

EventLine shape(const EventCloud& cloud, const Workspace& memory, const MovingLine& line,
                const LineShapeOptions& options = {}) {
  return shape_line(cloud, options, LinePriors{}, memory.workspace, line, {}, {}).record;
}

}  // namespace

TEST_CASE("moving line: stands on both segments it is made of, and recentring keeps it there") {
  const Segment begin{20, 30, 200, 90};
  const Segment end{26, 24, 204, 96};
  MovingLine line;
  REQUIRE(line_between(begin, end, &line));
  const auto check = [&] {
    for (const float s : {line.low[0], 0.0F, line.high[0]}) {
      for (const auto& [segment, tau] : {std::pair{begin, -1.0F}, std::pair{end, 1.0F}}) {
        const float d = line.offset(s, tau);
        const float x = line.x(s, d);
        const float y = line.y(s, d);
        const float dx = segment.x2 - segment.x1;
        const float dy = segment.y2 - segment.y1;
        CHECK(std::fabs((x - segment.x1) * dy - (y - segment.y1) * dx) < 0.02F * std::hypot(dx, dy));
      }
    }
  };
  check();
  recentre(&line);
  CHECK(line.m[0] == 0);
  CHECK(line.m[1] == 0);
  CHECK(line.low[0] + line.low[1] + line.high[0] + line.high[1] == doctest::Approx(0).epsilon(0.01));
  check();
  CHECK_FALSE(line_between({0, 0, 10, 0}, {0, 0, 0, 10}, &line));
  CHECK_FALSE(line_between({0, 0, 10, 0}, {10, 0, 0, 0}, &line));
  CHECK_FALSE(line_between({0, 0, 0.5F, 0}, {0, 0, 10, 0}, &line));
}

TEST_CASE("line equations: the solution and its covariance are Eigen's") {
  Rng rng(3);
  LineEquations equations;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(5, 5);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(5);
  for (int i = 0; i < 400; ++i) {
    const double s = rng.uniform(-120, 120);
    const double tau = rng.uniform(-1, 1);
    const double d = 2 + 0.01 * s - 3 * tau + 0.5 * normal(&rng);
    const double w = rng.uniform(0.1, 1);
    equations.add(static_cast<float>(s), static_cast<float>(tau), static_cast<float>(d), static_cast<float>(w));
    Eigen::VectorXd row(5);
    row << 1, s / 64, tau, s / 64 * tau, s / 64 * s / 64;
    a += w * row * row.transpose();
    b += w * d * row;
  }
  const LinePriors priors;
  const double variance = 0.3;
  a(1, 1) += variance / double{priors.motion_px * priors.motion_px};
  a(2, 2) += variance / double{priors.motion_px * priors.motion_px};
  a(3, 3) += variance / double{priors.turn_px * priors.turn_px};
  a(4, 4) += variance / double{priors.bend_px * priors.bend_px};
  const Eigen::VectorXd expected = dense_solve(a, b);
  const Eigen::MatrixXd inverse = dense_inverse(a);
  float m[5];
  float covariance[15];
  REQUIRE(equations.solve(priors, 0.3F, m, covariance));
  int k = 0;
  for (int i = 0; i < 5; ++i) {
    CHECK(double{m[i]} == doctest::Approx(expected(i)).epsilon(1e-4).scale(1));
    for (int j = i; j < 5; ++j)
      CHECK(double{covariance[k++]} == doctest::Approx(inverse(i, j)).epsilon(1e-3).scale(0.01));
  }
  CHECK_FALSE(LineEquations().solve(priors, 1, m, nullptr));
}

TEST_CASE("line equations: events in one go weigh as they do one by one, whatever their number") {
  Rng rng(11);
  MovingLine line;
  line.m[0] = 0.5F;
  line.m[1] = 0.2F;
  line.m[2] = -2;
  line.m[3] = 0.3F;
  line.m[4] = 0.1F;
  constexpr float kBandPx = 1.5F;
  std::vector<float> along(103), across(103), tau(103);
  for (std::size_t i = 0; i < along.size(); ++i) {
    along[i] = static_cast<float>(rng.uniform(-120, 120));
    tau[i] = static_cast<float>(rng.uniform(-1, 1));
    across[i] = line.offset(along[i], tau[i]) + static_cast<float>(normal(&rng));
  }
  for (const std::size_t count : {std::size_t{1}, std::size_t{4}, std::size_t{6}, std::size_t{103}}) {
    const ListedEvents events{along.data(), across.data(), tau.data(), count};
    LineEquations all;
    LineEquations near;
    all.add(events);
    const WeightedSupport support = near.add_near(events, line, kBandPx);
    LineEquations expected_all;
    LineEquations expected_near;
    WeightedSupport expected;
    for (std::size_t i = 0; i < count; ++i) {
      const float r = (across[i] - line.offset(along[i], tau[i])) / kBandPx;
      const float weight = 1 - r * r;
      expected_all.add(along[i], tau[i], across[i], 1);
      if (weight <= 0) continue;
      expected_near.add(along[i], tau[i], across[i], weight);
      expected.events += 1;
      expected.weight += weight;
      expected.square += weight * r * r;
    }
    CHECK(support.events == expected.events);
    CHECK(support.weight == doctest::Approx(expected.weight).epsilon(1e-5));
    CHECK(support.square == doctest::Approx(expected.square).epsilon(1e-4));
    const auto check_same = [](const LineEquations& a, const LineEquations& b) {
      float of_a[5];
      float of_b[5];
      REQUIRE(a.solve({}, 1, of_a, nullptr));
      REQUIRE(b.solve({}, 1, of_b, nullptr));
      for (int i = 0; i < 5; ++i) CHECK(of_a[i] == doctest::Approx(of_b[i]).epsilon(1e-3).scale(1));
    };
    check_same(all, expected_all);
    check_same(near, expected_near);
  }
}

TEST_CASE("failed lines: a guess on one of them is told, from either way along it; others are not") {
  MovingLine memory[2];
  FailedLines failed(Span<MovingLine>(memory, 2));
  MovingLine line;
  line.cx = 100;
  line.cy = 50;
  line.ux = 0.6F;
  line.uy = 0.8F;
  line.m[2] = 3;
  line.m[4] = 0.2F;
  line.low[0] = line.low[1] = -60;
  line.high[0] = line.high[1] = 40;
  line.polarities = 2;
  CHECK_FALSE(failed.holds(line));
  failed.add(line);

  const auto guess_at = [&](float s, float beside_px, float way) {
    MovingLine guess;
    const float d = line.offset(s, 0) + beside_px;
    guess.cx = line.x(s, d);
    guess.cy = line.y(s, d);
    guess.ux = way * line.ux;
    guess.uy = way * line.uy;
    guess.m[2] = way * line.m[2];
    guess.polarities = line.polarities;
    return guess;
  };
  for (const float way : {1.0F, -1.0F}) {
    for (const float s : {-55.0F, 0.0F, 35.0F}) CHECK(failed.holds(guess_at(s, 0.5F, way)));
    CHECK_FALSE(failed.holds(guess_at(-65, 0, way)));
    CHECK_FALSE(failed.holds(guess_at(45, 0, way)));
    CHECK_FALSE(failed.holds(guess_at(0, 1.5F, way)));
    MovingLine still = guess_at(0, 0, way);
    still.m[2] = 0;
    CHECK_FALSE(failed.holds(still));
    MovingLine turned = guess_at(0, 0, way);
    turned.ux = way * line.uy;
    turned.uy = -way * line.ux;
    CHECK_FALSE(failed.holds(turned));
    MovingLine off = guess_at(0, 0, way);
    off.polarities = 1;
    CHECK_FALSE(failed.holds(off));
  }

  MovingLine other = line;
  other.cx += 50;
  failed.add(other);
  CHECK(failed.holds(guess_at(0, 0, 1)));
  failed.add(other);  // the oldest makes room
  CHECK_FALSE(failed.holds(guess_at(0, 0, 1)));
  FailedLines without_memory{Span<MovingLine>()};
  without_memory.add(line);
  CHECK_FALSE(without_memory.holds(line));
}

TEST_CASE("fit: a line that turns and moves is found from its middle third, to its ends") {
  SceneOptions scene;
  scene.noise_events = 1000;
  const MovingEdge edge{{40, 60, 300, 190}, {50, 50, 306, 196}, 0};  // its ends move 13 and 8 px, to opposite sides
  const CloudOf events(scene, make_events({edge}, scene));
  Workspace memory(events.cloud);
  MovingLine line = guess_of(edge, 0.33F, 0.67F);
  REQUIRE(grow_and_fit(events.cloud, memory, &line) == FitOutcome::accepted);
  const EventLine found = shape(events.cloud, memory, line);
  CHECK(distance_between(found.begin, edge.begin) < 0.25);
  CHECK(distance_between(found.end, edge.end) < 0.25);
  CHECK(std::hypot(found.begin.x1 - edge.begin.x1, found.begin.y1 - edge.begin.y1) < 6);
  CHECK(std::hypot(found.end.x2 - edge.end.x2, found.end.y2 - edge.end.y2) < 6);
  CHECK(found.polarity == -1);
  std::size_t owned = 0;
  for (const std::uint8_t owner : memory.workspace.owner) owned += owner == 1 ? 1U : 0U;
  CHECK(owned >= found.events);
}

TEST_CASE("fit: the error is as large as sigma says") {
  SceneOptions scene;
  const MovingEdge edge{{60, 60, 240, 180}, {64, 55, 244, 175}, 1};
  LineShapeOptions options;
  options.systematic_px = 0;  // the simulated edge has no common delay
  options.systematic_sparse_px2 = 0;
  double sum = 0;
  constexpr int kTrials = 40;
  for (int trial = 0; trial < kTrials; ++trial) {
    const CloudOf events(scene, make_events({edge}, scene, static_cast<std::uint64_t>(trial) + 1));
    Workspace memory(events.cloud);
    MovingLine line = guess_of(edge, 0.1F, 0.9F);
    REQUIRE(grow_and_fit(events.cloud, memory, &line) == FitOutcome::accepted);
    const EventLine found = shape(events.cloud, memory, line, options);
    const double error = distance_between(found.begin, edge.begin);
    REQUIRE(error >= 0);
    sum += error * error / (double{found.sigma_begin_px} * double{found.sigma_begin_px});
  }
  const double ratio = std::sqrt(sum / kTrials);
  CHECK(ratio > 0.5);
  CHECK(ratio < 1.6);
}

TEST_CASE("fit: the bend of a curved line is measured and its sign is that of the chord's normal") {
  SceneOptions scene;
  std::vector<MovingEdge> pieces;
  const auto y = [](float x) { return 100 + 0.0005F * (x - 170) * (x - 170); };  // 4.5 px of sag over 190 px
  for (float x = 75; x < 265; x += 5)
    pieces.push_back({{x, y(x), x + 5, y(x + 5)}, {x, y(x) + 4, x + 5, y(x + 5) + 4}});
  const CloudOf events(scene, make_events(pieces, scene));
  Workspace memory(events.cloud);
  MovingLine line = guess_of({{140, 100, 200, 100}, {140, 104, 200, 104}, 1}, 0, 1);
  REQUIRE(grow_and_fit(events.cloud, memory, &line) == FitOutcome::accepted);
  const EventLine found = shape(events.cloud, memory, line);
  CHECK(line.length() > 180);
  // The chord runs to the right, its normal points down; the curve's middle lies above.
  CHECK(double{found.bend_px} == doctest::Approx(-4.5).epsilon(0.1));
}

TEST_CASE("fit: what is no line is refused, with the reason") {
  SceneOptions scene;
  const auto outcome = [&](const std::vector<Event>& list, const MovingEdge& guess) {
    const CloudOf events(scene, list);
    Workspace memory(events.cloud);
    MovingLine line = guess_of(guess, 0, 1);
    const FitOutcome result = fit_line(events.cloud, LineFitOptions{}, memory.workspace, FitClaim{1, {}, 1, {}}, &line);
    for (const std::uint8_t owner : memory.workspace.owner) CHECK((owner == 0 || result == FitOutcome::accepted));
    return result;
  };
  const MovingEdge edge{{60, 60, 240, 180}, {64, 55, 244, 175}, 1};
  CHECK(outcome(make_events({edge}, scene), edge) == FitOutcome::accepted);
  CHECK(outcome(make_events({}, scene), edge) == FitOutcome::too_few_events);
  const MovingEdge dash{{60, 60, 72, 60}, {60, 65, 72, 65}, 1};
  CHECK(outcome(make_events({dash}, scene), dash) == FitOutcome::too_short);

  scene.noise_events = 60000;
  const FitOutcome of_noise = outcome(make_events({}, scene), edge);
  CHECK((of_noise == FitOutcome::low_contrast || of_noise == FitOutcome::too_thick || of_noise == FitOutcome::noise));
  scene.noise_events = 0;

  std::vector<Event> half = make_events({edge}, scene);
  for (Event& e : half) e.t_us = scene.begin_us + (e.t_us - scene.begin_us) / 50;
  const MovingEdge still{{60, 60, 240, 180}, {60, 60, 240, 180}, 1};
  const FitOutcome of_flash = outcome(half, still);
  CHECK(of_flash != FitOutcome::accepted);

  std::vector<MovingEdge> dots;  // eight hot pixels in a row
  for (float s = 0; s < 1; s += 0.125F) {
    const float x = 60 + 180 * s;
    const float y = 60 + 120 * s;
    dots.push_back({{x, y, x + 1, y}, {x, y, x + 1, y}, 1});
  }
  scene.events_per_px = 200;
  CHECK(outcome(make_events(dots, scene), still) == FitOutcome::uneven);
  scene.noise_px = 2.5;
  CHECK(outcome(make_events({edge}, scene), edge) == FitOutcome::too_thick);
}

TEST_CASE("merge: pieces of one line are joined, neighbours and rows with a gap are not") {
  SceneOptions scene;
  const auto merged_count = [&](const std::vector<MovingEdge>& edges, const std::vector<MovingLine>& guesses) {
    const CloudOf events(scene, make_events(edges, scene));
    Workspace memory(events.cloud);
    std::vector<MovingLine> lines;
    for (MovingLine line : guesses) {
      const auto id = static_cast<std::uint8_t>(lines.size() + 1);
      const FitClaim claim{id, {}, 1, {}};
      REQUIRE(fit_line(events.cloud, LineFitOptions{}, memory.workspace, claim, &line) == FitOutcome::accepted);
      lines.push_back(line);
    }
    std::size_t count = lines.size();
    merge_lines(events.cloud, MergeOptions{}, SharingOptions{}, LineFitOptions{}, memory.workspace, lines, &count);
    return count;
  };
  const MovingEdge edge{{40, 60, 300, 190}, {44, 55, 304, 185}, 1};
  CHECK(merged_count({edge}, {guess_of(edge, 0, 0.45F), guess_of(edge, 0.55F, 1)}) == 1);
  const MovingEdge beside{{40, 68, 300, 198}, {44, 63, 304, 193}, 1};
  CHECK(merged_count({edge, beside}, {guess_of(edge, 0, 1), guess_of(beside, 0, 1)}) == 2);
  const MovingEdge left{{40, 60, 140, 110}, {44, 55, 144, 105}, 1};
  const MovingEdge right{{200, 140, 300, 190}, {204, 135, 304, 185}, 1};
  CHECK(merged_count({left, right}, {guess_of(left, 0, 1), guess_of(right, 0, 1)}) == 2);
}
