// SPDX-License-Identifier: MIT
#include "lecalib/solve/plausibility.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <vector>

#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

struct Case {
  test::SyntheticViews scene;
  RefineView view{};
  CalibrationResult result;
  PlausibilityOptions options;
  Status check() { return check_plausibility(scene.data(), {&view, 1}, options, &result); }
};

Case good_case() {
  Rng rng(1);
  Case c;
  c.scene.camera = test::make_camera(400.0, 400.0, 319.5, 239.5, -0.1, 0.02);
  c.scene.model = test::box_edges(1.0, 0.8, 0.6);
  c.scene.add_view(make_pose(so3_exp(Vec3(0.3, 0.4, 0.0)), Vec3(-0.4, -0.3, 3.0)), 3, 0.0, 1.0, rng);
  c.view.pose = c.scene.poses[0];
  c.view.used = true;
  c.result.camera = c.scene.camera;
  c.result.rms_px = 0.3;
  for (double& sigma : c.result.sigma) sigma = 0.01;
  return c;
}

TEST_CASE("a good camera passes") {
  Case c = good_case();
  CHECK(c.check() == Status::ok);
  CHECK(c.result.parameter == kNoParameter);
}

TEST_CASE("each implausible intrinsic is named") {
  const struct {
    std::size_t index;
    double value;
  } bad[] = {{0, 20.0}, {0, 5000.0}, {1, 20.0}, {1, 700.0}, {2, -200.0}, {2, 900.0}, {3, -200.0}, {3, 700.0}};
  for (const auto& b : bad) {
    Case c = good_case();
    c.result.camera.*kIntrinsics[b.index] = b.value;
    CHECK(c.check() == Status::implausible_result);
    CHECK(c.result.parameter == b.index);
  }
}

TEST_CASE("each intrinsic that is too uncertain is named, before its value is judged") {
  for (std::size_t i = 0; i < 4; ++i) {
    Case c = good_case();
    c.result.sigma[i] = 300.0;
    c.result.camera.fx = i == 0 ? 10.0 : c.result.camera.fx;
    CHECK(c.check() == Status::undetermined);
    CHECK(c.result.parameter == i);
  }
}

TEST_CASE("a distortion that folds inside the points, points behind the camera and large residuals are refused") {
  Case folded = good_case();
  folded.result.camera.k1 = -8.0;
  CHECK(folded.check() == Status::implausible_result);
  CHECK(folded.result.parameter == 4);

  Case behind = good_case();
  behind.view.pose = make_pose(rotation_of(behind.view.pose), -translation_of(behind.view.pose));
  CHECK(behind.check() == Status::implausible_result);
  CHECK(behind.result.parameter == kNoParameter);

  Case coarse = good_case();
  coarse.result.rms_px = 10.0;
  CHECK(coarse.check() == Status::implausible_result);
}

TEST_CASE("residuals far beyond their given sigmas are refused where a bound is set") {
  Case c = good_case();
  c.result.chi2_per_dof = 2.1;
  CHECK(c.check() == Status::ok);
  c.options.max_chi2_per_dof = 2.0;
  CHECK(c.check() == Status::implausible_result);
  CHECK(c.result.parameter == kNoParameter);
  c.result.chi2_per_dof = 1.9;
  CHECK(c.check() == Status::ok);
}

TEST_CASE("a negative margin asks the principal point to lie that far inside of the image") {
  Case c = good_case();
  c.options.centre_margin = -0.3;
  CHECK(c.check() == Status::ok);
  c.result.camera.cx = 0.29 * 640;
  CHECK(c.check() == Status::implausible_result);
  CHECK(c.result.parameter == 2);
  c.result.camera.cx = 0.31 * 640;
  CHECK(c.check() == Status::ok);
}

TEST_CASE("values that are not finite are refused") {
  Case c = good_case();
  c.result.camera.k2 = std::numeric_limits<double>::quiet_NaN();
  CHECK(c.check() == Status::numerical_failure);
  c = good_case();
  c.result.sigma[5] = std::numeric_limits<double>::infinity();
  CHECK(c.check() == Status::numerical_failure);
  c = good_case();
  c.result.rms_px = std::numeric_limits<double>::quiet_NaN();
  CHECK(c.check() == Status::numerical_failure);
}

}  // namespace
}  // namespace lecalib
