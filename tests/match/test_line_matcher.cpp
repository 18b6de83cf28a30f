// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cstring>
#include <limits>
#include <vector>

#include "matcher_bench.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

struct Tally {
  std::size_t correct = 0, wrong = 0, present = 0;
};

/// Counts matches against the truth, up to a relabeling of the model.
Tally compare(const Scene& scene, Span<const LineMatch> matches, const std::vector<int>& relabel) {
  Tally tally;
  for (const std::vector<int>& window : scene.truth) {
    for (const int label : window) tally.present += label >= 0 ? 1 : 0;
  }
  for (const LineMatch& match : matches) {
    const int truth = scene.truth[match.window][match.line];
    const bool correct = truth >= 0 && relabel[static_cast<std::size_t>(truth)] == match.model_line;
    (correct ? tally.correct : tally.wrong) += 1;
  }
  return tally;
}

std::vector<int> same_labels(std::size_t count) {
  std::vector<int> labels(count);
  for (std::size_t i = 0; i < count; ++i) labels[i] = static_cast<int>(i);
  return labels;
}

}  // namespace

TEST_CASE("a box among clutter is matched without any hint about the camera") {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    CAPTURE(seed);
    SceneOptions options;
    options.camera = camera_640();
    options.model = box_model(0.4, 0.3, 0.25);
    options.seed = seed;
    const Scene scene = make_scene(options);
    Bench bench;
    REQUIRE(bench.init(scene, options) == Status::ok);
    REQUIRE(bench.run() == Status::ok);
    const Tally tally = compare(scene, bench.matcher.matches(), same_labels(options.model.size()));
    CHECK(tally.wrong <= 1);
    CHECK(tally.correct >= 0.85 * static_cast<double>(tally.present));
    CHECK(bench.matcher.camera().fx == doctest::Approx(options.camera.fx).epsilon(0.04));
    CHECK(bench.matcher.camera().cx == doctest::Approx(options.camera.cx).epsilon(0.04));
    for (const WindowPoses& poses : bench.matcher.poses()) {
      const Vec3 t = translation_of(scene.begin[poses.window]);
      CHECK((rotation_of(poses.begin) - rotation_of(scene.begin[poses.window])).norm() < 0.1);
      CHECK((translation_of(poses.begin) - t).norm() < 0.06 * t.norm());
      CHECK((rotation_of(poses.end) - rotation_of(scene.end[poses.window])).norm() < 0.1);
      CHECK(poses.num_matches >= poses.num_lines);
      for (std::size_t m = 0; m < poses.num_matches; ++m) {
        CHECK(bench.matcher.matches()[poses.first_match + m].window == poses.window);
      }
    }
  }
}

TEST_CASE("line_matcher: a box whose edges are found by halves is matched, an unlike box is not") {
  // As where the contrast of an edge changes its sign half way along it.
  SceneOptions options;
  options.camera = camera_640();
  options.camera.k1 = options.camera.k2 = 0.0;
  options.model = box_model(0.4, 0.3, 0.25);
  options.missing = options.broken = 0.0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    CAPTURE(seed);
    options.seed = seed;
    Scene scene = make_scene(options);
    for (std::size_t w = 0; w < scene.lines.size(); ++w) {
      if (w % 4 == 0) continue;  // whole ones to begin with
      for (std::size_t i = 0; i < scene.lines[w].size(); ++i) {
        if (scene.truth[w][i] < 0) continue;
        for (Segment* segment : {&scene.lines[w][i].begin, &scene.lines[w][i].end}) {
          segment->x2 = 0.5F * (segment->x1 + segment->x2);
          segment->y2 = 0.5F * (segment->y1 + segment->y2);
        }
      }
    }
    Bench bench;
    REQUIRE(bench.init(scene, options) == Status::ok);
    REQUIRE(bench.run() == Status::ok);
    CHECK(bench.matcher.stats().score < 0.7 * bench.matcher.stats().possible);
    const Tally tally = compare(scene, bench.matcher.matches(), same_labels(options.model.size()));
    CHECK(tally.wrong <= 1);
    CHECK(bench.matcher.camera().fx == doctest::Approx(options.camera.fx).epsilon(0.04));
    SceneOptions unlike = options;
    unlike.model = box_model(0.4, 0.2, 0.35);
    REQUIRE(bench.init(scene, unlike) == Status::ok);
    CHECK(bench.run() == Status::no_match);
  }
}

TEST_CASE("a rectangle is matched up to its symmetry") {
  int matched = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    CAPTURE(seed);
    SceneOptions options;
    options.camera = camera_640();
    options.model = rectangle_model(0.297, 0.21);
    options.eye = Vec3(-0.15, -0.25, 0.4);
    options.target = Vec3(0.15, 0.1, 0.0);
    options.missing = 0.08;
    options.seed = seed;
    const Scene scene = make_scene(options);
    Bench bench;
    REQUIRE(bench.init(scene, options) == Status::ok);
    const Status status = bench.run();
    if (status == Status::no_match) continue;
    REQUIRE(status == Status::ok);
    ++matched;
    std::size_t correct = 0;
    for (const std::vector<int>& relabel : {std::vector<int>{0, 1, 2, 3}, {2, 3, 0, 1}, {2, 1, 0, 3}, {0, 3, 2, 1}}) {
      correct = std::max(correct, compare(scene, bench.matcher.matches(), relabel).correct);
    }
    CHECK(correct + 1 >= bench.matcher.matches().size());
  }
  CHECK(matched >= 4);
}

TEST_CASE("a checkerboard is matched by its inner lines where its rim is not seen") {
  SceneOptions options;
  options.camera = camera_640();
  for (int i = 1; i < 8; ++i) options.model.push_back({{0.03 * i, 0, 0}, {0.03 * i, 0.18, 0}});
  for (int i = 1; i < 6; ++i) options.model.push_back({{0, 0.03 * i, 0}, {0.24, 0.03 * i, 0}});
  options.eye = Vec3(-0.1, -0.2, 0.35);
  options.target = Vec3(0.12, 0.09, 0.0);
  options.missing = 0.05;
  int matched = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    CAPTURE(seed);
    options.seed = seed;
    const Scene scene = make_scene(options);
    SceneOptions with_rim = options;
    for (const ModelLine& rim : rectangle_model(0.24, 0.18)) with_rim.model.push_back(rim);
    Bench bench;
    REQUIRE(bench.init(scene, with_rim) == Status::ok);
    const Status status = bench.run();
    if (status == Status::no_match) continue;
    REQUIRE(status == Status::ok);
    ++matched;
    // A board that is turned, or shifted by a square, makes the same camera: labels are not compared.
    CHECK(bench.matcher.camera().fx == doctest::Approx(options.camera.fx).epsilon(0.04));
  }
  CHECK(matched >= 5);
}

TEST_CASE("a wide lens with strong distortion is matched") {
  SceneOptions options;
  options.camera = camera_640();
  options.camera.fx = 300.0;
  options.camera.fy = 300.0;
  options.camera.k1 = -0.3;
  options.camera.k2 = 0.06;
  options.model = box_model(0.4, 0.3, 0.25);
  options.eye = Vec3(-0.3, -0.35, 0.5);
  const Scene scene = make_scene(options);
  Bench bench;
  REQUIRE(bench.init(scene, options) == Status::ok);
  REQUIRE(bench.run() == Status::ok);
  const Tally tally = compare(scene, bench.matcher.matches(), same_labels(options.model.size()));
  CHECK(tally.wrong <= 1);
  CHECK(tally.correct >= 0.8 * static_cast<double>(tally.present));
}

TEST_CASE("matching again through the true camera takes the predicted poses up") {
  SceneOptions options;
  options.camera = camera_640();
  options.model = box_model(0.4, 0.3, 0.25);
  options.seed = 3;
  const Scene scene = make_scene(options);
  Bench bench;
  REQUIRE(bench.init(scene, options) == Status::ok);
  const WindowPrediction prediction{5, scene.begin[5], scene.end[5]};
  REQUIRE(bench.matcher.rematch(options.camera, Span<const WindowPrediction>(&prediction, 1)) == Status::ok);
  REQUIRE(bench.run() == Status::ok);
  const Tally tally = compare(scene, bench.matcher.matches(), same_labels(options.model.size()));
  CHECK(tally.wrong <= 1);
  CHECK(tally.correct >= 0.9 * static_cast<double>(tally.present));
  CHECK(bench.matcher.camera().fx == options.camera.fx);
  for (const WindowPoses& poses : bench.matcher.poses()) {
    CHECK((rotation_of(poses.begin) - rotation_of(scene.begin[poses.window])).norm() < 0.02);
  }

  SUBCASE("its arguments are checked") {
    Camera other = options.camera;
    other.width = 320;
    CHECK(bench.matcher.rematch(other, Span<const WindowPrediction>(&prediction, 1)) == Status::invalid_argument);
    CHECK(bench.matcher.rematch(options.camera, {}) == Status::invalid_argument);
    WindowPrediction outside = prediction;
    outside.window = 12;
    CHECK(bench.matcher.rematch(options.camera, Span<const WindowPrediction>(&outside, 1)) == Status::invalid_argument);
  }
}

TEST_CASE("the same lines give the same bits") {
  SceneOptions options;
  options.camera = camera_640();
  options.model = box_model(0.4, 0.3, 0.25);
  const Scene scene = make_scene(options);
  Bench first;
  Bench second;
  REQUIRE(first.init(scene, options) == Status::ok);
  REQUIRE(second.init(scene, options) == Status::ok);
  REQUIRE(first.run() == Status::ok);
  REQUIRE(second.run() == Status::ok);
  CHECK(std::memcmp(&first.matcher.camera().fx, &second.matcher.camera().fx, 9 * sizeof(double)) == 0);
  REQUIRE(first.matcher.matches().size() == second.matcher.matches().size());
  // A second init() on the same object starts anew.
  const std::size_t count = first.matcher.matches().size();
  REQUIRE(first.init(scene, options) == Status::ok);
  REQUIRE(first.run() == Status::ok);
  CHECK(first.matcher.matches().size() == count);
  CHECK(std::memcmp(&first.matcher.camera().fx, &second.matcher.camera().fx, 9 * sizeof(double)) == 0);
}

TEST_CASE("capacities: exactly enough, one less, and counted losses") {
  SceneOptions options;
  options.camera = camera_640();
  options.model = box_model(0.4, 0.3, 0.25);
  const Scene scene = make_scene(options);

  LineMatcherCapacities exact;
  exact.windows = 12;
  exact.model_lines = 9;
  exact.model_quads = 3;
  Bench bench(exact);
  CHECK(bench.init(scene, options) == Status::ok);
  CHECK(bench.arena.peak() == bytes_of(exact));
  CHECK(bench.run() == Status::ok);

  LineMatcherCapacities fewer = exact;
  fewer.windows = 11;
  CHECK(Bench(fewer).init(scene, options) == Status::capacity_exceeded);
  fewer = exact;
  fewer.model_lines = 8;
  CHECK(Bench(fewer).init(scene, options) == Status::capacity_exceeded);

  Bench small(exact);
  small.memory.resize(small.memory.size() / 2);
  CHECK(small.init(scene, options) == Status::buffer_too_small);

  LineMatcherCapacities tight = exact;
  tight.lines = 10;
  tight.matches = 8;
  tight.model_quads = 2;
  tight.quads = {16, 12, 4};
  tight.seeds = 2;
  Bench counted(tight);
  REQUIRE(counted.init(scene, options) == Status::ok);
  const Status status = counted.run();
  CHECK((status == Status::ok || status == Status::no_match));
  CHECK((status == Status::ok) == !counted.matcher.matches().empty());
  CHECK(counted.matcher.stats().lines_dropped > 0);
  CHECK(counted.matcher.stats().model_quads_dropped == 1);
}

TEST_CASE("bad input is told by its status") {
  SceneOptions options;
  options.camera = camera_640();
  options.model = box_model(0.4, 0.3, 0.25);
  options.windows = 2;
  Scene scene = make_scene(options);
  Bench bench;
  CHECK(bench.matcher.step() == Status::wrong_state);
  CHECK(bench.matcher.rematch(options.camera, {}) == Status::wrong_state);

  SceneOptions bad = options;
  bad.model.resize(3);
  CHECK(bench.init(scene, bad) == Status::too_few_lines);
  bad = options;
  bad.model[4].q[1] = std::numeric_limits<double>::quiet_NaN();
  CHECK(bench.init(scene, bad) == Status::invalid_argument);
  bad = options;
  std::memcpy(bad.model[0].q, bad.model[0].p, sizeof bad.model[0].p);
  CHECK(bench.init(scene, bad) == Status::invalid_argument);
  bad = options;
  bad.model = {{{0, 0, 0}, {1, 0, 0}}, {{0, 1, 0}, {1, 1, 0}}, {{0, 2, 0}, {1, 2, 0}}, {{0, 0, 1}, {1, 0, 1}}};
  CHECK(bench.init(scene, bad) == Status::degenerate_geometry);
  bad.model = {{{0, 0, 0}, {1, 0, 0}}, {{0, 0, 0}, {0, 1, 0}}, {{0, 0, 0}, {0, 0, 1}}, {{3, 3, 3}, {4, 5, 6}}};
  CHECK(bench.init(scene, bad) == Status::degenerate_geometry);
  bad = options;
  bad.camera.width = 0;
  CHECK(bench.init(scene, bad) == Status::invalid_argument);
  CHECK(bench.matcher.step() == Status::wrong_state);

  LineMatcherOptions views;
  views.width = 640;
  views.height = 480;
  CHECK(valid(views));
  views.hints.focal_px = 25.0 * 640;
  CHECK(valid(views));
  CHECK(bench.init(scene, options, views.hints) == Status::ok);
  for (const double focal_px : {26.0 * 640, 0.02 * 640}) {
    views.hints.focal_px = focal_px;
    CHECK_FALSE(valid(views));
    CHECK(bench.init(scene, options, views.hints) == Status::invalid_argument);
  }
  views.hints = {};
  views.min_fov_deg = 5.0;
  views.max_fov_deg = 160.0;
  CHECK(valid(views));

  scene.lines[1][0].begin.x1 = std::numeric_limits<float>::infinity();
  CHECK(bench.init(scene, options) == Status::invalid_argument);
  scene.windows.clear();
  CHECK(bench.init(scene, options) == Status::too_few_lines);
}
