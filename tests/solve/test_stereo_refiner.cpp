// SPDX-License-Identifier: MIT
#include "lecalib/solve/stereo_refiner.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "support/dense_algebra.hpp"
#include "support/place_along.hpp"
#include "support/stereo_rig.hpp"

namespace lecalib {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using test::DenseRig;
using test::EdgeScene;
using test::kShared;
using test::left_displacement;
using test::Rig;
using test::right_displacement;
using test::RigOptions;

Pose nudged(const Pose& pose, double by) {
  return make_pose(so3_exp(Vec3(by, -by, by)) * rotation_of(pose), translation_of(pose) + Vec3(by, by, -by));
}

StereoRefineOptions to_the_end() {
  StereoRefineOptions refine;
  refine.decrease_tolerance = 1e-13;
  return refine;
}

/// Largest difference of the two, in units of b's diagonal.
double difference(const StereoSolution& solution, const Matrix& b) {
  double largest = 0;
  for (std::size_t i = 0; i < kShared; ++i) {
    for (std::size_t j = 0; j < kShared; ++j) {
      if (i % 9 == 8 && i < 18) continue;  // k3 is held
      if (j % 9 == 8 && j < 18) continue;
      const auto r = static_cast<Eigen::Index>(i);
      const auto c = static_cast<Eigen::Index>(j);
      const double mine = solution.covariance[kShared * i + j] / solution.scale;
      largest = std::max(largest, std::abs(mine - b(r, c)) / std::sqrt(b(r, r) * b(c, c)));
    }
  }
  return largest;
}

TEST_CASE("stereo refiner: without noise it finds the truth") {
  for (const bool edges : {false, true}) {
    RigOptions options;
    options.edges = edges;
    options.noise_px = 0;
    Rig rig(options);
    for (std::size_t s = 0; edges && s < 2; ++s) {  // no offsets in the data: none are to be found
      EdgeScene& scene = *rig.side[s];
      for (std::size_t i = 0; i < scene.views.points.size(); ++i) {
        const bool on = scene.edges[i].polarity > 0;
        const std::size_t line = scene.views.points[i].line;
        const double px = (s == 0 ? left_displacement(line, on) : right_displacement(line, on)) * scene.edges[i].dark;
        scene.views.points[i].u_px -= px * double{scene.edges[i].normal_x};
        scene.views.points[i].v_px -= px * double{scene.edges[i].normal_y};
      }
    }
    REQUIRE(rig.run(nudged(rig.T_right_left, 0.02), to_the_end()) == Status::ok);
    // Rotations are stored to 1e-16 and normals to 6e-8 of a displacement.
    CHECK(rig.error().norm() <= (edges ? 1e-6 : 1e-9));
    for (std::size_t s = 0; s < 2; ++s) {
      const Camera& found = rig.side[s]->refiner.camera();
      for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
        const double truth = rig.side[s]->views.camera.*kIntrinsics[i];
        CHECK(std::abs(found.*kIntrinsics[i] - truth) <= (edges ? 1e-5 : 1e-8) * std::max(1.0, std::abs(truth)));
      }
    }
  }
}

TEST_CASE("stereo refiner: minimum and covariance are those of one dense system") {
  for (const bool edges : {false, true}) {
    CAPTURE(edges);
    RigOptions options;
    options.edges = edges;
    Rig rig(options);
    REQUIRE(rig.run(nudged(rig.T_right_left, 0.01), to_the_end()) == Status::ok);
    const DenseRig dense(rig);
    const Matrix covariance = test::dense_inverse(dense.information);
    Vector gradient = test::dense_product(dense.jacobian.transpose(), dense.residuals);
    for (std::size_t s = 0; edges && s < 2; ++s) {
      const EdgeOffsetWorkspace& offsets = rig.side[s]->workspace;
      for (std::size_t i = 0; i < rig.side[s]->offsets.size(); ++i) {
        gradient(dense.first_offset_of(rig, s) + static_cast<Eigen::Index>(i)) +=
            offsets.value[i] / (offsets.sigma[i] * offsets.sigma[i]);
      }
    }
    const Vector left_over = test::dense_product(covariance, gradient);  // the step that remains
    for (Eigen::Index i = 0; i < left_over.size(); ++i) {
      CHECK(std::abs(left_over(i)) <= 1e-3 * std::sqrt(covariance(i, i)));
    }
    CHECK(difference(rig.refiner.solution(), covariance) <= 1e-4);
  }
}

TEST_CASE("stereo refiner: errors of lines that are not estimated widen the covariance") {
  RigOptions options;
  options.edges = false;
  Rig rig(options);
  StereoRefineOptions refine = to_the_end();
  refine.line_errors = {0.3, 0.3, 0.2};
  REQUIRE(rig.run(rig.T_right_left, refine) == Status::ok);
  const DenseRig dense(rig);
  const Matrix inverse = test::dense_inverse(dense.information);
  Matrix covariance = rig.refiner.solution().scale * inverse;
  Eigen::Index row = 0;
  for (std::size_t s = 0; s < 2; ++s) {
    const std::vector<LinePoint>& points = rig.side[s]->corrected;
    for (std::size_t line = 0; line < rig.side[s]->views.model.size(); ++line) {
      Matrix moved = Matrix::Zero(dense.residuals.size(), 3);
      for (std::size_t v = 0; v < rig.side[s]->views.views.size(); ++v) {
        const View& view = rig.side[s]->views.views[v];
        for (std::size_t i = view.first; i < view.first + view.count; ++i) {
          if (points[i].line != line) continue;
          const double along = test::place_along(rig.side[s]->refiner.camera(), rig.side[s]->refiner.views()[v].pose,
                                                 rig.side[s]->views.model[line], Vec2(points[i].u_px, points[i].v_px));
          moved.row(row + static_cast<Eigen::Index>(i)) =
              Vec3(0.3, 0.3 * along, 0.2 * (6 * along * along - 0.5)) / points[i].sigma_px;
        }
      }
      const Matrix shifts = test::dense_product(inverse, test::dense_product(dense.jacobian.transpose(), moved));
      covariance += test::dense_product(shifts, shifts.transpose());
    }
    row += static_cast<Eigen::Index>(points.size());
  }
  StereoSolution unscaled = rig.refiner.solution();
  unscaled.scale = 1;
  CHECK(difference(unscaled, covariance) <= 1e-4);
}

TEST_CASE("stereo refiner: errors are as large as sigma says") {
  constexpr int kTrials = 60;
  Vec6 squares = Vec6::Zero();
  for (int trial = 0; trial < kTrials; ++trial) {
    RigOptions options;
    options.edges = false;
    options.noise_px = 0.05;  // the sigma that points are given
    options.seed = static_cast<std::uint64_t>(1000 + trial);
    Rig rig(options);
    REQUIRE(rig.run(nudged(rig.T_right_left, 0.01), {}) == Status::ok);
    const StereoSolution& solution = rig.refiner.solution();
    const Vec6 error = rig.error();
    for (std::size_t i = 0; i < 6; ++i) {
      const std::size_t k = 2 * kNumIntrinsics + i;
      const auto e = static_cast<Eigen::Index>(i);
      squares(e) += error(e) * error(e) / solution.covariance[kShared * k + k];
    }
  }
  // Six means of 60 squares, each 1 +- 0.18 where they are independent.
  CHECK(squares.mean() / kTrials >= 0.7);
  CHECK(squares.mean() / kTrials <= 1.3);
  for (Eigen::Index i = 0; i < 6; ++i) CHECK(squares(i) / kTrials <= 1.8);
}

TEST_CASE("stereo refiner: what cannot be refined is said") {
  RigOptions options;
  options.edges = false;
  Rig rig(options);
  const auto begin = [&rig](Span<const StereoPair> pairs) {
    return rig.refiner.init(rig.camera(0), rig.camera(1), pairs, rig.T_right_left, {}, rig.workspace);
  };
  CHECK(begin({}) == Status::too_few_lines);
  const StereoPair beyond[] = {{99, 0, Pose()}};
  CHECK(begin(beyond) == Status::invalid_argument);
  const StereoPair twice[] = {{0, 0, Pose()}, {0, 1, Pose()}};
  CHECK(begin(twice) == Status::invalid_argument);
  CHECK(begin(rig.pairs) == Status::ok);
  rig.workspace.partner[1] = rig.workspace.partner[1].first(1);
  CHECK(begin(rig.pairs) == Status::capacity_exceeded);
}

TEST_CASE("stereo refiner: what one pose for both costs is as much as noise asks, or it is refused") {
  constexpr int kTrials = 24;
  double sum = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    RigOptions options;
    options.edges = trial % 2 == 0;
    options.noise_px = 0.05;  // the sigma that points are given
    options.seed = 40 + static_cast<std::uint64_t>(trial);
    Rig rig(options);
    REQUIRE(rig.run(nudged(rig.T_right_left, 1e-3), {}) == Status::ok);
    sum += rig.refiner.solution().tie_chi2_per_dof;
  }
  CHECK(sum / kTrials == doctest::Approx(1).epsilon(0.3));
  // The right camera was elsewhere at one instant, by some sigmas.
  for (const double bound : {0.0, 2.0}) {
    Rig rig(RigOptions{});
    rig.pairs[2].symmetry = nudged(rig.symmetry, 0.003);
    StereoRefineOptions refine;
    refine.max_tie_chi2_per_dof = bound;
    CHECK(rig.run(rig.T_right_left, refine) == (bound > 0 ? Status::implausible_result : Status::ok));
    CHECK(rig.refiner.solution().tie_chi2_per_dof > 2);
  }
}

TEST_CASE("stereo refiner: a workspace that lacks one element of anything is refused") {
  for (const bool edges : {false, true}) {
    RigOptions options;
    options.edges = edges;
    Rig rig(options);
    const StereoRefinerWorkspace whole = rig.workspace;
    const std::size_t offsets = edges ? rig.side[0]->offsets.size() + rig.side[1]->offsets.size() : 2 * 8 * kLineErrors;
    const std::size_t n = offsets + kShared;
    const auto begin = [&rig](const StereoRefinerWorkspace& workspace) {
      return rig.refiner.init(rig.camera(0), rig.camera(1), rig.pairs, rig.T_right_left, {}, workspace);
    };
    const auto refused = [&](auto member, std::size_t needed) {
      StereoRefinerWorkspace workspace = whole;
      workspace.*member = (whole.*member).first(needed);
      CHECK(begin(workspace) == Status::ok);
      workspace.*member = (whole.*member).first(needed - 1);
      CHECK(begin(workspace) == Status::capacity_exceeded);
    };
    refused(&StereoRefinerWorkspace::matrix, triangle_index(n, 0));
    refused(&StereoRefinerWorkspace::tail, triangle_index(kShared, 0));
    refused(&StereoRefinerWorkspace::gradient, n);
    refused(&StereoRefinerWorkspace::step, n);
    refused(&StereoRefinerWorkspace::columns, 6 * n);
    refused(&StereoRefinerWorkspace::active, n);
    refused(&StereoRefinerWorkspace::kept_offsets, offsets);
  }
}

}  // namespace
}  // namespace lecalib
