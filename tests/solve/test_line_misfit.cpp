// SPDX-License-Identifier: MIT
/// How badly a line fits the others, against the solution found without it.
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "lecalib/solve/refine.hpp"
#include "support/dense_algebra.hpp"
#include "support/dense_problem.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

using test::SyntheticViews;

SyntheticViews two_views(std::uint64_t seed) {
  Rng rng(seed);
  SyntheticViews s;
  s.camera = test::make_camera(400.0, 410.0, 322.0, 236.0, -0.15, 0.05);
  s.model = test::random_lines(rng, 14, 1.2, 0.9, 0.6);
  for (int v = 0; v < 2; ++v) s.add_view(test::looking_pose(rng, 3.0, 0.5), 3, 0.02, 0.02, rng);
  return s;
}

ParameterPolicy radial_only() {
  ParameterPolicy policy;
  policy.free[6] = policy.free[7] = false;
  return policy;
}

struct Solved {
  Refiner refiner;
  std::vector<RefineView> views;
  std::vector<float> residuals;
};

void solve(const SyntheticViews& s, const CalibrationData& data, Solved* out) {
  for (const Pose& pose : s.poses) {
    out->views.push_back({});
    out->views.back().pose = pose;
    out->views.back().used = true;
  }
  out->residuals.resize(s.points.size());
  out->refiner.init(data, radial_only(), {}, s.camera, out->views, out->residuals);
  Status status = Status::in_progress;
  while (status == Status::in_progress) status = out->refiner.step();
  REQUIRE(status == Status::ok);
}

/// r' inverse(I + A covariance A') r of the line's points in the first view, at the solution without them.
double brute_force(const SyntheticViews& s, std::uint16_t line) {
  std::vector<std::uint8_t> left_out(s.points.size(), 0);
  SyntheticViews without = s;
  without.points.clear();
  std::vector<Eigen::Index> rows;
  for (std::size_t v = 0; v < 2; ++v) {
    without.views[v].first = static_cast<std::uint32_t>(without.points.size());
    for (std::size_t i = s.views[v].first; i < s.views[v].first + s.views[v].count; ++i) {
      if (v == 0 && s.points[i].line == line) {
        left_out[i] = 1;
        rows.push_back(static_cast<Eigen::Index>(i));
      } else {
        without.points.push_back(s.points[i]);
      }
    }
    without.views[v].count = static_cast<std::uint32_t>(without.points.size()) - without.views[v].first;
  }
  Solved solved;
  const CalibrationData others = without.data();
  solve(without, others, &solved);
  test::DenseState at{solved.refiner.camera(), {solved.views[0].pose, solved.views[1].pose}};
  const CalibrationData all = s.data();
  const auto n = static_cast<Eigen::Index>(9 + 6 * 2);
  Eigen::MatrixXd J(static_cast<Eigen::Index>(s.points.size()), n);
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
    if (k < 9 && !radial_only().free[k]) {
      J.col(k).setZero();
      continue;
    }
    step(k) = k < 4 ? 1e-3 : 1e-5;
    J.col(k) = (test::dense_residuals(all, at, step) - test::dense_residuals(all, at, -step)) / (2.0 * step(k));
  }
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < J.rows(); ++i) {
    if (left_out[static_cast<std::size_t>(i)] == 0) N += J.row(i).transpose() * J.row(i);
  }
  for (Eigen::Index k = 0; k < 9; ++k) N(k, k) += radial_only().free[k] ? 0.0 : 1.0;
  const Eigen::MatrixXd covariance = test::dense_inverse(N);
  const Eigen::VectorXd residuals = test::dense_residuals(all, at, Eigen::VectorXd::Zero(n));
  const auto count = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd A(count, n);
  Eigen::VectorXd r(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    A.row(i) = J.row(rows[static_cast<std::size_t>(i)]);
    r(i) = residuals(rows[static_cast<std::size_t>(i)]);
  }
  Eigen::MatrixXd spread = test::dense_product(A, test::dense_product(covariance, A.transpose()));
  spread.diagonal().array() += 1.0;
  return r.dot(test::dense_solve(spread, r).col(0));
}

TEST_CASE("line misfit: it is that to the solution without the line, whether the line is in use or not") {
  const SyntheticViews s = two_views(31);
  Solved all;
  const CalibrationData data = s.data();
  solve(s, data, &all);
  ReducedSystem system;
  REQUIRE(all.refiner.reduced_system(&system));
  for (const std::uint16_t line : {std::uint16_t{0}, std::uint16_t{5}, std::uint16_t{13}}) {
    const double expected = brute_force(s, line);
    std::size_t points = 0;
    CHECK(all.refiner.line_misfit(system, 0, line, &points) == doctest::Approx(expected).epsilon(0.01));
    CHECK(points == 3);

    std::vector<std::uint8_t> left_out(s.points.size(), 0);
    for (std::size_t i = 0; i < s.views[0].count; ++i) left_out[i] = s.points[i].line == line ? 1 : 0;
    CalibrationData others = data;
    others.left_out = left_out;
    Solved without;
    solve(s, others, &without);
    ReducedSystem reduced;
    REQUIRE(without.refiner.reduced_system(&reduced));
    CHECK(without.refiner.line_misfit(reduced, 0, line, &points) == doctest::Approx(expected).epsilon(0.01));
    CHECK(points == 3);
  }
  std::size_t points = 9;
  CHECK(all.refiner.line_misfit(system, 0, 99, &points) == 0.0);
  CHECK(points == 0);
}

TEST_CASE("line misfit: a line that the solution bends to stands out from the others") {
  SyntheticViews s = two_views(32);
  const Vec2 along(s.points[20].u_px - s.points[18].u_px, s.points[20].v_px - s.points[18].v_px);
  for (std::size_t i = 18; i < 21; ++i) {  // across the line, 15 sigma
    REQUIRE(s.points[i].line == 6);
    s.points[i].u_px -= 0.3 * along(1) / along.norm();
    s.points[i].v_px += 0.3 * along(0) / along.norm();
  }
  Solved all;
  const CalibrationData data = s.data();
  solve(s, data, &all);
  ReducedSystem system;
  REQUIRE(all.refiner.reduced_system(&system));
  double others = 0.0;
  double wrong = 0.0;
  for (std::uint16_t line = 0; line < 14; ++line) {
    std::size_t points = 0;
    const double misfit = all.refiner.line_misfit(system, 0, line, &points);
    (line == 6 ? wrong : others) = line == 6 ? misfit : std::max(others, misfit);
  }
  CHECK(wrong > 1.5 * others);
}

}  // namespace
}  // namespace lecalib
