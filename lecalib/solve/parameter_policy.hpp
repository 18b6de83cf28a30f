// SPDX-License-Identifier: MIT
/// Which intrinsics are estimated, and what is assumed about them beforehand: the one place that decides it.
///
/// | parameter | free         | Gaussian prior (one sigma)                                                            |
/// |-----------|--------------|---------------------------------------------------------------------------------------|
/// | fx, fy    | yes          | 0.8 +- 2 widths: only keeps a focal length that the data do not tell from running off |
/// | fy / fx   |              | none; an option, as pixels of event sensors are square                                |
/// | cx, cy    | yes          | image centre +- 5 % of the width where the lines of each view lie in a plane, or 20 % |
/// | k1, k2    | yes          | 0 +- 0.5: felt where few lines near the centre tell nothing about distortion          |
/// | p1, p2    | from 3 views | 0 +- 0.001: a lens is centred on its sensor to about that; else held at 0             |
/// | k3        | no           | held at 0: it mimics k2 unless points reach far out                                   |
///
/// The polynomial, from distorted to ideal, has k1, k2 and k3, the division model has k1 alone, and neither has p1, p2.
/// Their priors are the same: lenses between the rectilinear and the equidistant one have k1 of either sign up to 1/3
/// and, in the polynomial, k2 of 0 to 0.13.
///
/// In one view a decentred lens and a turned camera look almost the same: p1, p2 would cost the rotation a quarter of
/// its accuracy for what is mostly zero. The two ends of one window are one look in this respect, hence three views.
///
/// One planar view gives eight numbers and its pose takes six, so the principal point rests on its prior: it is then
/// listed as assumed, whatever its sigma.
#pragma once

#include <cstdint>

#include "lecalib/core/records.hpp"
#include "lecalib/math/eigen.hpp"

namespace lecalib {

/// What is held and assumed, per intrinsic in the order of kIntrinsics.
struct ParameterPolicy {
  DistortionModel model = DistortionModel::brown;
  bool free[kNumIntrinsics] = {true, true, true, true, true, true, true, true, false};
  double prior_mean[kNumIntrinsics] = {};
  double prior_sd[kNumIntrinsics] = {};  ///< 0: no prior
  bool assumed[kNumIntrinsics] = {};     ///< rests on its prior whatever its sigma says
  double aspect_sd = 0;                  ///< of ln(fy / fx) about 0; 0: no prior
};

/// Knobs of the default policy; the comments above give the reasons.
struct PolicyOptions {
  DistortionModel model = DistortionModel::brown;
  double planar_centre_sd = 0.05;        ///< of the width, > 0
  double spatial_centre_sd = 0.20;       ///< of the width, > 0
  double focal_sd = 2.0;                 ///< of the width, about 0.8 widths (64 degrees of view); 0: no prior
  double aspect_sd = 0;                  ///< of ln(fy / fx); 0: no prior
  double radial_sd = 0.5;                ///< of k1; 0: no prior
  double higher_radial_sd = 0.5;         ///< of k2 and, where free, k3; 0: no prior
  double tangential_sd = 1e-3;           ///< of p1 and p2; 0: both held at 0
  std::size_t min_tangential_views = 3;  ///< with fewer views p1 and p2 are held at 0
  bool free_k3 = false;
  bool free_centre = true;      ///< false: cx, cy held at the image centre
  bool free_distortion = true;  ///< false: k1, k2, p1, p2, k3 held at 0
};

/// How much the views tell about the principal point.
enum class ViewGeometry : std::uint8_t {
  one_plane_pose,  ///< lines of one plane, seen under one orientation
  planes,          ///< lines of one plane, seen under several orientations
  spatial,         ///< at least one view shows lines that are not in one plane
};

ParameterPolicy choose_policy(std::uint16_t width, std::uint16_t height, ViewGeometry geometry, std::size_t num_views,
                              const PolicyOptions& options);

}  // namespace lecalib
