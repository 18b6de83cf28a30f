// SPDX-License-Identifier: MIT
#include "lecalib/host/protocol.hpp"

#include <cmath>

#include "lecalib/core/rng.hpp"
#include "lecalib/host/exponential.hpp"
#include "lecalib/math/camera_model.hpp"
#include "lecalib/math/so3.hpp"
#include "lecalib/math/trigonometry.hpp"

namespace lecalib::host {
namespace {

constexpr std::uint16_t kWidth = 640;
constexpr std::uint16_t kHeight = 480;
constexpr double kMaxAngle = 1;                           // rad
constexpr double kMaxTranslation = 2.5;                   // m
constexpr double kMinDepth = 5;                           // m
constexpr double kMaxSceneDepth = 10;                     // m
constexpr double kMinPlaneDepth = 2;                      // m
constexpr double kMaxPlaneDepth = 20;                     // m
constexpr double kInsideFold = 0.95;                      // of the valid radius
constexpr double kUniformSigma = 0.28867513459481288225;  // of a uniform value in [0, 1]: 1 / sqrt(12)

/// A plane seen so nearly edge-on that this many draws miss its visible part is drawn anew.
constexpr int kMaxDraws = 10000;

Camera true_camera(const TrialOptions& options) {
  Camera camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.fx = camera.fy = options.focal_px;
  camera.cx = 0.5 * kWidth;  // as the paper counts
  camera.cy = 0.5 * kHeight;
  camera.k1 = options.k1;
  camera.k2 = options.k2;
  return camera;
}

/// Ideal normalised coordinates of an ideal pixel, with a third coordinate of 1.
Vec3 ray_of(const Camera& camera, double u_px, double v_px) {
  return {(u_px - camera.cx) / camera.fx, (v_px - camera.cy) / camera.fy, 1.0};
}

Vec3 draw_vector(Rng* rng, const Vec3& low, const Vec3& high) {
  Vec3 v;
  for (int i = 0; i < 3; ++i) v(i) = rng->uniform(low(i), high(i));
  return v;
}

Pose draw_pose(const TrialOptions& options, const Camera& camera, Rng* rng) {
  const Vec3 angles = draw_vector(rng, Vec3::Constant(-kMaxAngle), Vec3::Constant(kMaxAngle));
  const Mat3 R = so3_exp(Vec3(0, 0, angles(2))) * so3_exp(Vec3(0, angles(1), 0)) * so3_exp(Vec3(angles(0), 0, 0));
  if (options.protocol != Protocol::physical) {
    return make_pose(R, draw_vector(rng, Vec3::Zero(), Vec3::Constant(kMaxTranslation)));
  }
  const double depth = rng->uniform(kMinDepth, kMaxSceneDepth);
  const double u = rng->uniform(0.25 * kWidth, 0.75 * kWidth);
  const double v = rng->uniform(0.25 * kHeight, 0.75 * kHeight);
  return make_pose(R, depth * ray_of(camera, u, v));
}

/// One end point: its ray and its place in both models.
struct EndPoint {
  Vec3 ray;
  Vec3 planar;
  Vec3 spatial;
};

bool draw_end_point(const TrialOptions& options, const Camera& camera, const Pose& pose, Rng* rng, EndPoint* out) {
  const Mat3 R = rotation_of(pose);
  const Vec3 t = translation_of(pose);
  const double largest_radius = kInsideFold * valid_radius(camera);
  for (int i = 0; i < kMaxDraws; ++i) {
    const double depth = rng->uniform(kMinDepth, kMaxSceneDepth);
    const double u = rng->uniform(0, kWidth);
    const double v = rng->uniform(0, kHeight);
    const Vec3 ray = ray_of(camera, u, v);
    if (!(ray.head<2>().norm() < largest_radius)) continue;
    // Where the ray, prolonged to both sides, meets z = 0 of the world: the plane with normal R e_z through t.
    const double plane_depth = R.col(2).dot(t) / R.col(2).dot(ray);
    if (!std::isfinite(plane_depth)) continue;
    if (options.protocol == Protocol::physical && !(plane_depth > kMinPlaneDepth && plane_depth < kMaxPlaneDepth)) {
      continue;
    }
    *out = {ray, R.transpose() * (plane_depth * ray - t), R.transpose() * (depth * ray - t)};
    out->planar(2) = 0;
    return true;
  }
  return false;
}

bool draw_end_points(const TrialOptions& options, const Camera& camera, const Pose& pose, Rng* rng,
                     std::vector<EndPoint>* out) {
  out->clear();
  const int count = 2 * options.lines;
  EndPoint point;
  while (static_cast<int>(out->size()) < count && draw_end_point(options, camera, pose, rng, &point)) {
    out->push_back(point);
  }
  return static_cast<int>(out->size()) == count;
}

/// Noise of both coordinates, of unit size; Gaussian by Box and Muller.
Vec2 draw_noise(Protocol protocol, Rng* rng) {
  const double a = rng->uniform();
  const double b = rng->uniform();
  if (protocol == Protocol::scripts) return {a, b};
  const double radius = std::sqrt(-2.0 * logarithm(1.0 - a));
  double sine = 0;
  double cosine = 1;
  sin_cos(2.0 * kPi * b, &sine, &cosine);
  return {radius * cosine, radius * sine};
}

double given_sigma(const TrialOptions& options) {
  if (!(options.sigma_px > 0)) return 1;
  return options.protocol == Protocol::scripts ? kUniformSigma * options.sigma_px : options.sigma_px;
}

ModelLine make_line(const Vec3& p, const Vec3& q) { return {{p(0), p(1), p(2)}, {q(0), q(1), q(2)}}; }

}  // namespace

const char* short_name(Protocol protocol) {
  switch (protocol) {
    case Protocol::scripts: return "S";
    case Protocol::text: return "T";
    case Protocol::physical: return "P";
  }
  return "?";
}

TrialOptions default_trial(Protocol protocol) {
  TrialOptions options;
  options.protocol = protocol;
  if (protocol == Protocol::scripts) options.k1 = options.k2 = 0.1;
  return options;
}

Trial draw_trial(const TrialOptions& options, std::uint64_t seed) {
  Rng rng(seed);
  Trial trial;
  trial.camera = true_camera(options);
  std::vector<EndPoint> ends;
  do {
    trial.T_cam_world = draw_pose(options, trial.camera, &rng);
  } while (!draw_end_points(options, trial.camera, trial.T_cam_world, &rng, &ends));
  const double sigma_px = given_sigma(options);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const Vec2 distorted = distort(trial.camera, ends[i].ray.head<2>());
    const Vec2 exact(trial.camera.cx + trial.camera.fx * distorted(0),
                     trial.camera.cy + trial.camera.fy * distorted(1));
    const Vec2 noise = options.sigma_px * draw_noise(options.protocol, &rng);
    trial.exact_px.push_back(exact);
    trial.points.push_back({exact(0) + noise(0), exact(1) + noise(1), sigma_px, static_cast<std::uint16_t>(i / 2)});
    if (i % 2 == 0) continue;
    trial.planar.push_back(make_line(ends[i - 1].planar, ends[i].planar));
    trial.spatial.push_back(make_line(ends[i - 1].spatial, ends[i].spatial));
  }
  if (options.protocol == Protocol::scripts) trial.noise_mean_px = 0.5 * options.sigma_px;
  return trial;
}

/// The finaliser of SplitMix64 (Steele, Lea, Flood 2014), over one seed after the other.
std::uint64_t trial_seed(std::uint64_t run_seed, std::uint64_t trial) {
  const auto mix = [](std::uint64_t z) {
    z += 0x9E3779B97F4A7C15ULL;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31U);
  };
  return mix(mix(run_seed) ^ trial);
}

}  // namespace lecalib::host
