// SPDX-License-Identifier: MIT
/// Trials of [Liu24] section 4.2: random lines seen once by a known camera, each measured by its two end points.
#pragma once

#include <cstdint>
#include <vector>

#include "lecalib/core/records.hpp"
#include "lecalib/math/eigen.hpp"

namespace lecalib::host {

/// How trials are drawn. The paper's text and the scripts that its authors published do not agree.
///
/// | name | noise on each coordinate          | distortion      | plane of the planar lines                         |
/// |------|-----------------------------------|-----------------|---------------------------------------------------|
/// | S    | uniform in [0, sigma]             | k1 = k2 = 0.1   | anywhere, in part behind the camera               |
/// | T    | Gaussian, zero mean, sigma        | k1 = k2 = -0.1  | as S                                              |
/// | P    | as T                              | as T            | origin 5 to 10 m ahead, all points 2 to 20 m away |
enum class Protocol : std::uint8_t { scripts, text, physical };

/// "S", "T" or "P".
const char* short_name(Protocol protocol);

struct TrialOptions {
  Protocol protocol = Protocol::text;
  double sigma_px = 1;  ///< >= 0
  double focal_px = 400;
  int lines = 25;  ///< 4 to 1000
  double k1 = -0.1;
  double k2 = -0.1;
};

/// What the paper's ablation study and figure 4 hold where they do not vary it.
TrialOptions default_trial(Protocol protocol);

/// One trial. Both models have the same images: their lines' end points lie on the same rays.
struct Trial {
  Camera camera;                   ///< the true one, 640 x 480
  Pose T_cam_world;                ///< the true one
  std::vector<ModelLine> planar;   ///< on z = 0
  std::vector<ModelLine> spatial;  ///< every end point 5 to 10 m deep
  std::vector<Vec2> exact_px;      ///< two per line: where the end points are seen, distorted
  std::vector<LinePoint> points;   ///< the same with noise; sigma_px is that of the noise, or 1 where there is none
  double noise_mean_px = 0;        ///< of each coordinate: only the scripts' noise has one
};

/// Ideal end points are uniform in the image and inside 0.95 of the radius at which the distortion folds; rotations are
/// Rz Ry Rx with angles uniform in [-1, 1] rad, translations uniform in [0, 2.5]^3 m (P: see above). The same seed
/// gives the same bits on every target, and the same scene for every sigma.
Trial draw_trial(const TrialOptions& options, std::uint64_t seed);

/// The seed of one trial of a run: well mixed, so that neighbouring runs and trials have nothing in common.
std::uint64_t trial_seed(std::uint64_t run_seed, std::uint64_t trial);

}  // namespace lecalib::host
