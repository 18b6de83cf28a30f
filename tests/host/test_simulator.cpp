// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "lecalib/host/file_io.hpp"
#include "lecalib/host/simulator.hpp"
#include "lecalib/host/simulator_truth.hpp"
#include "lecalib/math/camera_model.hpp"
#include "lecalib/math/so3.hpp"
#include "support/json_file.hpp"
#include "support/temporary_folder.hpp"

using namespace lecalib;
using namespace lecalib::host;

namespace {

constexpr const char* kBox = "box:0.4x0.3x0.25";

SimulatorOptions small_options() {
  SimulatorOptions options;
  options.camera = {120, 90, 100, 101, 61, 43, -0.2, 0.03, 0.001, -0.0005, 0};
  options.duration_s = 0.06;
  options.views = 4;
  return options;
}

SimulatorOptions without_noise() {
  SimulatorOptions options = small_options();
  options.sensor.noise_hz = options.sensor.hot_fraction = 0;
  return options;
}

bool same(const Event& a, const Event& b) {
  return a.t_us == b.t_us && a.x == b.x && a.y == b.y && a.polarity == b.polarity;
}

double distance_to_segment(const Vec2& at, const Vec2& a, const Vec2& b) {
  const Vec2 along = b - a;
  const double s = std::clamp((at - a).dot(along) / std::max(along.squaredNorm(), 1e-12), 0.0, 1.0);
  return (at - a - s * along).norm();
}

/// Distance to the nearest visible piece of a line, px.
double distance_to_lines(const TrueView& view, const Vec2& at) {
  double nearest = 1e9;
  for (const TrueLine& line : view.lines) {
    for (std::size_t i = 0; i + 1 < kTruthPoints; ++i) {
      if (line.visible[i] && line.visible[i + 1]) {
        nearest = std::min(nearest, distance_to_segment(at, line.uv[i], line.uv[i + 1]));
      }
    }
  }
  return nearest;
}

}  // namespace

TEST_CASE("simulate: the same input gives the same events, another seed others") {
  SimulatorOptions options = small_options();
  const auto first = simulate(kBox, options);
  const auto second = simulate(kBox, options);
  REQUIRE(first.ok());
  const auto& a = first.value().events;
  const auto& b = second.value().events;
  CHECK(a.size() > 1000);
  CHECK(a.size() == b.size());
  CHECK(std::equal(a.begin(), a.end(), b.begin(), same));
  CHECK(std::is_sorted(a.begin(), a.end(), [](const Event& x, const Event& y) { return x.t_us < y.t_us; }));
  options.seed = 2;
  const auto third = simulate(kBox, options);
  CHECK_FALSE(std::equal(a.begin(), a.end(), third.value().events.begin(), third.value().events.end(), same));
}

TEST_CASE("simulate: the true lines carry the events") {
  SimulatorOptions options = without_noise();
  options.views = 61;  // one per ms
  // The rectangle's own outline is most of what moves; print and table make the rest.
  const auto recording = simulate("rectangle:0.3x0.2", options);
  REQUIRE(recording.ok());
  std::vector<double> near;
  for (const Event& event : recording.value().events) {
    const auto view = static_cast<std::size_t>((event.t_us - options.start_us + 500) / 1000);
    const double distance =
        distance_to_lines(recording.value().views[std::min<std::size_t>(view, 60)], Vec2(event.x, event.y));
    if (distance < 3.0) near.push_back(distance);
  }
  REQUIRE(near.size() > 500);
  std::nth_element(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(near.size() / 2), near.end());
  CHECK(near[near.size() / 2] < 0.7);
}

TEST_CASE("simulate: half the threshold makes about twice the events") {
  SimulatorOptions options = without_noise();
  options.sensor.refractory_us = 0;
  options.sensor.threshold = 0.1;
  const auto sensitive = simulate(kBox, options);
  options.sensor.threshold = 0.2;
  const auto dull = simulate(kBox, options);
  REQUIRE(sensitive.ok());
  REQUIRE(dull.ok());
  const double ratio =
      static_cast<double>(sensitive.value().events.size()) / static_cast<double>(dull.value().events.size());
  CHECK(ratio > 1.8);
  CHECK(ratio < 3.0);
}

TEST_CASE("true_view: a box shows an edge exactly when one of its two faces looks at the camera") {
  const Model model = make_target(kBox).value();
  const Scene scene = make_scene(kBox, model).value();
  const Vec3 size(0.4, 0.3, 0.25);
  const Camera camera{640, 480, 300, 300, 319.5, 239.5, 0, 0, 0, 0, 0};
  for (const Vec3& eye : {Vec3(-0.5, -0.6, 0.8), Vec3(0.2, -0.9, 0.1), Vec3(0.9, 0.7, 0.9), Vec3(0.2, 0.15, 1.2)}) {
    const Vec3 forward = (0.5 * size - eye).normalized();
    const Vec3 x = forward.cross(Vec3(0.1, 0.05, 1)).normalized();
    Mat3 R;
    R << x.transpose(), forward.cross(x).transpose(), forward.transpose();
    const TrueView view = true_view(scene, model, camera, make_pose(R, -R * eye), 0);
    for (std::size_t i = 0; i < model.lines.size(); ++i) {
      const Vec3 p(model.lines[i].p), q(model.lines[i].q);
      bool expected = false;
      for (int axis = 0; axis < 3; ++axis) {
        if (p(axis) != q(axis)) continue;
        expected = expected || (p(axis) == 0 ? eye(axis) < 0 : eye(axis) > size(axis));
      }
      for (std::size_t k = 1; k + 1 < kTruthPoints; ++k) CHECK(view.lines[i].visible[k] == expected);
    }
  }
}

TEST_CASE("true_view: nothing behind the camera or beside the image is visible") {
  const Model model = make_target("rectangle:2x2").value();
  const Scene scene = make_scene("rectangle:2x2", model).value();
  const Camera camera{100, 100, 100, 100, 49.5, 49.5, 0, 0, 0, 0, 0};
  Mat3 R;
  R << 1, 0, 0, 0, -1, 0, 0, 0, -1;  // looks down on the sheet
  const TrueView above = true_view(scene, model, camera, make_pose(R, -R * Vec3(0, 1, 1)), 0);
  // The left edge, x = 0 from y = 2 to y = 0, crosses the image from row -50.5 to row 149.5.
  for (std::size_t k = 0; k < kTruthPoints; ++k) {
    const double row = 49.5 + 100.0 * (static_cast<double>(k) / 16 - 1);
    CHECK(above.lines[3].uv[k](1) == doctest::Approx(row));
    CHECK(above.lines[3].visible[k] == (row >= 0 && row <= 99));
    CHECK_FALSE(above.lines[1].visible[k]);
  }
  const TrueView behind = true_view(scene, model, camera, make_pose(R, -R * Vec3(0, 1, -1)), 0);
  for (const TrueLine& line : behind.lines)
    CHECK(std::none_of(line.visible, line.visible + kTruthPoints, [](bool v) { return v; }));
}

TEST_CASE("write_recording: model and truth read back and agree with the camera model") {
  const SimulatorOptions options = small_options();
  const auto recording = simulate(kBox, options);
  REQUIRE(recording.ok());
  CHECK(recording.value().model.lines.size() == 9);
  const test::TemporaryFolder folder;
  REQUIRE_FALSE(write_recording(recording.value(), folder / "new").has_value());
  const auto model = read_model(folder / "new/model.txt");
  REQUIRE(model.ok());
  CHECK(model.value().names == recording.value().model.names);
  CHECK(read_text_file(folder / "new/events.raw").value().size() > 2 * recording.value().events.size());

  const auto truth = test::json_of(folder / "new/truth.json");
  Camera camera;
  camera.width = truth["camera"]["width"];
  camera.height = truth["camera"]["height"];
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) camera.*kIntrinsics[i] = truth["camera"][kIntrinsicNames[i]];
  CHECK(camera.k1 == options.camera.k1);
  const auto& q = truth["poses"]["q_wxyz"].front();
  const auto& t = truth["poses"]["t"].front();
  CHECK(truth["poses"]["t_us"].front() == options.start_us);
  CHECK(truth["poses"]["t_us"].size() == 61);
  const Eigen::Quaterniond rotation(q[0].get<double>(), q[1].get<double>(), q[2].get<double>(), q[3].get<double>());
  const auto& view = truth["lines_2d"].front();
  CHECK(view["t_us"] == options.start_us);
  for (std::size_t i = 0; i < truth["lines_3d"].size(); ++i) {
    const auto& line = truth["lines_3d"][i];
    CHECK(line["name"] == view["lines"][i]["name"]);
    for (const auto& [end, index] : {std::pair{"p", 0}, std::pair{"q", 32}}) {
      const Vec3 point(line[end][0].get<double>(), line[end][1].get<double>(), line[end][2].get<double>());
      const Vec3 x_cam = rotation * point + Vec3(t[0].get<double>(), t[1].get<double>(), t[2].get<double>());
      Vec2 pixel;
      REQUIRE(project(camera, x_cam, &pixel));
      const auto& uv = view["lines"][i]["uv"][static_cast<std::size_t>(index)];
      CHECK(std::abs(pixel(0) - uv[0].get<double>()) < 1e-3);
      CHECK(std::abs(pixel(1) - uv[1].get<double>()) < 1e-3);
    }
  }
}

TEST_CASE("simulate: every kind of target makes events") {
  const test::TemporaryFolder folder;
  const std::string solid = folder / "solid.txt", flat = folder / "flat.txt";
  REQUIRE_FALSE(write_file(solid, model_text(make_target(kBox).value())).has_value());
  REQUIRE_FALSE(write_file(flat, model_text(make_target("rectangle:0.3x0.2").value())).has_value());
  SimulatorOptions options = without_noise();
  options.duration_s = 0.02;
  for (const std::string& target :
       {std::string("rectangle:0.3x0.2"), std::string("checkerboard:6x5:0.03"), "file:" + solid, "file:" + flat}) {
    double done = 0;
    const auto recording = simulate(target, options, [&](double part) {
      CHECK(part >= done);
      done = part;
    });
    REQUIRE(recording.ok());
    CHECK(done == 1.0);
    CHECK(recording.value().events.size() > 100);
    CHECK(recording.value().model.lines.size() >= 4);
  }
}

TEST_CASE("simulate: options out of range are errors") {
  const auto refused = [](auto change) {
    SimulatorOptions options = small_options();
    change(&options);
    return !simulate(kBox, options).ok();
  };
  CHECK(refused([](SimulatorOptions* o) { o->camera.width = 0; }));
  CHECK(refused([](SimulatorOptions* o) { o->camera.height = 2049; }));
  CHECK(refused([](SimulatorOptions* o) { o->camera.fx = 0; }));
  CHECK(refused([](SimulatorOptions* o) { o->camera.k1 = NAN; }));
  CHECK(refused([](SimulatorOptions* o) { o->duration_s = 0; }));
  CHECK(refused([](SimulatorOptions* o) { o->speed = -1; }));
  CHECK(refused([](SimulatorOptions* o) { o->start_us = -1; }));
  CHECK(refused([](SimulatorOptions* o) { o->pose_rate_hz = 0; }));
  CHECK(refused([](SimulatorOptions* o) { o->views = 1; }));
  CHECK(refused([](SimulatorOptions* o) { o->sensor.threshold = 0; }));
  CHECK(refused([](SimulatorOptions* o) { o->sensor.bandwidth_hz = 0; }));
  CHECK(refused([](SimulatorOptions* o) { o->sensor.noise_hz = -1; }));
  CHECK(refused([](SimulatorOptions* o) { o->sensor.hot_fraction = 1; }));
  CHECK(refused([](SimulatorOptions* o) { o->sensor.refractory_us = -1; }));
  CHECK(refused([](SimulatorOptions* o) { o->sensor.jitter_us = -1; }));
  CHECK(refused([](SimulatorOptions* o) { o->sensor.threshold_spread = -1; }));
  CHECK(refused([](SimulatorOptions* o) { o->sensor.threshold_noise = -1; }));
  CHECK(refused([](SimulatorOptions* o) { o->camera.cx = 1e6; }));  // never sees the target
  CHECK_FALSE(simulate("sphere:1", small_options()).ok());
}
