// SPDX-License-Identifier: MIT
/// What the solver assumes beyond its points: errors of whole lines, and square pixels.
#include <doctest/doctest.h>

#include <cmath>
#include <memory>
#include <utility>

#include "lecalib/math/line_projection.hpp"
#include "lecalib/pipeline/mono_solver.hpp"
#include "support/guarded_arena.hpp"
#include "support/place_along.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

using test::SyntheticViews;

SyntheticViews box_views(double fy, double noise_px) {
  Rng rng(11);
  SyntheticViews s;
  s.camera = test::make_camera(400.0, fy, 322.0, 236.0, -0.1, 0.03);
  s.model = test::box_edges(1.0, 0.8, 0.6);
  for (int v = 0; v < 5; ++v) s.add_view(test::looking_pose(rng, 3.0, 0.5), 3, noise_px, 0.5, rng);
  return s;
}

CalibrationResult solve(const SyntheticViews& s, const MonoSolverOptions& options) {
  const CalibrationData data = s.data();
  const MonoSolverCapacities capacities = {data.views.size(), data.points.size(), data.model.size()};
  test::GuardedArena memory(required_bytes(capacities));
  MonoSolverWorkspace workspace;
  REQUIRE(carve(memory.arena(), capacities, &workspace));
  const auto solver = std::make_unique<MonoSolver>();
  const MonoStart start = {s.camera, s.poses};
  Status status = solver->init(data, options, workspace, start);
  while (status == Status::ok || status == Status::in_progress) {
    status = solver->step();
    if (status == Status::ok) break;
  }
  REQUIRE(status == Status::ok);
  CalibrationResult result = solver->result();
  result.views = {};
  return result;
}

Mat9 covariance_of(const CalibrationResult& result) { return Eigen::Map<const Mat9>(result.covariance); }

/// What an error of 1 px is along a line.
enum class Error { offset, tilt, bend };
double at(Error error, double along) {
  return error == Error::offset ? 1 : error == Error::tilt ? along : 6 * along * along - 0.5;
}

/// Moves the points of one model line across it, to the same side in every view.
void shift_line(SyntheticViews* s, std::size_t line, Error error, double size_px) {
  for (std::size_t v = 0; v < s->views.size(); ++v) {
    const View& view = s->views[v];
    const CameraLine seen = line_in_camera(rotation_of(s->poses[v]), translation_of(s->poses[v]), s->model[line]);
    for (std::size_t i = view.first; i < view.first + view.count; ++i) {
      LinePoint& point = s->points[i];
      LineFoot foot;
      if (point.line != line) continue;
      REQUIRE(find_foot(s->camera, valid_radius(s->camera), seen, Vec2(point.u_px, point.v_px), &foot));
      const double along = test::place_along(s->camera, s->poses[v], s->model[line], Vec2(point.u_px, point.v_px));
      point.u_px += size_px * at(error, along) * foot.normal(0);
      point.v_px += size_px * at(error, along) * foot.normal(1);
    }
  }
}

}  // namespace

TEST_CASE("the covariance of the lines' errors is what moving each line does to the solution") {
  MonoSolverOptions options;
  options.loss_width = 1e6;
  options.policy.focal_sd = options.policy.spatial_centre_sd = 0.0;  // priors would pull exact data off the truth
  options.policy.radial_sd = options.policy.higher_radial_sd = 0.0;
  const SyntheticViews exact = box_views(410.0, 0.0);
  const CalibrationResult without = solve(exact, options);
  options.covariance.line_errors = {0.4, 0.3, 0.2};
  const CalibrationResult with = solve(exact, options);

  constexpr double kShift = 1e-3;
  Mat9 expected = Mat9::Zero();
  const std::pair<Error, double> sizes[] = {{Error::offset, 0.4}, {Error::tilt, 0.3}, {Error::bend, 0.2}};
  for (std::size_t line = 0; line < exact.model.size(); ++line) {
    for (const auto& [error, size_px] : sizes) {
      Eigen::Matrix<double, 9, 1> change;
      for (const double side : {1.0, -1.0}) {
        SyntheticViews shifted = exact;
        shift_line(&shifted, line, error, side * kShift);
        const CalibrationResult moved = solve(shifted, options);
        for (Eigen::Index i = 0; i < 9; ++i) {
          const double value = moved.camera.*kIntrinsics[static_cast<std::size_t>(i)];
          change(i) = side > 0 ? value : (change(i) - value) / (2 * kShift);
        }
      }
      expected += size_px * size_px * change * change.transpose();
    }
  }
  const Mat9 added = covariance_of(with) - covariance_of(without);
  CHECK(added.norm() > 1.0);
  CHECK((added - expected).norm() < 1e-3 * expected.norm());
}

TEST_CASE("a prior on square pixels pulls fx and fy together as far as it is trusted") {
  const SyntheticViews oblong = box_views(410.0, 0.5);
  MonoSolverOptions none;
  MonoSolverOptions strict;
  strict.policy.aspect_sd = 1e-6;
  MonoSolverOptions lax;
  lax.policy.aspect_sd = 1e3;
  const CalibrationResult free = solve(oblong, none);
  CHECK(std::abs(free.camera.fy / free.camera.fx - 1.025) < 0.01);
  const Camera square = solve(oblong, strict).camera;
  CHECK(std::abs(square.fy / square.fx - 1) < 1e-4);
  CHECK(std::abs(solve(oblong, lax).camera.fy - free.camera.fy) < 1e-3);

  const auto variance_of_difference = [](const CalibrationResult& result) {
    const Mat9 c = covariance_of(result);
    return c(0, 0) + c(1, 1) - 2 * c(0, 1);
  };
  const SyntheticViews truly_square = box_views(400.0, 0.5);
  CHECK(variance_of_difference(solve(truly_square, strict)) < 1e-6);
  CHECK(variance_of_difference(solve(truly_square, none)) > 1e-2);
}

}  // namespace lecalib
