// SPDX-License-Identifier: MIT
/// The solver with each distortion model.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "lecalib/math/radial_curve.hpp"
#include "support/solver_run.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

using test::SyntheticViews;
using Run = test::SolverRun;

Camera make_lens(DistortionModel model, double focal, double k1, double k2 = 0, double k3 = 0) {
  Camera camera = test::make_camera(focal, 1.01 * focal, 326.0, 234.0, k1, k2, 0.0, 0.0, k3);
  camera.model = model;
  return camera;
}

MonoSolverOptions without_priors(DistortionModel model) {
  MonoSolverOptions options;
  options.policy.model = model;
  options.policy.focal_sd = options.policy.planar_centre_sd = options.policy.spatial_centre_sd = 0.0;
  options.policy.radial_sd = options.policy.higher_radial_sd = options.policy.tangential_sd = 0.0;
  return options;
}

/// Views that fill the image out to its corners, and no further than 0.97 of where the lens ends.
SyntheticViews wide_views(const Camera& camera, int count, double noise_px, std::uint64_t seed) {
  Rng rng(seed);
  SyntheticViews all;
  all.camera = camera;
  all.model = test::random_lines(rng, 30, 1.6, 1.2, 0.5);
  for (int v = 0; v < count; ++v) all.add_view(test::looking_pose(rng, 1.8, 0.4), 7, noise_px, 1.0, rng);
  SyntheticViews seen = all;
  seen.points.clear();
  for (View& view : seen.views) {
    const View from = view;
    view.first = static_cast<std::uint32_t>(seen.points.size());
    for (const LinePoint& point : points_of(all.data(), from)) {
      Vec2 ideal;
      const bool inside = point.u_px > 0.0 && point.u_px < 639.0 && point.v_px > 0.0 && point.v_px < 479.0;
      if (inside && unproject(camera, Vec2(point.u_px, point.v_px), &ideal) &&
          ideal.norm() < 0.97 * valid_radius(camera))
        seen.points.push_back(point);
    }
    view.count = static_cast<std::uint32_t>(seen.points.size()) - view.first;
  }
  return seen;
}

double largest_radius(const SyntheticViews& s) {
  double largest = 0.0;
  for (const LinePoint& point : s.points) {
    Vec2 ideal;
    if (unproject(s.camera, Vec2(point.u_px, point.v_px), &ideal)) largest = std::max(largest, ideal.norm());
  }
  return largest;
}

TEST_CASE("distortion models: noise-free views give back the camera to 1e-9, barrel and pincushion") {
  const Camera lenses[] = {make_lens(DistortionModel::brown, 350.0, -0.2, 0.04, -0.004),
                           make_lens(DistortionModel::polynomial, 350.0, 0.2, 0.05),
                           make_lens(DistortionModel::polynomial, 350.0, -0.08, 0.02, 0.01),
                           make_lens(DistortionModel::division, 350.0, -0.3),
                           make_lens(DistortionModel::division, 350.0, 0.1)};
  std::uint64_t seed = 40;
  for (const Camera& lens : lenses) {
    const SyntheticViews s = wide_views(lens, 3, 0.0, ++seed);
    MonoSolverOptions options = without_priors(lens.model);
    options.policy.free_k3 = lens.model != DistortionModel::division;
    const Run run(s.data(), options);
    REQUIRE(run.status == Status::ok);
    CHECK(run.result().camera.model == lens.model);
    for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
      const double scale = i < 4 ? lens.*kIntrinsics[i] : 1.0;
      CHECK(std::abs(run.result().camera.*kIntrinsics[i] - lens.*kIntrinsics[i]) < 1e-9 * scale);
    }
  }
}

TEST_CASE("distortion models: strong barrel distortion converges with points near the end of the lens") {
  const Camera lenses[] = {
      make_lens(DistortionModel::brown, 250.0, -0.35), make_lens(DistortionModel::brown, 250.0, -0.5, 0.05),
      make_lens(DistortionModel::polynomial, 250.0, 0.5, 0.1), make_lens(DistortionModel::division, 250.0, -0.6)};
  constexpr int kTrials = 10;
  for (const Camera& lens : lenses) {
    int good = 0;
    for (std::uint64_t seed = 0; seed < kTrials; ++seed) {
      const SyntheticViews s = wide_views(lens, 2, 1.0, 300 + seed);
      if (valid_radius(lens) < kUnboundedRadius) REQUIRE(largest_radius(s) > 0.9 * valid_radius(lens));
      MonoSolverOptions options;
      options.policy.model = lens.model;
      const Run run(s.data(), options);
      if (run.status != Status::ok) continue;
      bool near = true;
      for (std::size_t i = 0; i < 5; ++i) {
        const double error = run.result().camera.*kIntrinsics[i] - lens.*kIntrinsics[i];
        near = near && std::abs(error) < 4.5 * run.result().sigma[i];
      }
      good += near ? 1 : 0;
    }
    CHECK(good == kTrials);
  }
}

/// Least rms distance, px, between the images of a lens and those of a camera of `model` with some focal length and
/// some k1 (and k2) of its own, over the points of the views: by exhaustive search on grids that shrink.
double best_radial_rms(const SyntheticViews& s, DistortionModel model) {
  std::vector<double> radii;
  for (const LinePoint& point : s.points) {
    Vec2 ideal;
    REQUIRE(unproject(s.camera, Vec2(point.u_px, point.v_px), &ideal));
    radii.push_back(ideal.norm());
  }
  const double focal = 0.5 * (s.camera.fx + s.camera.fy);
  const auto rms = [&](double scale, double k1, double k2) {
    Camera other = s.camera;
    other.model = model;
    other.k1 = k1;
    other.k2 = k2;
    double squares = 0.0;
    for (const double r : radii) {
      const double error = r * (scale * radial_at(other, r * r).value - radial_at(s.camera, r * r).value);
      squares += error * error;
    }
    return focal * std::sqrt(squares / static_cast<double>(radii.size()));
  };
  double best[3] = {1.0, 0.0, 0.0};
  double least = 1e9;
  for (double width = 0.3; width > 1e-4; width *= 0.7) {
    const double centre[3] = {best[0], best[1], best[2]};
    for (int a = -3; a <= 3; ++a) {
      for (int b = -3; b <= 3; ++b) {
        for (int c = -3; c <= 3; ++c) {
          const double k2 = model == DistortionModel::polynomial ? centre[2] + c * width / 3.0 : 0.0;
          const double scale = centre[0] + a * width / 10.0;
          const double value = rms(scale, centre[1] + b * width / 3.0, k2);
          if (!(value < least)) continue;
          least = value;
          best[0] = scale;
          best[1] = centre[1] + b * width / 3.0;
          best[2] = k2;
        }
      }
    }
  }
  return least;
}

TEST_CASE("distortion models: a Brown lens leaves another model no more than its best radial fit does") {
  const SyntheticViews s = wide_views(make_lens(DistortionModel::brown, 300.0, -0.25, 0.06), 4, 0.0, 51);
  for (const DistortionModel model : {DistortionModel::polynomial, DistortionModel::division}) {
    const Run run(s.data(), without_priors(model));
    REQUIRE(run.status == Status::ok);
    const double bound = best_radial_rms(s, model);
    CHECK(run.result().rms_px < bound);        // the poses take a part, and only what is across a line counts
    CHECK(run.result().rms_px > 0.1 * bound);  // but a model that cannot say it cannot hide it
  }
}

TEST_CASE("distortion models: a start in Brown's model serves them all") {
  for (std::size_t m = 0; m < kNumDistortionModels; ++m) {
    const auto model = static_cast<DistortionModel>(m);
    const SyntheticViews s = wide_views(make_lens(DistortionModel::brown, 300.0, -0.2, 0.03), 3, 0.5, 52);
    const MonoStart start{s.camera, s.poses};
    MonoSolverOptions options;
    options.policy.model = model;
    const Run with_start(s.data(), options, &start);
    const Run without(s.data(), options);
    REQUIRE(with_start.status == Status::ok);
    REQUIRE(without.status == Status::ok);
    CHECK(with_start.result().camera.model == model);
    CHECK(std::abs(with_start.result().camera.fx - without.result().camera.fx) < 0.01 * without.result().sigma[0]);
    for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
      if (kHasIntrinsic[m][i]) continue;
      CHECK(with_start.result().camera.*kIntrinsics[i] == 0.0);
      CHECK(with_start.result().sigma[i] == 0.0);
      CHECK_FALSE(with_start.result().assumed[i]);
    }
  }
}

}  // namespace
}  // namespace lecalib
