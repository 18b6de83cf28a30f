// SPDX-License-Identifier: MIT
#include "lecalib/solve/edge_offsets.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "lecalib/solve/covariance.hpp"
#include "support/alloc_counter.hpp"
#include "support/dense_algebra.hpp"
#include "support/edge_scene.hpp"

namespace lecalib {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using Scene = test::EdgeScene;

/// The whole problem at once: 9 intrinsics, 6 for each pose, all offsets.
struct Dense {
  Matrix jacobian;
  Vector residuals;
  Matrix information;  ///< priors of the offsets included

  Dense(const Scene& s, const EdgeOffsets& offsets, const Vector& sigmas) {
    const auto num_points = static_cast<Eigen::Index>(s.corrected.size());
    const auto num_offsets = static_cast<Eigen::Index>(offsets.size());
    const auto poses_end = static_cast<Eigen::Index>(kNumIntrinsics + 6 * s.poses.size());
    const Eigen::Index size = poses_end + num_offsets;
    const auto residuals_at = [&](const Vector& x) {
      Camera camera = s.refiner.camera();
      for (Eigen::Index i = 0; i < 9; ++i) camera.*kIntrinsics[i] += x(i);
      Vector out(num_points);
      for (std::size_t v = 0; v < s.poses.size(); ++v) {
        const Vector d = x.segment(static_cast<Eigen::Index>(kNumIntrinsics + 6 * v), 6);
        const Mat3 turn = so3_exp(Vec3(d.head(3)));
        const Mat3 R = turn * rotation_of(s.poses[v].pose);
        const Vec3 t = turn * translation_of(s.poses[v].pose) + Vec3(d.tail(3));
        const View& view = s.views.views[v];
        for (std::size_t i = view.first; i < view.first + view.count; ++i) {
          const LinePoint& point = s.corrected[i];
          const OffsetTerms terms = offsets.terms(i);
          double px = 0;
          for (std::size_t k = 0; k < terms.count; ++k) px += terms.factor[k] * x(poses_end + terms.index[k]);
          const Vec2 pixel(point.u_px - px * double{s.edges[i].normal_x},
                           point.v_px - px * double{s.edges[i].normal_y});
          LineResidual residual;
          REQUIRE(line_residual(camera, valid_radius(camera), line_in_camera(R, t, s.views.model[point.line]), pixel,
                                &residual));
          out(static_cast<Eigen::Index>(i)) = residual.value_px() / point.sigma_px;
        }
      }
      return out;
    };
    const Vector zero = Vector::Zero(size);
    residuals = residuals_at(zero);
    jacobian.resize(num_points, size);
    for (Eigen::Index c = 0; c < size; ++c) {
      Vector x = zero;
      const double step = c < 4 ? 1e-3 : 1e-6;
      x(c) = step;
      const Vector after = residuals_at(x);
      x(c) = -step;
      jacobian.col(c) = (after - residuals_at(x)) / (2 * step);
    }
    information = test::dense_product(jacobian.transpose(), jacobian);
    for (Eigen::Index i = 0; i < num_offsets; ++i) {
      information(poses_end + i, poses_end + i) += 1 / (sigmas(i) * sigmas(i));
    }
  }
};

Vector prior_sigmas(const Scene& s) {
  Vector out(static_cast<Eigen::Index>(s.offsets.size()));
  for (Eigen::Index i = 0; i < out.size(); ++i) out(i) = s.workspace.sigma[static_cast<std::size_t>(i)];
  return out;
}

double some_displacement(std::size_t line, bool on) {
  return 0.03 + 0.02 * static_cast<double>(line % 4) - (on ? 0.06 : 0.0);
}

ParameterPolicy all_free() {
  ParameterPolicy policy;
  policy.free[8] = true;
  return policy;
}

TEST_CASE("edge offsets: the step and the covariance are those of one dense system") {
  Scene s(4, 8, 0.02, some_displacement);
  EdgeOffsetOptions options;
  options.mean_latency_ms = options.mean_off_by_speed_px = options.mean_on_by_speed_px = 0;
  s.begin(options, all_free());
  CHECK(s.offsets.size() == kSharedOffsets + 8 * 6);
  const Dense dense(s, s.offsets, prior_sigmas(s));
  const Vector step =
      test::dense_solve(dense.information, -test::dense_product(dense.jacobian.transpose(), dense.residuals));
  const Matrix covariance = test::dense_inverse(dense.information);

  ReducedSystem system;
  REQUIRE(s.refiner.reduced_system(&system));
  Mat9 sum = test::dense_inverse(system.matrix);
  double largest = 0;
  {
    const test::AllocScope heap;
    REQUIRE(s.offsets.add_covariance(s.refiner, 1.0, &sum));
    REQUIRE(s.offsets.solve(s.refiner, &largest));
    CHECK(heap.allocations() == 0);
  }
  const double scale = step.tail(static_cast<Eigen::Index>(s.offsets.size())).cwiseAbs().maxCoeff();
  CHECK(scale > 0.01);
  for (std::size_t i = 0; i < s.offsets.size(); ++i) {
    const Eigen::Index place = step.size() - static_cast<Eigen::Index>(s.offsets.size() - i);
    CHECK(s.workspace.value[i] == doctest::Approx(step(place)).epsilon(1e-3).scale(0.01 * scale));
  }
  for (Eigen::Index i = 0; i < 9; ++i) {
    CHECK(std::sqrt(sum(i, i)) == doctest::Approx(std::sqrt(covariance(i, i))).epsilon(2e-3));
  }
}

TEST_CASE("edge offsets: put in by hand they come out, and leave the camera alone") {
  Scene s(12, 12, 0.01, some_displacement);
  s.begin();
  const double without = std::abs(s.refiner.camera().fx - 400.0);
  const double change = s.settle_offsets(8);
  CHECK(change <= 1e-4);
  CalibrationResult result;
  std::vector<LineResponse> responses(kLineErrors * s.views.model.size());
  REQUIRE(compute_covariance(s.refiner, {}, {}, s.poses.size(), responses, &result, nullptr, &s.offsets) == Status::ok);
  for (std::size_t i = 0; i < 8; ++i) {
    CHECK(std::abs(s.refiner.camera().*kIntrinsics[i] - s.views.camera.*kIntrinsics[i]) < 3 * result.sigma[i]);
  }
  CHECK(std::abs(s.refiner.camera().fx - 400.0) < 0.5 * without);
  // Points of a line that are dark on one side tell the sum of the offsets; two points stand for all.
  double squares = 0;
  for (std::size_t i = 0; i < s.edges.size(); ++i) {
    const double truth = some_displacement(s.views.points[i].line, s.edges[i].polarity > 0) * s.edges[i].dark;
    const double error = s.offsets.displacement(i) - truth;
    squares += error * error / static_cast<double>(s.edges.size());
  }
  CHECK(std::sqrt(squares) < 0.04);
}

TEST_CASE("edge offsets: a bend that all edges share is told from the lens") {
  const auto k1_error = [](double bend_sigma_px) {
    Scene s(12, 12, 0.005, [](std::size_t, bool) { return 0.0; });
    for (std::size_t i = 0; i < s.edges.size(); ++i) {
      const double along = double{s.edges[i].along};
      const double px = 0.05 * (6 * along * along - 0.5) * s.edges[i].dark;
      s.views.points[i].u_px += px * double{s.edges[i].normal_x};
      s.views.points[i].v_px += px * double{s.edges[i].normal_y};
    }
    EdgeOffsetOptions options;
    options.bend_px = bend_sigma_px;
    options.off_bend_px = options.on_bend_px = 1e-6;
    s.begin(options);
    s.settle_offsets(8);
    return std::abs(s.refiner.camera().k1 - s.views.camera.k1);
  };
  CHECK(k1_error(EdgeOffsetOptions().bend_px) < 0.3 * k1_error(1e-6));
}

TEST_CASE("edge offsets: an edge beside a line is its other flank only at the same distance in all views") {
  for (const bool same : {true, false}) {
    CAPTURE(same);
    Scene s(6, 8, 0.0, [](std::size_t, bool) { return 0.0; });
    for (std::size_t v = 0; v < s.views.views.size(); ++v) {
      const View& view = s.views.views[v];
      for (std::size_t i = view.first; i < view.first + view.count; ++i) {
        if (s.views.points[i].line != 3 || s.edges[i].along != 0) continue;
        const double width_px = same ? 3.0 : 3.0 + static_cast<double>(v);
        s.views.points[i].u_px += width_px * double{s.edges[i].normal_x};
        s.views.points[i].v_px += width_px * double{s.edges[i].normal_y};
        s.edges[i].model_side = static_cast<std::int8_t>(-s.edges[i].model_side);
      }
    }
    s.begin();
    CHECK(s.offsets.size() == kSharedOffsets + 8 * 6 + (same ? 1 : 0));
    std::vector<std::uint8_t> marks(s.edges.size(), 0);
    s.offsets.mark_strays(marks);
    for (std::size_t i = 0; i < marks.size(); ++i) {
      CHECK((marks[i] != 0) == (!same && s.views.points[i].line == 3 && s.edges[i].along == 0));
    }
  }
}

TEST_CASE("edge offsets: more views than count as independent do not narrow sigma as if they were") {
  Scene s(12, 12, 0.01, some_displacement);
  s.begin();
  const auto views = static_cast<double>(s.poses.size());
  const auto sigma_fx = [&](double independent_views) {
    CovarianceOptions options;
    options.independent_views = independent_views;
    CalibrationResult result;
    std::vector<LineResponse> responses(kLineErrors * s.views.model.size());
    REQUIRE(compute_covariance(s.refiner, {}, options, s.poses.size(), responses, &result, nullptr, &s.offsets) ==
            Status::ok);
    return result.sigma[0];
  };
  const double all = sigma_fx(views);
  CHECK(sigma_fx(2 * views) == all);
  // Four views that count as one: of the points' part twice the sigma, of what is known beforehand of offsets no more.
  const double quarter = sigma_fx(0.25 * views);
  CHECK(quarter > 1.2 * all);
  CHECK(quarter <= 2 * all);
}

TEST_CASE("edge offsets: without sigma of their own they change nothing") {
  Scene s(4, 8, 0.02, some_displacement);
  EdgeOffsetOptions options;
  options.dark_px = options.trailing_px = options.line_px = options.faint_line_px = 1e-9;
  options.off_tilt_px = options.on_tilt_px = options.off_bend_px = options.on_bend_px = 1e-9;
  options.latency_ms = options.bend_px = options.off_by_speed_px = options.on_by_speed_px = 1e-9;
  s.begin(options);
  Mat9 sum = Mat9::Zero();
  REQUIRE(s.offsets.add_covariance(s.refiner, 1.0, &sum));
  CHECK(std::sqrt(sum(0, 0)) < 1e-5);
}

TEST_CASE(
    "edge offsets: what lies beside a line in few views is no flank, and goes with what is dark on the rarer side") {
  Scene s(6, 8, 0.0, [](std::size_t, bool) { return 0.0; });
  std::vector<bool> is_stray(s.edges.size(), false);
  const View& first = s.views.views.front();
  for (std::size_t i = first.first; i < first.first + first.count; ++i) {
    const std::uint16_t line = s.views.points[i].line;
    if (line != 2 && line != 3) continue;
    if (line == 2) s.edges[i].other_flank = true;  // dark on the same side as the line's own
    if (line == 3) s.edges[i].model_side = static_cast<std::int8_t>(-s.edges[i].model_side);
    is_stray[i] = true;
  }
  s.begin();
  CHECK(s.offsets.size() == kSharedOffsets + 8 * 6);
  std::vector<std::uint8_t> marks(s.edges.size(), 0);
  s.offsets.mark_strays(marks);
  for (std::size_t i = 0; i < marks.size(); ++i) CHECK((marks[i] != 0) == is_stray[i]);
}

TEST_CASE("edge offsets: how much lines tilt in a recording is estimated from them") {
  const auto tilt_sigma_px = [](double tilt_px) {
    Scene s(12, 12, 0.005, [](std::size_t, bool) { return 0.0; });
    for (std::size_t i = 0; i < s.edges.size(); ++i) {
      const double sign = s.views.points[i].line % 2 == 0 ? 1 : -1;
      const double px = sign * tilt_px * double{s.edges[i].along} * s.edges[i].dark;
      s.views.points[i].u_px += px * double{s.edges[i].normal_x};
      s.views.points[i].v_px += px * double{s.edges[i].normal_y};
    }
    s.begin();
    s.settle_offsets(6);
    constexpr std::size_t kTiltWhenOff = 2;
    return s.workspace.sigma[s.workspace.slot[kTiltWhenOff]];
  };
  const double beforehand = EdgeOffsetOptions().off_tilt_px;
  CHECK(tilt_sigma_px(0.0) < 0.7 * beforehand);
  const double large = tilt_sigma_px(0.4);
  CHECK(large > 1.5 * beforehand);
  CHECK(large < 1.25 * 0.4);
}

TEST_CASE("edge offsets: a line that another edge fires for is marked, and the rest begins anew") {
  Scene s(10, 10, 0.01, [](std::size_t line, bool) { return line == 4 ? 1.5 : 0.0; });
  s.begin();
  const std::vector<double> beforehand(s.workspace.value.begin(), s.workspace.value.begin() + s.offsets.size());
  std::vector<std::uint8_t> marks(s.edges.size(), 0);
  CHECK_FALSE(s.offsets.mark_wrong_lines(marks));
  s.settle_offsets(4);
  REQUIRE(s.offsets.mark_wrong_lines(marks));
  for (std::size_t i = 0; i < marks.size(); ++i) CHECK((marks[i] != 0) == (s.views.points[i].line == 4));
  for (std::size_t i = 0; i < s.offsets.size(); ++i) CHECK(s.workspace.value[i] == beforehand[i]);
}

TEST_CASE("edge offsets: the dark side of what moves e times as fast lies one offset of its polarity further back") {
  for (const bool on : {false, true}) {
    CAPTURE(on);
    Scene s(1, 2, 0.0, [](std::size_t, bool) { return 0.0; });
    s.edges[0].polarity = static_cast<std::int8_t>(on ? 1 : -1);
    s.edges[1] = s.edges[0];
    s.edges[1].speed_px_per_s *= 2.7182818F;
    EdgeOffsetOptions options;
    options.mean_latency_ms = 0;
    options.mean_off_by_speed_px = 0.02;
    options.mean_on_by_speed_px = 0.07;
    s.begin(options);
    s.edges[2].speed_px_per_s = 0;  // of a line that turns about this point
    const double back = s.offsets.displacement(0) - s.offsets.displacement(1);
    CHECK(back * s.edges[0].dark == doctest::Approx(on ? 0.07 : 0.02).epsilon(1e-4));
    CHECK(std::isfinite(s.offsets.displacement(2)));
  }
}

TEST_CASE("edge offsets: a point whose dark side is not known has none") {
  Scene s(4, 8, 0.0, [](std::size_t, bool) { return 0.0; });
  s.edges[7].dark = 0;
  s.begin();
  CHECK(s.offsets.terms(7).count == 0);
  CHECK(s.offsets.terms(8).count == 8);
  CHECK(s.offsets.displacement(7) == 0.0);
}

}  // namespace
}  // namespace lecalib
