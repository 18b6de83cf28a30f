// SPDX-License-Identifier: MIT
#include "lecalib/host/simulator_trajectory.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/core/rng.hpp"
#include "lecalib/math/camera_model.hpp"
#include "lecalib/math/so3.hpp"
#include "lecalib/math/trigonometry.hpp"

namespace lecalib::host {
namespace {

constexpr double kTwoPi = 2.0 * kPi;

/// Slow part and tremor of one coordinate. Amplitudes in degrees, of the range in percent.
struct Swing {
  double amplitude, frequency_hz, tremor, tremor_hz;
};

/// Rows: shake, sweep, rotate. Columns: pan, tilt, roll, azimuth, elevation, range.
constexpr Swing kSwings[3][6] = {
    {{2.2, 2.6, 0.25, 8.5},
     {2.0, 3.1, 0.25, 9.3},
     {3.0, 1.9, 0.2, 7.7},
     {5.0, 1.3, 0, 1},
     {4.0, 1.7, 0, 1},
     {4, 1.1, 0, 1}},
    {{0.8, 0.9, 0.1, 7.1},
     {0.8, 1.1, 0.1, 8.2},
     {1.0, 0.7, 0.1, 6.7},
     {22, 0.35, 0, 1},
     {8.0, 0.5, 0, 1},
     {6, 0.4, 0, 1}},
    {{0.8, 1.2, 0.1, 7.1},
     {0.8, 1.5, 0.1, 8.2},
     {28, 0.9, 0.1, 6.7},
     {10, 0.8, 0, 1},
     {6.0, 1.0, 0, 1},
     {3, 0.7, 0, 1}},
};

constexpr double kMarginPx = 6.0;    ///< between the model's ends and the image's border
constexpr double kRangeStep = 1.02;  ///< factor between the distances tried
constexpr int kMaxRangeSteps = 400;
constexpr double kViewInterval = 0.02;  ///< s, between the poses at which the view is checked

}  // namespace

Result<Trajectory> Trajectory::make(const Scene& scene, const Model& model, const Camera& camera, Span<const Pose> rig,
                                    Motion motion, double speed, double duration_s, std::uint64_t seed) {
  Trajectory trajectory;
  trajectory.center_ = scene.center;
  trajectory.view_from_ = scene.view_from;
  trajectory.up_ = scene.up;
  trajectory.choose_sines(motion, speed, seed);
  double radius = 0;
  for (const ModelLine& line : model.lines) radius = std::max(radius, (Vec3(line.p) - scene.center).norm());
  trajectory.distance_ = 1.1 * radius;
  for (int i = 0; i < kMaxRangeSteps; ++i) {
    const bool all_see_it = std::all_of(rig.begin(), rig.end(), [&](const Pose& T_camera_rig) {
      return trajectory.seen_from(T_camera_rig).sees_all(model, camera, duration_s);
    });
    if (all_see_it) return trajectory;
    trajectory.distance_ *= kRangeStep;
  }
  return Error{"this lens never sees the whole target: no distance fits"};
}

Trajectory Trajectory::seen_from(const Pose& T_camera_rig) const {
  Trajectory other = *this;
  other.T_camera_rig_ = T_camera_rig;
  return other;
}

Pose Trajectory::at(double t_s) const {
  const Vec3 right = (-view_from_).cross(up_).normalized();
  const Mat3 orbit = so3_exp(coordinate(azimuth, t_s) * up_) * so3_exp(coordinate(elevation, t_s) * right);
  const Vec3 position = center_ + distance_ * (1.0 + coordinate(range, t_s)) * (orbit * view_from_);
  const Vec3 forward = (center_ - position).normalized();
  const Vec3 x = forward.cross(up_).normalized();
  Mat3 looking;
  looking.row(0) = x;
  looking.row(1) = forward.cross(x);
  looking.row(2) = forward;
  const Mat3 R = so3_exp(Vec3(coordinate(tilt, t_s), coordinate(pan, t_s), coordinate(roll, t_s))) * looking;
  return product(T_camera_rig_, make_pose(R, -R * position));
}

double Trajectory::coordinate(Coordinate which, double t_s) const {
  double sum = 0;
  for (const Sine& s : sines_[which]) {
    double sine = 0, cosine = 0;
    sin_cos(kTwoPi * s.frequency_hz * t_s + s.phase, &sine, &cosine);
    sum += s.amplitude * sine;
  }
  return sum;
}

void Trajectory::choose_sines(Motion motion, double speed, std::uint64_t seed) {
  Rng rng(seed);
  const auto sine = [&](double amplitude, double frequency_hz) {
    Sine s{};
    s.amplitude = amplitude * rng.uniform(0.8, 1.2);
    s.frequency_hz = speed * frequency_hz * rng.uniform(0.85, 1.15);
    s.phase = rng.uniform(0.0, kTwoPi);
    return s;
  };
  for (std::size_t i = 0; i < kCoordinates; ++i) {
    const Swing& swing = kSwings[static_cast<std::size_t>(motion)][i];
    const double unit = i == range ? 0.01 : deg_to_rad(1.0);
    sines_[i][0] = sine(unit * swing.amplitude, swing.frequency_hz);
    sines_[i][1] = sine(unit * swing.tremor, swing.tremor_hz);
  }
}

bool Trajectory::sees_all(const Model& model, const Camera& camera, double duration_s) const {
  const int poses = 1 + static_cast<int>(std::ceil(duration_s / kViewInterval));
  for (int i = 0; i <= poses; ++i) {
    const Pose pose = at(duration_s * i / poses);
    for (const ModelLine& line : model.lines) {
      for (const Vec3& end : {Vec3(line.p), Vec3(line.q)}) {
        const Vec3 x_cam = rotation_of(pose) * end + translation_of(pose);
        Vec2 pixel;
        if (x_cam(2) <= 0.0 || !project(camera, x_cam, &pixel)) return false;
        if (pixel.minCoeff() < kMarginPx || pixel(0) > camera.width - 1 - kMarginPx) return false;
        if (pixel(1) > camera.height - 1 - kMarginPx) return false;
      }
    }
  }
  return true;
}

}  // namespace lecalib::host
