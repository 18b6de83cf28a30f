// SPDX-License-Identifier: MIT
#include "lecalib/solve/parameter_policy.hpp"

namespace lecalib {
namespace {

/// Focal length over width of a lens that is neither wide nor long.
constexpr double kUsualFocalLength = 0.8;

void set_prior(ParameterPolicy* policy, int i, double mean, double sd) {
  policy->prior_mean[i] = mean;
  policy->prior_sd[i] = sd;
}

}  // namespace

ParameterPolicy choose_policy(std::uint16_t width, std::uint16_t height, ViewGeometry geometry, std::size_t num_views,
                              const PolicyOptions& options) {
  ParameterPolicy policy;
  policy.model = options.model;
  for (const int i : {kFx, kFy}) set_prior(&policy, i, kUsualFocalLength * width, options.focal_sd * width);
  const double share = geometry == ViewGeometry::spatial ? options.spatial_centre_sd : options.planar_centre_sd;
  set_prior(&policy, kCx, 0.5 * (width - 1), share * width);
  set_prior(&policy, kCy, 0.5 * (height - 1), share * width);
  policy.aspect_sd = options.aspect_sd;
  set_prior(&policy, kK1, 0.0, options.radial_sd);
  for (const int i : {kK2, kK3}) set_prior(&policy, i, 0.0, options.higher_radial_sd);
  for (const int i : {kP1, kP2}) set_prior(&policy, i, 0.0, options.tangential_sd);
  for (const int i : {kCx, kCy}) {
    policy.free[i] = options.free_centre;
    policy.assumed[i] = !options.free_centre || geometry == ViewGeometry::one_plane_pose;
  }
  for (const int i : {kK1, kK2}) policy.free[i] = options.free_distortion;
  for (const int i : {kP1, kP2}) {
    policy.free[i] =
        options.free_distortion && options.tangential_sd > 0.0 && num_views >= options.min_tangential_views;
  }
  policy.free[kK3] = options.free_distortion && options.free_k3;
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    policy.free[i] = policy.free[i] && kHasIntrinsic[static_cast<std::size_t>(options.model)][i];
  }
  return policy;
}

}  // namespace lecalib
