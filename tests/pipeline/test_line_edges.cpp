// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "lecalib/pipeline/line_detector.hpp"
#include "lecalib/segments/line_crossings.hpp"
#include "support/alloc_counter.hpp"
#include "support/dense_algebra.hpp"
#include "support/edge_stream.hpp"
#include "support/guarded_arena.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

struct EdgeDetector {
  explicit EdgeDetector(const SceneOptions& scene, std::size_t events = 60000) {
    DetectorCapacities capacities;
    capacities.events = events;
    capacities.width = scene.width;
    capacities.height = scene.height;
    memory = std::make_unique<GuardedArena>(detector_bytes(capacities));
    REQUIRE(carve(memory->arena(), capacities, &workspace));
    options.cloud.width = scene.width;
    options.cloud.height = scene.height;
    options.find_edges = line_edges;
  }
  /// The line with most events, or null.
  const EventLine* detect(const SceneOptions& scene, const std::vector<Event>& events) {
    const AllocScope heap;
    const Status status = detect_lines(window_of(scene, events), options, &workspace, lines, &count, &stats);
    const std::size_t allocations = heap.allocations();
    CHECK(allocations == 0);
    CHECK(status == Status::ok);
    return count > 0 ? lines : nullptr;
  }

  std::unique_ptr<GuardedArena> memory;
  DetectorWorkspace workspace;
  DetectorOptions options;
  EventLine lines[32];
  std::size_t count = 0;
  DetectorStats stats;
};

/// Mean distance of an edge's points from the truth at their times, px, towards the dark.
double edge_error(const LineEdge& edge, const StepEdge& truth, const SceneOptions& scene) {
  double sum = 0;
  for (int time = 0; time < 2; ++time) {
    const double t = (time == 0 ? -0.5e-6 : 0.5e-6) * double{kEdgeTime} * static_cast<double>(scene.length_us);
    for (int i = 0; i < 3; ++i) {
      sum += truth.across(double{edge.x[time][i]}, double{edge.y[time][i]}) - truth.speed_px_per_s * t;
    }
  }
  return sum / 6;
}

/// From an edge's first place to its last: how much further towards the dark it lies there than the truth, px.
double edge_tilt(const LineEdge& edge, const StepEdge& truth) {
  double sum = 0;
  for (int time = 0; time < 2; ++time) {
    sum += truth.across(double{edge.x[time][2]}, double{edge.y[time][2]}) -
           truth.across(double{edge.x[time][0]}, double{edge.y[time][0]});
  }
  return sum / 2;
}

/// The piece of an edge that is centred `along_px` from its middle.
StepEdge piece_of(const StepEdge& edge, double along_px, double half_length_px) {
  StepEdge piece = edge;
  piece.centre_x -= along_px * std::sin(edge.angle);
  piece.centre_y += along_px * std::cos(edge.angle);
  piece.half_length_px = half_length_px;
  return piece;
}

std::vector<Event> events_of(const std::vector<StepEdge>& pieces, const SceneOptions& scene) {
  std::vector<Event> events;
  for (const StepEdge& piece : pieces) {
    const std::vector<Event> more = events_of(piece, scene, 0.24);
    events.insert(events.end(), more.begin(), more.end());
  }
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.t_us < b.t_us; });
  return events;
}

/// The same of the fit to all events alike.
double line_error(const EventLine& line, const StepEdge& truth) {
  const Segment& a = line.begin;
  const Segment& b = line.end;
  const float xs[] = {a.x1, a.x2, b.x1, b.x2};
  const float ys[] = {a.y1, a.y2, b.y1, b.y2};
  double sum = 0;
  for (int i = 0; i < 4; ++i) sum += truth.across(double{xs[i]}, double{ys[i]});
  return sum / 4;
}

}  // namespace

TEST_CASE("line edges: an edge is where the intensity is half way, whatever its contrast, polarity and direction") {
  const SceneOptions scene;
  EdgeDetector detector(scene);
  double worst_line = 0;
  for (const double contrast : {2.0, 3.0, 5.0, 8.0}) {
    for (const double angle : {0.3, 1.2, 2.5, -2.0}) {
      for (const double speed : {600.0, -600.0}) {
        CAPTURE(contrast);
        CAPTURE(angle);
        CAPTURE(speed);
        StepEdge truth;
        truth.contrast = contrast;
        truth.angle = angle;
        truth.speed_px_per_s = speed;
        const EventLine* const line = detector.detect(scene, events_of(truth, scene, 0.24));
        REQUIRE(line != nullptr);
        REQUIRE(line->edge.crossings > 0);
        CHECK(line->polarity == (speed > 0 ? 1 : -1));
        // ln C / theta - 1, on average.
        CHECK(double{line->edge.events_per_crossing} == doctest::Approx(std::log(contrast) / 0.24 - 1).epsilon(0.1));
        CHECK(std::fabs(double{line->edge.speed_px_per_s}) == doctest::Approx(600).epsilon(0.02));
        CHECK(std::fabs(edge_error(line->edge, truth, scene)) < (contrast < 2.5 ? 0.14 : 0.08));
        CHECK(double{line->edge.scatter_px} < 0.18);
        worst_line = std::max(worst_line, std::fabs(line_error(*line, truth)));
      }
    }
  }
  CHECK(worst_line > 0.3);
}

TEST_CASE("line edges: an edge whose contrast changes along it is not tilted by that") {
  const SceneOptions scene;
  EdgeDetector detector(scene);
  for (const double speed : {600.0, -600.0}) {
    CAPTURE(speed);
    StepEdge truth;
    truth.speed_px_per_s = speed;
    std::vector<StepEdge> pieces;
    for (int i = -4; i <= 4; ++i) {
      pieces.push_back(piece_of(truth, 20.0 * i, 10));
      pieces.back().contrast = std::exp(0.24 * (2.7 + 0.15 * i));  // 1.1 to 2.3 events per crossing
    }
    const EventLine* const line = detector.detect(scene, events_of(pieces, scene));
    REQUIRE(line != nullptr);
    REQUIRE(line->edge.crossings > 0);
    CHECK(std::fabs(edge_tilt(line->edge, truth)) < 0.08);
  }
}

TEST_CASE("line edges: what is otherwise at a line's very ends leaves its edge alone") {
  const SceneOptions scene;
  EdgeDetector detector(scene);
  const auto tilt_at = [&](double off_px) {
    const StepEdge truth;
    std::vector<StepEdge> pieces = {piece_of(truth, 0, 29), piece_of(truth, 30, 1)};
    pieces.back().centre_x += off_px * std::cos(truth.angle);
    pieces.back().centre_y += off_px * std::sin(truth.angle);
    const EventLine* const line = detector.detect(scene, events_of(pieces, scene));
    REQUIRE(line != nullptr);
    REQUIRE(line->edge.crossings > 0);
    return edge_tilt(line->edge, truth);
  };
  const double moved = std::fabs(tilt_at(0.8) - tilt_at(0));
  detector.options.crossings.end_margin_px = 0;
  const double moved_by_all = std::fabs(tilt_at(0.8) - tilt_at(0));
  CHECK(moved < 0.5 * moved_by_all);
}

TEST_CASE("line edges: a threshold that is wrong by a third moves an edge by less than a tenth of a pixel") {
  const SceneOptions scene;
  EdgeDetector detector(scene);
  for (const float threshold : {0.18F, 0.32F}) {
    for (const double speed : {600.0, -600.0}) {
      StepEdge truth;
      truth.speed_px_per_s = speed;
      const std::vector<Event> events = events_of(truth, scene, double{threshold});
      double error[2] = {};
      for (const bool known : {false, true}) {
        detector.options.crossings.threshold = known ? threshold : 0.24F;
        const EventLine* const line = detector.detect(scene, events);
        REQUIRE(line != nullptr);
        REQUIRE(line->edge.crossings > 0);
        error[known ? 1 : 0] = edge_error(line->edge, truth, scene);
      }
      CHECK(std::fabs(error[1] - error[0]) < 0.1);
    }
  }
}

TEST_CASE("line edges: pixels that the window cuts pull an edge that moves little, and are left out") {
  const SceneOptions scene;
  EdgeDetector detector(scene);
  const float margin_px = detector.options.crossings.edge_margin_px;
  double pulled = 0;
  double pulled_by_all = 0;
  for (const double contrast : {3.0, 5.0}) {
    for (const double sign : {1.0, -1.0}) {
      CAPTURE(contrast);
      CAPTURE(sign);
      StepEdge truth;
      truth.contrast = contrast;
      truth.blur_px = 0.9;
      const auto error_at = [&](double speed_px_per_s, float edge_margin_px) {
        detector.options.crossings.edge_margin_px = edge_margin_px;
        truth.speed_px_per_s = sign * speed_px_per_s;
        const EventLine* const line = detector.detect(scene, events_of(truth, scene, 0.24));
        REQUIRE(line != nullptr);
        REQUIRE(line->edge.crossings > 0);
        return edge_error(line->edge, truth, scene);
      };
      const double fast = error_at(600, margin_px);
      pulled += std::fabs(error_at(300, margin_px) - fast);
      pulled_by_all += std::fabs(error_at(300, -10) - fast);
    }
  }
  CHECK(pulled < 0.8 * pulled_by_all);
}

TEST_CASE("line edges: a line that hardly moves crosses no pixel entirely, and has no edge") {
  const SceneOptions scene;
  EdgeDetector detector(scene);
  StepEdge truth;
  truth.speed_px_per_s = 90;
  const EventLine* const line = detector.detect(scene, events_of(truth, scene, 0.1));
  REQUIRE(line != nullptr);
  CHECK(line->edge.crossings == 0);
}

TEST_CASE("line edges: thinned windows have none, and nobody has who did not ask") {
  const SceneOptions scene;
  const std::vector<Event> events = events_of(StepEdge{}, scene, 0.24);
  EdgeDetector small(scene, events.size() - 1);
  const EventLine* line = small.detect(scene, events);
  REQUIRE(line != nullptr);
  CHECK(line->edge.crossings == 0);
  EdgeDetector detector(scene, events.size());
  line = detector.detect(scene, events);
  REQUIRE(line != nullptr);
  CHECK(line->edge.crossings > 0);
  CHECK(detector.stats.crossings_dropped == 0);
  detector.options.find_edges = nullptr;
  line = detector.detect(scene, events);
  REQUIRE(line != nullptr);
  CHECK(line->edge.crossings == 0);
}

TEST_CASE("line edges: of more crossings than there is room for an even share is taken, the rest counted") {
  SceneOptions scene;
  scene.width = 1280;
  scene.height = 720;
  StepEdge truth;
  truth.centre_x = 640;
  truth.centre_y = 360;
  truth.half_length_px = 300;
  truth.speed_px_per_s = 2400;
  EdgeDetector detector(scene);
  const EventLine* const line = detector.detect(scene, events_of(truth, scene, 0.24));
  REQUIRE(line != nullptr);
  REQUIRE(line->edge.crossings > 0);
  CHECK(line->edge.crossings <= kMaxListedEvents);
  CHECK(2 * detector.stats.crossings_dropped > line->edge.crossings);
  CHECK(std::fabs(edge_error(line->edge, truth, scene)) < 0.08);
}

TEST_CASE("line edges: at their places and times the errors of a fit are not correlated") {
  // A fit linear in time and quadratic along the line, from data spread evenly over the square.
  constexpr int kSteps = 200;
  using Row = Eigen::Matrix<double, 6, 1>;
  const auto row = [](double u, double t) { return (Row() << 1, u, u * u, t, t * u, t * u * u).finished(); };
  Mat6 normal = Mat6::Zero();
  for (int i = 0; i < kSteps; ++i) {
    for (int k = 0; k < kSteps; ++k) {
      const Row r = row(2 * (i + 0.5) / kSteps - 1, 2 * (k + 0.5) / kSteps - 1);
      normal += r * r.transpose() / (kSteps * kSteps);
    }
  }
  Mat6 places;
  for (int n = 0; n < 6; ++n) {
    const double t = (n < 3 ? -1 : 1) / std::sqrt(3.0);
    places.row(n) = row(double{kEdgePlaces[n % 3]}, t).transpose();
  }
  const Eigen::MatrixXd covariance = dense_product(places, dense_solve(normal, places.transpose()));
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < 6; ++k) {
      const double expected = i == k ? 2 / double{kEdgePlaceWeights[i % 3]} : 0;
      CHECK(covariance(i, k) == doctest::Approx(expected).epsilon(1e-3).scale(1));
    }
  }
}
