// SPDX-License-Identifier: MIT
#include "lecalib/solve/parameter_policy.hpp"

#include <doctest/doctest.h>

namespace lecalib {
namespace {

enum Index { kFx, kFy, kCx, kCy, kK1, kK2, kP1, kP2, kK3 };

TEST_CASE("the defaults of the table") {
  const ParameterPolicy spatial = choose_policy(640, 480, ViewGeometry::spatial, 5, {});
  const bool free[] = {true, true, true, true, true, true, true, true, false};
  for (int i = 0; i < 9; ++i) {
    CHECK(spatial.free[i] == free[i]);
    CHECK_FALSE(spatial.assumed[i]);
  }
  CHECK(spatial.prior_mean[kFx] == 512.0);
  CHECK(spatial.prior_sd[kFx] == 1280.0);
  CHECK(spatial.prior_mean[kCx] == 319.5);
  CHECK(spatial.prior_mean[kCy] == 239.5);
  CHECK(spatial.prior_sd[kCx] == 128.0);
  CHECK(spatial.prior_sd[kK1] == 0.5);
  CHECK(spatial.prior_sd[kP1] == 1e-3);

  CHECK(choose_policy(640, 480, ViewGeometry::planes, 5, {}).prior_sd[kCy] == 32.0);
  CHECK_FALSE(choose_policy(640, 480, ViewGeometry::planes, 5, {}).assumed[kCx]);
  CHECK(choose_policy(640, 480, ViewGeometry::one_plane_pose, 5, {}).assumed[kCx]);
  CHECK(choose_policy(640, 480, ViewGeometry::one_plane_pose, 5, {}).free[kCx]);
}

TEST_CASE("tangential terms need three views") {
  for (const std::size_t views : {1U, 2U, 3U}) {
    const ParameterPolicy policy = choose_policy(640, 480, ViewGeometry::spatial, views, {});
    CHECK(policy.free[kP1] == (views >= 3));
    CHECK(policy.free[kP2] == (views >= 3));
    CHECK(policy.free[kK2]);
  }
}

TEST_CASE("the options hold and free parameters") {
  PolicyOptions options;
  options.free_distortion = false;
  options.free_centre = false;
  ParameterPolicy policy = choose_policy(640, 480, ViewGeometry::spatial, 5, options);
  for (int i = kCx; i <= kK3; ++i) CHECK_FALSE(policy.free[i]);
  CHECK(policy.assumed[kCx]);
  options = {};
  options.free_k3 = true;
  options.tangential_sd = 0.0;
  policy = choose_policy(640, 480, ViewGeometry::spatial, 5, options);
  CHECK(policy.free[kK3]);
  CHECK_FALSE(policy.free[kP1]);
}

}  // namespace
}  // namespace lecalib
