// SPDX-License-Identifier: MIT
/// Views of a line model by a known camera: the truth that the solver's tests compare with.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "lecalib/core/records.hpp"
#include "lecalib/core/rng.hpp"
#include "lecalib/math/camera_model.hpp"
#include "lecalib/math/eigen.hpp"
#include "lecalib/math/so3.hpp"
#include "lecalib/solve/calibration_data.hpp"

namespace lecalib::test {

inline Camera make_camera(double fx, double fy, double cx, double cy, double k1 = 0, double k2 = 0, double p1 = 0,
                          double p2 = 0, double k3 = 0) {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  const double values[kNumIntrinsics] = {fx, fy, cx, cy, k1, k2, p1, p2, k3};
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) camera.*kIntrinsics[i] = values[i];
  return camera;
}

/// Sum of twelve uniform values less six: variance one, tails to six sigma, no transcendental function.
inline double gaussian(Rng& rng) {
  double sum = -6.0;
  for (int i = 0; i < 12; ++i) sum += rng.uniform();
  return sum;
}

inline Vec3 random_vector(Rng& rng, double range) {
  Vec3 v;
  for (int k = 0; k < 3; ++k) v(k) = rng.uniform(-range, range);
  return v;
}

inline ModelLine make_line(const Vec3& p, const Vec3& q) { return {{p(0), p(1), p(2)}, {q(0), q(1), q(2)}}; }

/// `count` lines with end points in a box of the given half sizes (z of 0: in a plane).
inline std::vector<ModelLine> random_lines(Rng& rng, int count, double half_x, double half_y, double half_z) {
  std::vector<ModelLine> lines;
  const Vec3 half(half_x, half_y, half_z);
  while (static_cast<int>(lines.size()) < count) {
    const Vec3 p = random_vector(rng, 1.0).cwiseProduct(half);
    const Vec3 q = random_vector(rng, 1.0).cwiseProduct(half);
    if ((p - q).norm() > 0.5 * half_x) lines.push_back(make_line(p, q));
  }
  return lines;
}

/// The twelve edges of a box.
inline std::vector<ModelLine> box_edges(double x, double y, double z) {
  std::vector<ModelLine> lines;
  for (int a = 0; a < 3; ++a) {
    for (int corner = 0; corner < 4; ++corner) {
      Vec3 p = Vec3::Zero();
      p((a + 1) % 3) = corner & 1;
      p((a + 2) % 3) = corner >> 1;
      Vec3 q = p;
      q(a) = 1.0;
      const Vec3 size(x, y, z);
      lines.push_back(make_line(p.cwiseProduct(size), q.cwiseProduct(size)));
    }
  }
  return lines;
}

/// Observations with their truth. data() points into this object.
struct SyntheticViews {
  Camera camera;
  std::vector<ModelLine> model;
  std::vector<LinePoint> points;
  std::vector<View> views;
  std::vector<Pose> poses;

  [[nodiscard]] CalibrationData data() const { return {camera.width, camera.height, model, points, views}; }

  /// Adds a view with `per_line` points spread evenly over each line, Gaussian noise of sigma_px on both coordinates.
  /// Points that have no image are left out.
  void add_view(const Pose& pose, int per_line, double noise_px, double sigma_px, Rng& rng) {
    View view{static_cast<std::int64_t>(views.size()), static_cast<std::uint32_t>(points.size()), 0};
    for (std::size_t i = 0; i < model.size(); ++i) {
      for (int k = 0; k < per_line; ++k) {
        const double mix = static_cast<double>(k) / (per_line - 1);
        Vec3 world;
        for (int c = 0; c < 3; ++c) world(c) = (1.0 - mix) * model[i].p[c] + mix * model[i].q[c];
        Vec2 pixel;
        if (!project(camera, rotation_of(pose) * world + translation_of(pose), &pixel)) continue;
        const double du = noise_px * gaussian(rng);
        const double dv = noise_px * gaussian(rng);
        points.push_back({pixel(0) + du, pixel(1) + dv, sigma_px, static_cast<std::uint16_t>(i)});
        ++view.count;
      }
    }
    views.push_back(view);
    poses.push_back(pose);
  }
};

/// A pose that looks at the origin from `distance`, tilted by up to `tilt` rad about each axis.
inline Pose looking_pose(Rng& rng, double distance, double tilt) {
  const Vec3 w = random_vector(rng, tilt);
  const Vec3 t = random_vector(rng, 0.1 * distance);
  return make_pose(so3_exp(w), Vec3(t(0), t(1), distance));
}

/// A pose that sees a model of a metre or so about the origin at a slant, within the image of make_camera(400, ...).
inline Pose slanted_pose() { return make_pose(so3_exp(Vec3(0.5, -0.4, 0.2)), Vec3(0.1, 0.0, 4.0)); }

}  // namespace lecalib::test
