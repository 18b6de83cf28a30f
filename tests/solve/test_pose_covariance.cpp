// SPDX-License-Identifier: MIT
/// The covariances of poses and intrinsics against the inverse of the full normal equations, built without any
/// elimination from finite differences of all residuals.
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "lecalib/solve/covariance.hpp"
#include "support/dense_problem.hpp"
#include "support/solver_run.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

using test::SyntheticViews;

SyntheticViews views_in_space(int count, double noise_px, double sigma_px, std::uint64_t seed) {
  return test::spatial_views(70, count, noise_px, sigma_px, seed);
}

TEST_CASE("pose covariance: it is that of the full normal equations, with priors, held parameters and line errors") {
  const SyntheticViews s = views_in_space(3, 0.3, 0.5, 71);
  const ParameterPolicy policy = test::mixed_policy();
  for (const LineErrorSizes& errors : {LineErrorSizes{}, LineErrorSizes{0.4, 0.3, 0.2}}) {
    test::RefinedProblem p(s, s.data(), policy, errors);
    const Eigen::MatrixXd expected = test::dense_covariance(s.data(), p.state(), policy, errors);
    for (Eigen::Index i = 0; i < 9; ++i) {
      if (policy.free[i]) CHECK(p.result.sigma[i] == doctest::Approx(std::sqrt(expected(i, i))).epsilon(1e-4));
    }
    for (std::size_t v = 0; v < p.views.size(); ++v) {
      const ViewResult out = p.pose_covariance(v);
      const auto first = static_cast<Eigen::Index>(9 + 6 * v);
      for (Eigen::Index i = 0; i < 6; ++i) {
        for (Eigen::Index j = 0; j < 6; ++j) {
          const double scale = std::sqrt(expected(first + i, first + i) * expected(first + j, first + j));
          CHECK(std::abs(out.covariance[6 * i + j] - expected(first + i, first + j)) < 1e-4 * scale);
        }
      }
    }
  }
}

TEST_CASE("pose covariance: 68.3 and 95.4 percent of the true poses lie within one and two sigma") {
  constexpr int kTrials = 400;
  int within[2] = {};
  int total = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const SyntheticViews s = views_in_space(2, 0.5, 0.5, 1000 + static_cast<std::uint64_t>(trial));
    const test::SolverRun run(s.data());
    REQUIRE(run.status == Status::ok);
    for (std::size_t v = 0; v < 2; ++v) {
      const ViewResult& view = run.result().views[v];
      const Vec3 turn = so3_log(rotation_of(view.T_cam_world) * rotation_of(s.poses[v]).transpose());
      const Vec3 move = translation_of(view.T_cam_world) - translation_of(s.poses[v]);
      for (int k = 0; k < 6; ++k) {
        const double error = std::abs(k < 3 ? turn(k) : move(k - 3)) / std::sqrt(view.covariance[7 * k]);
        for (int n = 0; n < 2; ++n) within[n] += error < n + 1 ? 1 : 0;
        ++total;
      }
    }
  }
  // Twelve correlated figures a trial: the shares scatter by some 1.5 percent. Sigma is never narrowed, and so 3
  // percent too wide on average.
  const double share = static_cast<double>(within[0]) / total;
  CHECK(share > 0.64);
  CHECK(share < 0.73);
  CHECK(static_cast<double>(within[1]) / total > 0.93);
}

TEST_CASE("pose covariance: residuals by line are those of the points, and mark what is left out") {
  SyntheticViews s = views_in_space(2, 0.2, 0.2, 72);
  for (std::size_t i = 0; i < s.views[0].count; ++i) {
    if (s.points[i].line == 3) s.points[i].v_px += 60.0;
  }
  const test::SolverRun run(s.data());
  REQUIRE(run.status == Status::ok);
  REQUIRE(run.result().lines_left_out >= 1);
  for (std::size_t v = 0; v < 2; ++v) {
    const Span<const ViewLineResult> lines = run.result().views[v].residuals;
    REQUIRE(lines.size() == s.model.size());
    for (std::size_t l = 0; l < lines.size(); ++l) {
      CHECK(lines[l].line == l);
      double sum = 0.0;
      double squares = 0.0;
      std::uint32_t count = 0;
      for (std::size_t i = s.views[v].first; i < s.views[v].first + s.views[v].count; ++i) {
        if (s.points[i].line != l) continue;
        const double distance = static_cast<double>(run.solver.residuals()[i]) * s.points[i].sigma_px;
        sum += distance;
        squares += distance * distance;
        ++count;
      }
      CHECK(lines[l].points == count);
      CHECK(static_cast<double>(lines[l].mean_px) == doctest::Approx(sum / count).epsilon(1e-5));
      CHECK(static_cast<double>(lines[l].rms_px) == doctest::Approx(std::sqrt(squares / count)).epsilon(1e-5));
      CHECK(lines[l].left_out == (v == 0 && l == 3));
    }
  }
}

TEST_CASE("pose covariance: the sign of a line's mean tells its side") {
  SyntheticViews s = views_in_space(2, 0.0, 0.2, 73);
  // All points of a line are moved to the left of the way from p to q, as seen with y down.
  const ModelLine& line = s.model[4];
  Vec2 ends[2];
  for (int e = 0; e < 2; ++e) {
    const double* world = e == 0 ? line.p : line.q;
    REQUIRE(project(s.camera, rotation_of(s.poses[1]) * Vec3(world[0], world[1], world[2]) + translation_of(s.poses[1]),
                    &ends[e]));
  }
  const Vec2 along = (ends[1] - ends[0]).normalized();
  const Vec2 left(along(1), -along(0));
  for (std::size_t i = s.views[1].first; i < s.points.size(); ++i) {
    if (s.points[i].line != 4) continue;
    s.points[i].u_px += 0.5 * left(0);
    s.points[i].v_px += 0.5 * left(1);
  }
  const test::SolverRun run(s.data());
  REQUIRE(run.status == Status::ok);
  CHECK(run.result().views[1].residuals[4].mean_px > 0.05F);
}

}  // namespace
}  // namespace lecalib
