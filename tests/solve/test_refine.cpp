// SPDX-License-Identifier: MIT
#include "lecalib/solve/refine.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <string>
#include <vector>

#include "lecalib/math/line_projection.hpp"
#include "support/dense_algebra.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

using test::SyntheticViews;

struct Problem {
  SyntheticViews scene;
  std::vector<RefineView> views;
  std::vector<float> residuals;
  Camera start;
  Refiner refiner;

  void init(const ParameterPolicy& policy, const RefineOptions& options) {
    residuals.assign(scene.points.size(), 0.0F);
    refiner.init(scene.data(), policy, options, start, views, residuals);
  }
  Status run() {
    Status status = Status::in_progress;
    while (status == Status::in_progress) status = refiner.step();
    return status;
  }
};

/// Views of lines in space with camera and poses moved away from the truth.
Problem make_problem(int num_views, double noise_px, double disturbance, std::uint64_t seed) {
  Rng rng(seed);
  Problem p;
  p.scene.camera = test::make_camera(400.0, 410.0, 322.0, 236.0, -0.15, 0.05, 5e-4, -3e-4);
  p.scene.model = test::random_lines(rng, 15, 1.2, 0.9, 0.6);
  for (int v = 0; v < num_views; ++v) p.scene.add_view(test::looking_pose(rng, 3.0, 0.5), 4, noise_px, 0.5, rng);
  p.start = p.scene.camera;
  p.start.fx *= 1.0 + disturbance;
  p.start.fy *= 1.0 + disturbance;
  p.start.cx += 100.0 * disturbance;
  p.start.k1 = p.start.k2 = p.start.p1 = p.start.p2 = 0.0;
  for (const Pose& pose : p.scene.poses) {
    RefineView view{};
    const Vec3 w = test::random_vector(rng, 0.5 * disturbance);
    const Vec3 v = test::random_vector(rng, disturbance);
    view.pose = make_pose(so3_exp(w) * rotation_of(pose), translation_of(pose) + v);
    view.used = true;
    p.views.push_back(view);
  }
  return p;
}

ParameterPolicy no_priors() { return {}; }

TEST_CASE("noise-free: intrinsics and poses to 1e-9 from a start 10 % off") {
  Problem p = make_problem(4, 0.0, 0.1, 1);
  p.init(no_priors(), {});
  CHECK(p.run() == Status::ok);
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    const double truth = p.scene.camera.*kIntrinsics[i];
    CHECK(std::abs(p.refiner.camera().*kIntrinsics[i] - truth) < 1e-9 * std::max(1.0, std::abs(truth)));
  }
  for (std::size_t v = 0; v < p.views.size(); ++v) {
    CHECK((rotation_of(p.views[v].pose) - rotation_of(p.scene.poses[v])).norm() < 1e-9);
    CHECK((translation_of(p.views[v].pose) - translation_of(p.scene.poses[v])).norm() < 1e-9);
  }
  CHECK(p.refiner.cost() < 1e-15);
}

TEST_CASE("the cost never rises and ends below the truth's") {
  Problem p = make_problem(3, 0.5, 0.1, 2);
  p.init(no_priors(), {});
  double cost = std::numeric_limits<double>::infinity();
  Status status = Status::in_progress;
  while (status == Status::in_progress) {
    status = p.refiner.step();
    CHECK(p.refiner.cost() <= cost);
    cost = p.refiner.cost();
  }
  CHECK(status == Status::ok);
  Problem truth = make_problem(3, 0.5, 0.0, 2);
  truth.start = truth.scene.camera;
  RefineOptions one;
  one.max_iterations = 1;
  truth.init(no_priors(), one);
  CHECK(truth.refiner.step() != Status::numerical_failure);
  CHECK(cost <= truth.refiner.cost() * (1.0 + 1e-6));
}

/// The dense Jacobian over [intrinsics | poses], by the residual's own derivatives (which have tests of their own).
void dense_system(const Problem& p, Eigen::MatrixXd* J, Eigen::VectorXd* r) {
  const Camera& camera = p.refiner.camera();
  const auto rows = static_cast<Eigen::Index>(p.scene.points.size());
  *J = Eigen::MatrixXd::Zero(rows, 9 + 6 * static_cast<Eigen::Index>(p.views.size()));
  r->resize(rows);
  for (std::size_t v = 0; v < p.views.size(); ++v) {
    const View& view = p.scene.views[v];
    for (std::size_t i = view.first; i < view.first + view.count; ++i) {
      const LinePoint& point = p.scene.points[i];
      LineResidual residual;
      REQUIRE(line_residual(
          camera, valid_radius(camera),
          line_in_camera(rotation_of(p.views[v].pose), translation_of(p.views[v].pose), p.scene.model[point.line]),
          Vec2(point.u_px, point.v_px), &residual));
      const auto row = static_cast<Eigen::Index>(i);
      J->block<1, 9>(row, 0) = residual.d_intrinsics() / point.sigma_px;
      J->block<1, 6>(row, 9 + 6 * static_cast<Eigen::Index>(v)) = residual.d_pose() / point.sigma_px;
      (*r)(row) = residual.value_px() / point.sigma_px;
    }
  }
}

/// The dense system without k3, which is held.
Eigen::MatrixXd free_columns(const Problem& p, Eigen::VectorXd* r) {
  Eigen::MatrixXd J;
  dense_system(p, &J, r);
  Eigen::MatrixXd free(J.rows(), J.cols() - 1);
  free << J.leftCols(8), J.rightCols(J.cols() - 9);
  return free;
}

/// A inverse(U'U) A': how much each row of A pulls on a solution from the rows of U.
Eigen::MatrixXd leverage(const Eigen::MatrixXd& A, const Eigen::MatrixXd& U) {
  return test::dense_product(A, test::dense_solve(test::dense_product(U.transpose(), U), A.transpose()));
}

TEST_CASE("standardised residuals are r / sqrt(1 - h) with the dense equations' leverages") {
  Problem p = make_problem(3, 0.5, 0.02, 9);
  p.init(no_priors(), {});
  REQUIRE(p.run() == Status::ok);
  std::vector<float> standardised(p.scene.points.size());
  REQUIRE(p.refiner.standardised_residuals(standardised));
  Eigen::VectorXd r;
  const Eigen::MatrixXd free = free_columns(p, &r);
  const Eigen::MatrixXd hat = leverage(free, free);
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    const double expected = r(i) / std::sqrt(1.0 - hat(i, i));
    CHECK(static_cast<double>(standardised[static_cast<std::size_t>(i)]) == doctest::Approx(expected).epsilon(1e-4));
  }
}

TEST_CASE("standardised residuals of points left out are r / sqrt(1 + h): a solution far from them knows it") {
  Problem p = make_problem(3, 0.5, 0.02, 9);
  std::vector<std::uint8_t> left_out(p.scene.points.size(), 0);
  for (std::size_t i = 0; i < left_out.size(); i += 7) left_out[i] = 1;
  CalibrationData data = p.scene.data();
  data.left_out = left_out;
  p.residuals.assign(p.scene.points.size(), 0.0F);
  p.refiner.init(data, no_priors(), {}, p.start, p.views, p.residuals);
  REQUIRE(p.run() == Status::ok);
  std::vector<float> standardised(p.scene.points.size());
  REQUIRE(p.refiner.standardised_residuals(standardised));
  Eigen::VectorXd r;
  const Eigen::MatrixXd free = free_columns(p, &r);
  Eigen::MatrixXd used = free;
  for (std::size_t i = 0; i < left_out.size(); ++i) {
    if (left_out[i] != 0) used.row(static_cast<Eigen::Index>(i)).setZero();
  }
  const Eigen::MatrixXd hat = leverage(free, used);
  for (std::size_t i = 0; i < left_out.size(); i += 7) {
    const auto k = static_cast<Eigen::Index>(i);
    CHECK(static_cast<double>(standardised[i]) == doctest::Approx(r(k) / std::sqrt(1.0 + hat(k, k))).epsilon(1e-3));
  }
}

TEST_CASE("the Schur complement is that of the dense normal equations") {
  Problem p = make_problem(4, 0.5, 0.02, 3);
  ParameterPolicy policy;
  policy.free[8] = true;
  policy.prior_mean[2] = 319.5;
  policy.prior_sd[2] = 10.0;
  RefineOptions options;
  options.max_iterations = 1;
  p.init(policy, options);
  CHECK(p.refiner.step() == Status::in_progress);
  ReducedSystem reduced;
  REQUIRE(p.refiner.reduced_system(&reduced));
  Eigen::MatrixXd J;
  Eigen::VectorXd r;
  dense_system(p, &J, &r);
  CHECK(p.refiner.data_cost() == doctest::Approx(r.squaredNorm()).epsilon(1e-12));
  const double error = (p.refiner.camera().cx - 319.5) / 10.0;
  CHECK(p.refiner.cost() == doctest::Approx(r.squaredNorm() + error * error).epsilon(1e-12));
  Eigen::MatrixXd H = test::dense_product(J.transpose(), J);
  Eigen::MatrixXd g = test::dense_product(-J.transpose(), r);
  H(2, 2) += 1.0 / 100.0;
  g(2, 0) -= error / 10.0;
  const Eigen::Index n = H.rows() - 9;
  const Eigen::MatrixXd onto_camera =
      test::dense_product(H.topRightCorner(9, n), test::dense_inverse(H.bottomRightCorner(n, n)));
  const Eigen::MatrixXd S = H.topLeftCorner(9, 9) - test::dense_product(onto_camera, H.bottomLeftCorner(n, 9));
  const Eigen::MatrixXd b = g.topRows(9) - test::dense_product(onto_camera, g.bottomRows(n));
  for (Eigen::Index i = 0; i < 9; ++i) {
    CHECK(reduced.gradient(i) == doctest::Approx(b(i, 0)).epsilon(1e-6));
    for (Eigen::Index j = 0; j < 9; ++j) {
      CHECK(std::abs(reduced.matrix(i, j) - S(i, j)) < 1e-8 * std::sqrt(H(i, i) * H(j, j)));
    }
  }
}

TEST_CASE("held parameters stay, views not used do not count") {
  Problem p = make_problem(4, 0.3, 0.05, 4);
  p.views[2].used = false;
  const Pose untouched = p.views[2].pose;
  ParameterPolicy policy;
  for (std::size_t i = 4; i < kNumIntrinsics; ++i) policy.free[i] = false;
  p.start.k1 = -0.15;
  p.init(policy, {});
  CHECK(p.run() == Status::ok);
  CHECK(p.refiner.camera().k1 == -0.15);
  CHECK(p.refiner.camera().k2 == 0.0);
  CHECK(p.refiner.points_used() == p.scene.points.size() - p.scene.views[2].count);
  for (int k = 0; k < 9; ++k) CHECK(p.views[2].pose.R[k] == untouched.R[k]);
}

TEST_CASE("a prior pulls as its sigma says") {
  Problem strong = make_problem(2, 0.3, 0.02, 5);
  ParameterPolicy policy;
  policy.prior_mean[0] = 450.0;
  policy.prior_sd[0] = 1e-3;
  strong.init(policy, {});
  CHECK(strong.run() == Status::ok);
  CHECK(strong.refiner.camera().fx == doctest::Approx(450.0).epsilon(1e-3));
  Problem weak = make_problem(2, 0.3, 0.02, 5);
  policy.prior_sd[0] = 1e4;
  weak.init(policy, {});
  CHECK(weak.run() == Status::ok);
  CHECK(weak.refiner.camera().fx == doctest::Approx(400.0).epsilon(0.02));
}

TEST_CASE("the aspect prior draws the focal lengths together, and its derivatives are those of its cost") {
  Problem loose = make_problem(2, 0.3, 0.02, 5);  // fx 400, fy 410
  ParameterPolicy policy;
  policy.aspect_sd = 1e-6;
  loose.init(policy, {});
  CHECK(loose.run() == Status::ok);
  const Camera& tied = loose.refiner.camera();
  CHECK(std::abs(tied.fy - tied.fx) < 1e-3 * std::abs(loose.scene.camera.fy - loose.scene.camera.fx));

  policy.aspect_sd = 0.01;  // of 405 px: 4.05 px
  Problem weak = make_problem(2, 0.3, 0.02, 5);
  weak.init(policy, {});
  CHECK(weak.run() == Status::ok);
  const Camera& camera = weak.refiner.camera();
  const double error = (camera.fy - camera.fx) / (0.01 * 0.5 * (camera.fx + camera.fy));
  CHECK(weak.refiner.cost() - weak.refiner.data_cost() == doctest::Approx(error * error).epsilon(1e-9));
  ReducedSystem reduced;  // at the optimum data and prior balance
  REQUIRE(weak.refiner.reduced_system(&reduced));
  CHECK(std::abs(reduced.gradient(0)) < 1e-3 * std::sqrt(reduced.matrix(0, 0)));
  CHECK(std::abs(reduced.gradient(1)) < 1e-3 * std::sqrt(reduced.matrix(1, 1)));
}

TEST_CASE("every way to stop") {
  Problem p = make_problem(3, 0.5, 0.1, 6);
  p.init(no_priors(), {});
  CHECK(p.run() == Status::ok);
  CHECK(p.refiner.reason() == StopReason::small_decrease);
  // From the optimum, with no tolerance left, only rounding or the damping can end it.
  RefineOptions strict;
  strict.decrease_tolerance = 0.0;
  p.start = p.refiner.camera();
  p.init(no_priors(), strict);
  CHECK(p.run() == Status::ok);
  const StopReason reason = p.refiner.reason();
  CHECK((reason == StopReason::small_step || reason == StopReason::no_descent));

  RefineOptions short_run;
  short_run.max_iterations = 2;
  p = make_problem(3, 0.5, 0.1, 6);
  p.init(no_priors(), short_run);
  CHECK(p.run() == Status::not_converged);
  CHECK(p.refiner.reason() == StopReason::iteration_limit);
  CHECK(p.refiner.iterations() == 2);

  short_run.max_iterations = 7;
  short_run.decrease_tolerance = 0.0;  // which would take more
  p = make_problem(3, 0.5, 0.1, 6);
  p.init(no_priors(), short_run);
  CHECK(p.run() == Status::ok);
  CHECK(p.refiner.reason() == StopReason::settled);
  CHECK(p.refiner.iterations() == 7);

  p = make_problem(3, 0.5, 0.1, 6);
  p.start.fx = std::numeric_limits<double>::quiet_NaN();
  p.init(no_priors(), {});
  CHECK(p.run() == Status::numerical_failure);
  CHECK(p.refiner.reason() == StopReason::numerical_failure);

  p = make_problem(1, 0.0, 0.0, 6);  // one line, repeated: the pose is free to slide along it
  for (ModelLine& line : p.scene.model) line = p.scene.model[0];
  p.init(no_priors(), {});
  CHECK(p.run() == Status::ok);  // the damping carries it
  ReducedSystem system;
  CHECK_FALSE(p.refiner.reduced_system(&system));
  for (int i = 0; i <= 6; ++i) CHECK(std::string(to_string(static_cast<StopReason>(i))) != "unknown");
}

TEST_CASE("at the iteration limit it is ok exactly where the minimum is within a tenth of a sigma") {
  Problem exact = make_problem(3, 0.5, 0.1, 6);
  exact.init(no_priors(), {});
  REQUIRE(exact.run() == Status::ok);
  bool settled_before = false;
  for (int limit = 1; limit <= 8; ++limit) {
    Problem p = make_problem(3, 0.5, 0.1, 6);
    RefineOptions options;
    options.max_iterations = limit;
    options.decrease_tolerance = 0.0;
    p.init(no_priors(), options);
    const bool settled = p.run() == Status::ok;
    CHECK(p.refiner.iterations() == limit);
    CHECK((limit > 1 || !settled));
    CHECK((settled || !settled_before));
    const double above = p.refiner.cost() - exact.refiner.cost();
    if (settled) CHECK(above < 0.011);
    if (!settled) CHECK(above > 0.009);
    settled_before = settled;
  }
  CHECK(settled_before);
}

TEST_CASE("the step that is too small for new equations is made at the end, and brings the camera nearer") {
  Problem exact = make_problem(3, 0.5, 0.1, 6);
  RefineOptions strict;
  strict.decrease_tolerance = 1e-15;
  exact.init(no_priors(), strict);
  REQUIRE(exact.run() == Status::ok);
  Problem p = make_problem(3, 0.5, 0.1, 6);
  RefineOptions loose;
  loose.decrease_tolerance = 1e-4;
  p.init(no_priors(), loose);
  REQUIRE(p.run() == Status::ok);
  REQUIRE(p.refiner.reason() == StopReason::small_decrease);
  const auto distance = [&] { return std::abs(p.refiner.camera().fx - exact.refiner.camera().fx); };
  const auto pose_distance = [&] {
    return (translation_of(p.views[0].pose) - translation_of(exact.views[0].pose)).norm();
  };
  const double before = distance();
  const double pose_before = pose_distance();
  p.refiner.make_last_step();
  CHECK(distance() < 0.5 * before);
  CHECK(pose_distance() < 0.5 * pose_before);
}

TEST_CASE("a point whose line has no image costs a constant and is counted") {
  Problem p = make_problem(2, 0.0, 0.0, 7);
  p.start = p.scene.camera;
  p.start.k1 = -3.0;  // folds at r = 1/3
  RefineOptions one;
  one.max_iterations = 1;
  p.init(no_priors(), one);
  CHECK(p.refiner.step() != Status::numerical_failure);
  CHECK(p.refiner.points_used() == p.scene.points.size());
  Problem near = make_problem(2, 0.0, 0.0, 7);
  near.start = near.scene.camera;
  near.start.k1 = -30.0;
  near.init(no_priors(), one);
  CHECK(near.refiner.step() != Status::ok);
  CHECK(near.refiner.points_lost() > 0);
}

TEST_CASE("time and memory per view do not grow with the number of views") {
  static_assert(sizeof(RefineView) < 1100, "one view");
  Problem p = make_problem(40, 0.3, 0.05, 8);
  p.init(no_priors(), {});
  CHECK(p.run() == Status::ok);
  CHECK(p.refiner.camera().fx == doctest::Approx(400.0).epsilon(0.01));
}

}  // namespace
}  // namespace lecalib
