// SPDX-License-Identifier: MIT
/// What the matcher believes of what it finds.
#include <doctest/doctest.h>

#include <vector>

#include "matcher_bench.hpp"

using namespace lecalib;
using namespace lecalib::test;

TEST_CASE("pure clutter and a wrong model are refused") {
  SceneOptions options;
  options.camera = camera_640();
  options.model = box_model(0.4, 0.3, 0.25);
  SUBCASE("pure clutter") {
    options.missing = 1.0;
    options.clutter = 40;
    const Scene scene = make_scene(options);
    Bench bench;
    REQUIRE(bench.init(scene, options) == Status::ok);
    CHECK(bench.run() == Status::no_match);
    CHECK(bench.matcher.matches().empty());
  }
  SUBCASE("the model of another box") {
    const Scene scene = make_scene(options);
    options.model = box_model(0.2, 0.6, 0.1);
    Bench bench;
    REQUIRE(bench.init(scene, options) == Status::ok);
    CHECK(bench.run() == Status::no_match);
  }
  SUBCASE("the model of a box that is smaller or larger by some centimetres: its edges lie beside those found") {
    const Scene scene = make_scene(options);
    for (const std::vector<ModelLine>& model :
         {box_model(0.4, 0.22, 0.28), box_model(0.4, 0.22, 0.30), box_model(0.4, 0.26, 0.35)}) {
      options.model = model;
      Bench bench;
      REQUIRE(bench.init(scene, options) == Status::ok);
      CHECK(bench.run() == Status::no_match);
    }
  }
  SUBCASE("no lines at all") {
    Scene scene = make_scene(options);
    for (LineWindow& window : scene.windows) window.lines = {};
    Bench bench;
    REQUIRE(bench.init(scene, options) == Status::ok);
    CHECK(bench.run() == Status::no_match);
  }
}

TEST_CASE("line_matcher: a guess that is not believed tells which lines of the model it finds") {
  SceneOptions options;
  options.camera = camera_640();
  options.model = box_model(0.4, 0.3, 0.25);
  options.missing = 0.0;
  const std::size_t unseen = 4;
  Scene scene = make_scene(options);
  for (std::size_t w = 0; w < scene.lines.size(); ++w) {
    std::vector<EventLine> kept;
    for (std::size_t i = 0; i < scene.lines[w].size(); ++i) {
      EventLine line = scene.lines[w][i];
      if (scene.truth[w][i] == static_cast<int>(unseen)) continue;
      if (scene.truth[w][i] >= 0 && w % 4 != 0) {  // whole ones to begin with, else too little to be believed
        for (Segment* segment : {&line.begin, &line.end}) {
          segment->x2 = segment->x1 + 0.3F * (segment->x2 - segment->x1);
          segment->y2 = segment->y1 + 0.3F * (segment->y2 - segment->y1);
        }
      }
      kept.push_back(line);
    }
    scene.lines[w] = kept;
    scene.windows[w].lines = scene.lines[w];
  }
  Bench bench;
  CHECK(bench.matcher.windows_explained() == 0);
  CHECK(bench.matcher.windows_with(0) == 0);
  REQUIRE(bench.init(scene, options) == Status::ok);
  CHECK(bench.matcher.windows_with(0) == 0);
  REQUIRE(bench.run() == Status::no_match);
  const std::size_t windows = bench.matcher.windows_explained();
  REQUIRE(2 * windows > scene.windows.size());
  for (std::size_t i = 0; i < options.model.size(); ++i) {
    CAPTURE(i);
    CHECK((2 * bench.matcher.windows_with(i) > windows) == (i != unseen));
    CHECK(bench.matcher.windows_with(i) <= windows);
  }
}

TEST_CASE("a provisional result is judged once its camera comes back") {
  SceneOptions options;
  options.camera = camera_640();
  options.model = box_model(0.4, 0.3, 0.25);
  const Scene scene = make_scene(options);
  for (const bool right : {true, false}) {
    CAPTURE(right);
    if (!right) options.model = box_model(0.4, 0.22, 0.28);
    Bench bench;
    REQUIRE(bench.init(scene, options, {}, true) == Status::ok);
    const Status at_first = bench.run();
    if (right) REQUIRE(at_first == Status::ok);
    if (at_first != Status::ok) continue;
    const std::vector<WindowPoses> found(bench.matcher.poses().begin(), bench.matcher.poses().end());
    std::vector<WindowPrediction> predictions;
    for (const WindowPoses& poses : found) predictions.push_back({poses.window, poses.begin, poses.end});
    REQUIRE(bench.matcher.rematch(bench.matcher.camera(), predictions) == Status::ok);
    CHECK(bench.run() == (right ? Status::ok : Status::no_match));
  }
}
