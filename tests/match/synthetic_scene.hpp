// SPDX-License-Identifier: MIT
/// Line windows of a moving object, computed from the model through the full camera of math/: nothing of match/ is
/// used.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "lecalib/core/records.hpp"
#include "lecalib/core/rng.hpp"
#include "lecalib/math/camera_model.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib::test {

inline double gaussian(Rng& rng) {
  double sum = 0.0;
  for (int i = 0; i < 12; ++i) sum += rng.uniform();
  return sum - 6.0;
}

inline std::vector<ModelLine> rectangle_model(double a, double b) {
  return {{{0, 0, 0}, {a, 0, 0}}, {{a, 0, 0}, {a, b, 0}}, {{a, b, 0}, {0, b, 0}}, {{0, b, 0}, {0, 0, 0}}};
}

/// The nine edges of a box that are seen from its (-, -, +) side.
inline std::vector<ModelLine> box_model(double a, double b, double c) {
  return {{{0, 0, 0}, {a, 0, 0}}, {{0, 0, 0}, {0, b, 0}}, {{0, 0, 0}, {0, 0, c}},
          {{a, 0, 0}, {a, 0, c}}, {{0, b, 0}, {0, b, c}}, {{0, 0, c}, {a, 0, c}},
          {{0, 0, c}, {0, b, c}}, {{a, 0, c}, {a, b, c}}, {{0, b, c}, {a, b, c}}};
}

/// R such that a camera at `eye` looks at `target` with world z up.
inline Pose look_at(const Vec3& eye, const Vec3& target, double roll) {
  const Vec3 z = (target - eye).normalized();
  const Vec3 x = Vec3(0.05, 0.02, -1.0).cross(z).normalized();
  Mat3 R;
  R.row(0) = x;
  R.row(1) = z.cross(x);
  R.row(2) = z;
  R = so3_exp(Vec3(0, 0, roll)) * R;
  return make_pose(R, -R * eye);
}

struct SceneOptions {
  Camera camera;
  std::vector<ModelLine> model;
  Vec3 eye = Vec3(-0.6, -0.7, 0.8);
  Vec3 target = Vec3(0.15, 0.1, 0.1);
  int windows = 12;
  int clutter = 12;       ///< lines per window that are not the model's
  double missing = 0.15;  ///< share of model lines that are not detected
  double broken = 0.15;   ///< share that is detected in two pieces
  double noise_px = 0.3;
  double sway = 0.12;  ///< amplitude of the motion, share of the distance
  std::uint64_t seed = 1;
};

struct Scene {
  std::vector<std::vector<EventLine>> lines;
  std::vector<std::vector<int>> truth;  ///< model line of each detected line, -1 clutter
  std::vector<LineWindow> windows;      ///< views of `lines`
  std::vector<Pose> begin, end;
};

inline bool image_of(const Camera& camera, const Pose& pose, const Vec3& point, Vec2* pixel) {
  const Vec3 x = rotation_of(pose) * point + translation_of(pose);
  if (x.z() <= 0.0 || !project(camera, x, pixel)) return false;
  return pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() <= camera.width - 1 && pixel->y() <= camera.height - 1;
}

inline Segment segment_of(const Vec2& a, const Vec2& b) {
  return {static_cast<float>(a.x()), static_cast<float>(a.y()), static_cast<float>(b.x()), static_cast<float>(b.y())};
}

/// One piece [s0, s1] of a model line at both ends of a window; false where it leaves the image.
inline bool add_piece(const SceneOptions& options, const ModelLine& line, double s0, double s1, const Pose& begin,
                      const Pose& end, Rng& rng, EventLine* out) {
  const Vec3 p = Eigen::Map<const Vec3>(line.p);
  const Vec3 q = Eigen::Map<const Vec3>(line.q);
  const bool flip = rng.uniform() < 0.5;
  Vec2 ends[2][3];
  const Pose* poses[2] = {&begin, &end};
  double bend = 0.0;
  for (int e = 0; e < 2; ++e) {
    const double s[3] = {flip ? s1 : s0, 0.5 * (s0 + s1), flip ? s0 : s1};
    for (int k = 0; k < 3; ++k) {
      if (!image_of(options.camera, *poses[e], p + s[k] * (q - p), &ends[e][k])) return false;
    }
    const Vec2 chord = ends[e][2] - ends[e][0];
    const Vec2 normal = Vec2(-chord.y(), chord.x()) / chord.norm();
    for (int k = 0; k < 3; k += 2) ends[e][k] += options.noise_px * gaussian(rng) * normal;
    bend += 0.5 * normal.dot(ends[e][1] - 0.5 * (ends[e][0] + ends[e][2]));
  }
  const float sigma = static_cast<float>(options.noise_px + 0.05);
  *out = {segment_of(ends[0][0], ends[0][2]),
          segment_of(ends[1][0], ends[1][2]),
          static_cast<float>(bend),
          sigma,
          sigma,
          100,
          1};
  return true;
}

/// A line anywhere, or the continuation of nothing: short and long ones, moving a little.
inline EventLine clutter_line(const SceneOptions& options, Rng& rng) {
  const double length = rng.uniform(20.0, 0.3 * options.camera.width);
  const Vec3 turn = Vec3(0, 0, rng.uniform(0.0, 6.28));
  const Vec3 u = so3_exp(turn) * Vec3::UnitX();
  Vec2 a;
  a.x() = rng.uniform(0.0, options.camera.width);
  a.y() = rng.uniform(0.0, options.camera.height);
  Vec2 shift;
  shift.x() = rng.uniform(-5.0, 5.0);
  shift.y() = rng.uniform(-5.0, 5.0);
  const Vec2 b = a + length * u.head<2>();
  return {segment_of(a, b), segment_of(a + shift, b + shift), 0.F, 0.3F, 0.3F, 80, -1};
}

inline Scene make_scene(const SceneOptions& options) {
  Scene scene;
  Rng rng(options.seed);
  const double distance = (options.eye - options.target).norm();
  const auto pose_at = [&](double t) {
    const Vec3 sway(std::sin(7.0 * t), std::sin(5.0 * t + 1.0), std::sin(9.0 * t + 2.0));
    return look_at(options.eye + options.sway * distance * sway, options.target, 0.3 * std::sin(6.0 * t));
  };
  for (int w = 0; w < options.windows; ++w) {
    const double t0 = 0.02 * w;
    const Pose begin = pose_at(t0);
    const Pose end = pose_at(t0 + 0.015);
    scene.begin.push_back(begin);
    scene.end.push_back(end);
    std::vector<EventLine> lines;
    std::vector<int> truth;
    for (std::size_t j = 0; j < options.model.size(); ++j) {
      const bool missing = rng.uniform() < options.missing;
      const bool broken = rng.uniform() < options.broken;
      const double margin = rng.uniform(0.0, 0.04);
      EventLine line;
      if (missing) continue;
      if (broken) {
        if (add_piece(options, options.model[j], margin, 0.45, begin, end, rng, &line)) {
          lines.push_back(line);
          truth.push_back(static_cast<int>(j));
        }
        if (add_piece(options, options.model[j], 0.55, 1.0 - margin, begin, end, rng, &line)) {
          lines.push_back(line);
          truth.push_back(static_cast<int>(j));
        }
      } else if (add_piece(options, options.model[j], margin, 1.0 - margin, begin, end, rng, &line)) {
        lines.push_back(line);
        truth.push_back(static_cast<int>(j));
      }
    }
    for (int c = 0; c < options.clutter; ++c) {
      lines.push_back(clutter_line(options, rng));
      truth.push_back(-1);
    }
    for (std::size_t i = lines.size(); i > 1; --i) {
      const std::size_t j = rng.below(static_cast<std::uint32_t>(i));
      std::swap(lines[i - 1], lines[j]);
      std::swap(truth[i - 1], truth[j]);
    }
    scene.lines.push_back(lines);
    scene.truth.push_back(truth);
  }
  for (int w = 0; w < options.windows; ++w) {
    const std::int64_t begin_us = 1000000 + 20000 * w;
    scene.windows.push_back(
        {begin_us, begin_us + 15000, Span<const EventLine>(scene.lines[static_cast<std::size_t>(w)])});
  }
  return scene;
}

}  // namespace lecalib::test
