// SPDX-License-Identifier: MIT
/// Views that a known turn ties in pairs.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "lecalib/solve/covariance.hpp"
#include "lecalib/solve/pose_group.hpp"
#include "support/dense_problem.hpp"
#include "support/numeric_jacobian.hpp"
#include "support/solver_run.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

using test::SyntheticViews;

/// The turn between two views, wrong by `error` about the axes of view b.
RelativePrior turn_between(const SyntheticViews& s, std::uint32_t a, std::uint32_t b, const Vec3& error,
                           double sigma_rad, double shared_rad = 0.0) {
  RelativePrior prior;
  prior.view_a = a;
  prior.view_b = b;
  prior.sigma_rad = sigma_rad;
  prior.shared_rad = shared_rad;
  Eigen::Map<RowMat3>(prior.R_b_a) = so3_exp(error) * rotation_of(s.poses[b]) * rotation_of(s.poses[a]).transpose();
  return prior;
}

SyntheticViews spatial_views(int count, double noise_px, std::uint64_t seed) {
  return test::spatial_views(90, count, noise_px, 0.5, seed);
}

/// Windows on a plane: two views each, the second turned by some degrees.
SyntheticViews planar_windows(int count, Rng& rng) {
  SyntheticViews s;
  s.camera = test::make_camera(400.0, 400.0, 319.5, 239.5, -0.1, 0.02);
  s.model = test::random_lines(rng, 12, 1.2, 0.9, 0.0);
  for (int w = 0; w < count; ++w) {
    const Mat3 R = so3_exp(Vec3(0.45, -0.35, 0.1)) * rotation_of(test::looking_pose(rng, 3.0, 0.15));
    const Vec3 t(rng.uniform(-0.1, 0.1), 0.0, 3.0);
    s.add_view(make_pose(R, t), 3, 0.3, 0.3, rng);
    s.add_view(make_pose(so3_exp(Vec3(0.05, 0.12, -0.06)) * R, t + Vec3(0.05, 0.0, 0.02)), 3, 0.3, 0.3, rng);
  }
  return s;
}

Vec3 gaussian_vector(Rng& rng, double sigma) {
  Vec3 v;
  for (int k = 0; k < 3; ++k) v(k) = sigma * test::gaussian(rng);
  return v;
}

TEST_CASE("known turns: the residual's derivatives are those of central differences") {
  Rng rng(91);
  for (int i = 0; i < 50; ++i) {
    SyntheticViews s = spatial_views(2, 0.0, 92);
    for (Pose& pose : s.poses) pose = make_pose(so3_exp(test::random_vector(rng, 2.0)), test::random_vector(rng, 1.0));
    const RelativePrior turn = turn_between(s, 0, 1, test::random_vector(rng, 0.01), 1.0);
    const TurnResidual residual = turn_residual(turn, s.poses[0], s.poses[1]);
    const auto by_a = test::numeric_jacobian<3, 3>(
        [&](const Vec3& w) {
          return turn_residual(turn, make_pose(so3_exp(w) * rotation_of(s.poses[0]), Vec3::Zero()), s.poses[1]).value;
        },
        Vec3(Vec3::Zero()), 1e-3);
    const auto by_b = test::numeric_jacobian<3, 3>(
        [&](const Vec3& w) {
          return turn_residual(turn, s.poses[0], make_pose(so3_exp(w) * rotation_of(s.poses[1]), Vec3::Zero())).value;
        },
        Vec3(Vec3::Zero()), 1e-3);
    CHECK((residual.by_a - by_a).norm() < 1e-9);
    CHECK((residual.by_b - by_b).norm() < 1e-9);
  }
}

TEST_CASE("known turns: covariances are those of the full normal equations, also with what the turns share") {
  SyntheticViews s = spatial_views(5, 0.3, 93);
  const std::vector<RelativePrior> turns = {turn_between(s, 3, 0, Vec3(1e-3, -5e-4, 0.0), 2e-3, 1.5e-3),
                                            turn_between(s, 1, 4, Vec3(0.0, 1e-3, 1e-3), 1e-3, 8e-4)};
  CalibrationData data = s.data();
  data.relative = turns;
  REQUIRE(validate(data) == Status::ok);
  const ParameterPolicy policy = test::mixed_policy();
  for (const LineErrorSizes& errors : {LineErrorSizes{}, LineErrorSizes{0.4, 0.3, 0.2}}) {
    test::RefinedProblem p(s, data, policy, errors);
    const test::DenseState at = p.state();
    // At the minimum the gradient of all squares vanishes.
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(9 + 6 * p.views.size()));
    const auto cost = [&](const Eigen::VectorXd& x) {
      const double prior = (at.camera.cx + x(2) - policy.prior_mean[2]) / policy.prior_sd[2];
      return test::dense_residuals(data, at, x).squaredNorm() + prior * prior;
    };
    CHECK(cost(zero) == doctest::Approx(p.refiner.cost()).epsilon(1e-6));

    const Eigen::MatrixXd expected = test::dense_covariance(data, at, policy, errors);
    for (Eigen::Index i = 0; i < 9; ++i) {
      if (policy.free[i]) CHECK(p.result.sigma[i] == doctest::Approx(std::sqrt(expected(i, i))).epsilon(2e-4));
    }
    for (std::size_t v = 0; v < p.views.size(); ++v) {
      const ViewResult out = p.pose_covariance(v);
      for (Eigen::Index i = 0; i < 6; ++i) {
        const double sigma =
            std::sqrt(expected(static_cast<Eigen::Index>(9 + 6 * v) + i, static_cast<Eigen::Index>(9 + 6 * v) + i));
        // Of what turns share, poses know only what comes through the intrinsics: near, not exact.
        CHECK(std::sqrt(out.covariance[7 * i]) == doctest::Approx(sigma).epsilon(0.15));
      }
    }
  }
}

TEST_CASE("known turns: two views of a plane tell the focal length better, and the errors are what sigma says") {
  constexpr int kTrials = 300;
  constexpr double kSigma = 1e-3;
  int within[2] = {};
  double with_sum = 0.0;
  double without_sum = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Rng rng(2000 + static_cast<std::uint64_t>(trial));
    const SyntheticViews s = planar_windows(1, rng);
    const RelativePrior turn = turn_between(s, 0, 1, gaussian_vector(rng, kSigma), kSigma);
    CalibrationData data = s.data();
    const test::SolverRun without(data);
    data.relative = {&turn, 1};
    const test::SolverRun with(data);
    REQUIRE(with.status == Status::ok);
    REQUIRE(without.status == Status::ok);
    with_sum += with.result().sigma[0];
    without_sum += without.result().sigma[0];
    const double error = std::abs(with.result().camera.fx - s.camera.fx) / with.result().sigma[0];
    for (int n = 0; n < 2; ++n) within[n] += error < n + 1 ? 1 : 0;
  }
  CHECK(with_sum < 0.8 * without_sum);
  CHECK(std::abs(within[0] / static_cast<double>(kTrials) - 0.683) < 0.08);  // 2.7 percent is one sigma of a share
  CHECK(within[1] / static_cast<double>(kTrials) > 0.92);
}

TEST_CASE("known turns: a bias that all windows share does not average out, and sigma knows") {
  constexpr int kTrials = 150;
  int within[2] = {};
  for (int trial = 0; trial < kTrials; ++trial) {
    Rng rng(5000 + static_cast<std::uint64_t>(trial));
    const SyntheticViews s = planar_windows(6, rng);
    constexpr double kShared = 4e-3;
    constexpr double kOwn = 1e-3;
    const Vec3 bias = gaussian_vector(rng, kShared);
    std::vector<RelativePrior> turns;
    for (std::uint32_t w = 0; w < 6; ++w) {
      const Vec3 error = bias + gaussian_vector(rng, kOwn);
      turns.push_back(turn_between(s, 2 * w, 2 * w + 1, error, std::sqrt(kShared * kShared + kOwn * kOwn), kShared));
    }
    CalibrationData data = s.data();
    data.relative = turns;
    const test::SolverRun run(data);
    REQUIRE(run.status == Status::ok);
    const double error = std::abs(run.result().camera.fx - s.camera.fx) / run.result().sigma[0];
    for (int n = 0; n < 2; ++n) within[n] += error < n + 1 ? 1 : 0;
  }
  CHECK(std::abs(within[0] / static_cast<double>(kTrials) - 0.683) < 0.12);
  CHECK(within[1] / static_cast<double>(kTrials) > 0.90);
}

TEST_CASE("known turns: a view of few lines gets its pose through its partner") {
  SyntheticViews s = spatial_views(2, 0.0, 95);
  const RelativePrior turn = turn_between(s, 0, 1, Vec3::Zero(), 1e-4);
  CalibrationData data = s.data();
  data.relative = {&turn, 1};
  const test::SolverRun run(data);
  REQUIRE(run.status == Status::ok);
  const Mat3 found =
      rotation_of(run.result().views[1].T_cam_world) * rotation_of(run.result().views[0].T_cam_world).transpose();
  CHECK((found - Mat3(Eigen::Map<const RowMat3>(turn.R_b_a))).norm() < 1e-7);
}

TEST_CASE("known turns: what is no pair of views is refused") {
  SyntheticViews s = spatial_views(4, 0.3, 96);
  const RelativePrior good = turn_between(s, 0, 1, Vec3::Zero(), 1e-3);
  const auto status = [&](const std::vector<RelativePrior>& turns) {
    CalibrationData data = s.data();
    data.relative = turns;
    return validate(data);
  };
  CHECK(status({good, turn_between(s, 3, 2, Vec3::Zero(), 1e-3)}) == Status::ok);
  CHECK(status({good, turn_between(s, 1, 2, Vec3::Zero(), 1e-3)}) == Status::invalid_argument);  // a chain
  CHECK(status({turn_between(s, 1, 1, Vec3::Zero(), 1e-3)}) == Status::invalid_argument);
  CHECK(status({turn_between(s, 0, 1, Vec3::Zero(), 0.0)}) == Status::invalid_argument);
  CHECK(status({turn_between(s, 0, 1, Vec3::Zero(), 1e-3, 2e-3)}) == Status::invalid_argument);
  RelativePrior outside = good;
  outside.view_b = 4;
  CHECK(status({outside}) == Status::invalid_argument);
}

}  // namespace
}  // namespace lecalib
