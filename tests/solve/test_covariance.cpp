// SPDX-License-Identifier: MIT
#include "lecalib/solve/covariance.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "support/dense_algebra.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

struct Solved {
  Camera camera;
  CalibrationResult result;
  Status status = Status::ok;
};

/// Four views of lines in space; points have `noise_px` of noise and claim `sigma_px`.
Solved solve(double noise_px, double sigma_px, const CovarianceOptions& options, std::uint64_t seed,
             const ParameterPolicy& policy = {}) {
  Rng scene_rng(20);
  Rng noise_rng(seed);
  test::SyntheticViews s;
  s.camera = test::make_camera(400.0, 410.0, 322.0, 236.0, -0.15, 0.05);
  s.model = test::random_lines(scene_rng, 12, 1.2, 0.9, 0.6);
  for (int v = 0; v < 4; ++v) {
    const Pose pose = test::looking_pose(scene_rng, 3.0, 0.5);
    s.add_view(pose, 3, noise_px, sigma_px, noise_rng);
  }
  std::vector<RefineView> views;
  for (const Pose& pose : s.poses) {
    RefineView view{};
    view.pose = pose;
    view.used = true;
    views.push_back(view);
  }
  std::vector<float> residuals(s.points.size());
  Refiner refiner;
  refiner.init(s.data(), policy, {}, s.camera, views, residuals);
  Status status = Status::in_progress;
  while (status == Status::in_progress) status = refiner.step();
  CHECK(status == Status::ok);
  std::vector<LineResponse> responses(kLineErrors * s.model.size());
  Solved solved;
  solved.camera = refiner.camera();
  solved.status = compute_covariance(refiner, policy, options, views.size(), responses, &solved.result);
  return solved;
}

ParameterPolicy radial_only() {
  ParameterPolicy policy;
  policy.free[6] = policy.free[7] = false;
  return policy;
}

TEST_CASE("reported sigma is the spread of the answers") {
  constexpr int kTrials = 150;
  double squares[kNumIntrinsics] = {};
  double reported[kNumIntrinsics] = {};
  const Camera truth = test::make_camera(400.0, 410.0, 322.0, 236.0, -0.15, 0.05);
  for (int i = 0; i < kTrials; ++i) {
    const Solved s = solve(0.4, 0.4, {}, 100 + static_cast<std::uint64_t>(i), radial_only());
    REQUIRE(s.status == Status::ok);
    for (std::size_t k = 0; k < kNumIntrinsics; ++k) {
      const double error = s.camera.*kIntrinsics[k] - truth.*kIntrinsics[k];
      squares[k] += error * error / kTrials;
      reported[k] += s.result.sigma[k] / kTrials;
    }
  }
  // The spread of a spread over 150 trials is 6 %; max(1, chi2/dof) adds a few percent to the reported one.
  for (std::size_t k = 0; k < 6; ++k) {
    CHECK(reported[k] / std::sqrt(squares[k]) > 0.8);
    CHECK(reported[k] / std::sqrt(squares[k]) < 1.3);
  }
  CHECK(reported[8] == 0.0);
}

TEST_CASE("scale of sigma: trusted sigmas are only ever widened, untrusted ones follow the residuals") {
  CovarianceOptions untrusted;
  untrusted.trust_sigma = false;
  const Solved exact = solve(0.4, 0.4, {}, 7);
  const Solved claims_too_much = solve(0.4, 0.1, {}, 7);
  const Solved claims_too_little = solve(0.4, 4.0, {}, 7);
  CHECK(exact.result.chi2_per_dof == doctest::Approx(1.0).epsilon(0.3));
  CHECK(claims_too_much.result.chi2_per_dof == doctest::Approx(16.0).epsilon(0.3));
  CHECK(claims_too_much.result.sigma[0] == doctest::Approx(exact.result.sigma[0]).epsilon(0.2));
  CHECK(claims_too_little.result.sigma[0] == doctest::Approx(10.0 * exact.result.sigma[0]).epsilon(0.2));
  CHECK(solve(0.4, 4.0, untrusted, 7).result.sigma[0] == doctest::Approx(exact.result.sigma[0]).epsilon(0.2));
}

TEST_CASE("covariance and sigma agree, held parameters have none and are assumed, condition is at least one") {
  const Solved s = solve(0.4, 0.4, {}, 8, radial_only());
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    CHECK(s.result.covariance[10 * i] == doctest::Approx(s.result.sigma[i] * s.result.sigma[i]));
    for (std::size_t j = 0; j < kNumIntrinsics; ++j) {
      CHECK(s.result.covariance[9 * i + j] == doctest::Approx(s.result.covariance[9 * j + i]).epsilon(1e-9));
    }
    CHECK(s.result.assumed[i] == (i >= 6));
  }
  CHECK(s.result.condition > 1.0);
  constexpr int kFree = 6;
  const Eigen::Map<const Eigen::Matrix<double, 9, 9, Eigen::RowMajor>> covariance(s.result.covariance);
  const Eigen::Matrix<double, kFree, kFree> information = test::dense_inverse(covariance.topLeftCorner<kFree, kFree>());
  const Eigen::Matrix<double, kFree, 1> scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::VectorXd eigenvalues = test::dense_eigenvalues(scale.asDiagonal() * information * scale.asDiagonal());
  CHECK(s.result.condition == doctest::Approx(eigenvalues(kFree - 1) / eigenvalues(0)).epsilon(0.05));
}

TEST_CASE("offsets that all views share widen sigma beyond the points' own") {
  CovarianceOptions options;
  const double alone = solve(0.4, 0.4, options, 8).result.sigma[0];
  options.line_errors.offset_px = 0.1;
  const double little = solve(0.4, 0.4, options, 8).result.sigma[0];
  options.line_errors.offset_px = 0.2;
  const double more = solve(0.4, 0.4, options, 8).result.sigma[0];
  CHECK(little > alone);
  // Variances add, and the offsets' part grows with its square.
  CHECK(more * more - alone * alone == doctest::Approx(4.0 * (little * little - alone * alone)).epsilon(1e-6));
}

TEST_CASE("a parameter that rests on its prior is listed as assumed") {
  ParameterPolicy policy = radial_only();
  policy.prior_mean[0] = 400.0;
  policy.prior_sd[0] = 0.01;
  policy.prior_mean[1] = 400.0;
  policy.prior_sd[1] = 1e3;
  const Solved s = solve(0.4, 0.4, {}, 9, policy);
  CHECK(s.result.assumed[0]);
  CHECK_FALSE(s.result.assumed[1]);
}

TEST_CASE("an intrinsic that nothing determines is named") {
  // Lines through the image centre only, seen by a camera held in place: k1 acts along the lines, never across.
  test::SyntheticViews s;
  s.camera = test::make_camera(400.0, 400.0, 319.5, 239.5);
  for (int i = 0; i < 6; ++i) {
    const Vec3 d(std::cos(0.5 * i), std::sin(0.5 * i), 0.0);
    s.model.push_back(test::make_line(-d, d));
  }
  Rng rng(30);
  s.add_view(make_pose(Mat3::Identity(), Vec3(0.0, 0.0, 3.0)), 3, 0.0, 1.0, rng);
  RefineView view{};
  view.pose = s.poses[0];
  view.used = true;
  std::vector<float> residuals(s.points.size());
  Refiner refiner;
  RefineOptions one;
  one.max_iterations = 1;
  refiner.init(s.data(), {}, one, s.camera, {&view, 1}, residuals);
  (void)refiner.step();
  CalibrationResult result;
  CHECK(compute_covariance(refiner, {}, {}, 1, {}, &result) == Status::degenerate_geometry);
}

}  // namespace
}  // namespace lecalib
