// SPDX-License-Identifier: MIT
#include "lecalib/solve/stereo_refiner.hpp"

#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <cmath>
#include <memory>
#include <vector>

#include "support/alloc_counter.hpp"
#include "support/edge_scene.hpp"

namespace lecalib {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using test::EdgeScene;

constexpr std::size_t kShared = StereoSolution::kParameters;

double right_displacement(std::size_t line, bool on) {
  return 0.02 + 0.03 * static_cast<double>(line % 3) - (on ? 0.05 : 0.0);
}
double left_displacement(std::size_t line, bool on) {
  return 0.03 + 0.02 * static_cast<double>(line % 4) - (on ? 0.06 : 0.0);
}
double no_displacement(std::size_t /*line*/, bool /*on*/) { return 0; }

struct RigOptions {
  int pairs = 4;
  int left_alone = 1, right_alone = 1;
  double noise_px = 0.02;
  bool edges = true;  ///< offsets are there, and estimated
  std::uint64_t seed = 3;
};

/// Two cameras that see one model, some views of it at the same time. The right camera's labels are those of a model
/// that is turned and shifted.
struct Rig {
  RigOptions options;
  Pose T_right_left = make_pose(so3_exp(Vec3(0.03, -0.1, 0.05)), Vec3(-0.3, 0.02, 0.04));
  Pose symmetry = make_pose(so3_exp(Vec3(0.4, 0.2, -0.3)), Vec3(0.05, -0.04, 0.02));
  std::unique_ptr<EdgeScene> side[2];
  std::vector<LineResponse> responses[2];
  std::vector<StereoPair> pairs;
  std::unique_ptr<test::GuardedArena> memory;
  StereoRefinerWorkspace workspace;
  StereoRefiner refiner;

  explicit Rig(const RigOptions& o) : options(o) {
    Rng rng(o.seed);
    const std::vector<ModelLine> model = test::random_lines(rng, 8, 1.0, 0.7, 0.6);
    std::vector<ModelLine> relabelled;
    for (const ModelLine& line : model) {
      const Pose back = inverse_of(symmetry);
      relabelled.push_back(test::make_line(at(back, line.p), at(back, line.q)));
    }
    std::vector<Pose> left;
    std::vector<Pose> right;
    for (int v = 0; v < o.pairs + o.left_alone; ++v) left.push_back(test::looking_pose(rng, 3.5, 0.5));
    for (int v = 0; v < o.pairs; ++v) {
      right.push_back(product(T_right_left, product(left[static_cast<std::size_t>(v)], symmetry)));
      pairs.push_back({static_cast<std::uint32_t>(v), static_cast<std::uint32_t>(v), symmetry});
    }
    for (int v = 0; v < o.right_alone; ++v) {
      right.push_back(product(T_right_left, product(test::looking_pose(rng, 3.5, 0.5), symmetry)));
    }
    const Camera cameras[2] = {test::make_camera(400.0, 402.0, 322.0, 236.0, -0.15, 0.05),
                               test::make_camera(430.0, 428.0, 312.0, 245.0, -0.05, 0.02)};
    side[0] = std::make_unique<EdgeScene>(cameras[0], model, left, o.noise_px, o.seed + 100,
                                          o.edges ? left_displacement : no_displacement);
    side[1] = std::make_unique<EdgeScene>(cameras[1], relabelled, right, o.noise_px, o.seed + 200,
                                          o.edges ? right_displacement : no_displacement);
    for (std::size_t s = 0; s < 2; ++s) {
      EdgeOffsetOptions offsets;
      offsets.mean_latency_ms = offsets.mean_off_by_speed_px = offsets.mean_on_by_speed_px = 0;
      side[s]->begin(offsets);
      if (o.edges) CHECK(side[s]->settle_offsets(20) <= 1e-3);
      responses[s].resize(model.size());
    }
    StereoRefinerCapacities capacities;
    capacities.views = 16;
    capacities.model_lines = model.size();
    capacities.edges = o.edges;
    ArenaMeter meter;
    (void)carve(meter, capacities, &workspace);
    memory = std::make_unique<test::GuardedArena>(meter.peak());
    REQUIRE(carve(memory->arena(), capacities, &workspace));
  }

  static Vec3 at(const Pose& pose, const double* p) {
    return rotation_of(pose) * Eigen::Map<const Vec3>(p) + translation_of(pose);
  }

  StereoCamera camera(std::size_t s) {
    StereoCamera out;
    out.refiner = &side[s]->refiner;
    out.responses = responses[s];
    if (!options.edges) return out;
    out.offsets = &side[s]->offsets;
    out.corrected = side[s]->corrected;
    return out;
  }

  Status run(const Pose& start, const StereoRefineOptions& refine) {
    Status status = refiner.init(camera(0), camera(1), pairs, start, refine, workspace);
    if (status != Status::ok) return status;
    const test::AllocScope heap;
    do {
      status = refiner.step();
    } while (status == Status::in_progress);
    const std::size_t allocations = heap.allocations();
    CHECK(allocations == 0);
    return status;
  }

  /// Of T_right_left, by which the estimate is off: (w, v) of x' = exp(w) x_true + v.
  [[nodiscard]] Vec6 error() const {
    const Pose& found = refiner.solution().T_right_left;
    const Mat3 turn = rotation_of(found) * rotation_of(T_right_left).transpose();
    Vec6 out;
    out << so3_log(turn), translation_of(found) - turn * translation_of(T_right_left);
    return out;
  }
};

Pose nudged(const Pose& pose, double by) {
  return make_pose(so3_exp(Vec3(by, -by, by)) * rotation_of(pose), translation_of(pose) + Vec3(by, by, -by));
}

StereoRefineOptions to_the_end() {
  StereoRefineOptions refine;
  refine.decrease_tolerance = 1e-13;
  return refine;
}

/// All unknowns at once: 9 intrinsics of either camera, 6 of T_right_left, the poses, and the offsets of either camera.
struct DenseRig {
  Matrix jacobian;
  Vector residuals;
  Matrix information;  ///< with the offsets' priors
  Eigen::Index first_offset;

  explicit DenseRig(const Rig& rig) {
    const std::size_t left_views = rig.side[0]->poses.size();
    const std::size_t groups = left_views + rig.side[1]->poses.size() - rig.pairs.size();
    first_offset = static_cast<Eigen::Index>(kShared + 6 * groups);
    const std::size_t offsets[2] = {rig.side[0]->offsets.size(), rig.side[1]->offsets.size()};
    const std::size_t num_offsets = rig.options.edges ? offsets[0] + offsets[1] : 0;
    const Eigen::Index size = first_offset + static_cast<Eigen::Index>(num_offsets);
    const auto residuals_at = [&](const Vector& x) {
      Vector out(static_cast<Eigen::Index>(rig.side[0]->corrected.size() + rig.side[1]->corrected.size()));
      Eigen::Index row = 0;
      for (std::size_t s = 0; s < 2; ++s) add_side(rig, s, x, left_views, first_offset_of(rig, s), &row, &out);
      return out;
    };
    const Vector zero = Vector::Zero(size);
    residuals = residuals_at(zero);
    jacobian.resize(residuals.size(), size);
    for (Eigen::Index c = 0; c < size; ++c) {
      Vector x = zero;
      const double step = c < 18 && c % 9 < 4 ? 1e-3 : 1e-6;
      x(c) = step;
      const Vector after = residuals_at(x);
      x(c) = -step;
      jacobian.col(c) = (after - residuals_at(x)) / (2 * step);
    }
    information = jacobian.transpose() * jacobian;
    for (std::size_t s = 0; rig.options.edges && s < 2; ++s) {
      for (std::size_t i = 0; i < offsets[s]; ++i) {
        const Eigen::Index k = first_offset_of(rig, s) + static_cast<Eigen::Index>(i);
        information(k, k) += 1 / (rig.side[s]->workspace.sigma[i] * rig.side[s]->workspace.sigma[i]);
      }
    }
    for (const Eigen::Index held : {8, 17}) information(held, held) = 1;  // k3: no information otherwise
  }

  [[nodiscard]] Eigen::Index first_offset_of(const Rig& rig, std::size_t s) const {
    return first_offset + (s == 0 ? 0 : static_cast<Eigen::Index>(rig.side[0]->offsets.size()));
  }

  void add_side(const Rig& rig, std::size_t s, const Vector& x, std::size_t left_views, Eigen::Index offset,
                Eigen::Index* row, Vector* out) const {
    const EdgeScene& scene = *rig.side[s];
    Camera camera = scene.refiner.camera();
    for (std::size_t i = 0; i + 1 < kNumIntrinsics; ++i) {
      camera.*kIntrinsics[i] += x(static_cast<Eigen::Index>(kNumIntrinsics * s + i));
    }
    const auto moved = [&x](const Pose& pose, std::size_t at) {
      const Vector d = x.segment(static_cast<Eigen::Index>(at), 6);
      const Mat3 turn = so3_exp(Vec3(d.head(3)));
      return make_pose(turn * rotation_of(pose), turn * translation_of(pose) + Vec3(d.tail(3)));
    };
    const Pose between = moved(rig.refiner.solution().T_right_left, 2 * kNumIntrinsics);
    for (std::size_t v = 0; v < scene.poses.size(); ++v) {
      const bool paired = v < rig.pairs.size();
      Pose pose;
      if (s == 0) {
        pose = moved(scene.poses[v].pose, kShared + 6 * v);
      } else if (paired) {
        pose = product(between, product(moved(rig.side[0]->poses[v].pose, kShared + 6 * v), rig.symmetry));
      } else {
        pose = moved(scene.poses[v].pose, kShared + 6 * (left_views + v - rig.pairs.size()));
      }
      const View& view = scene.views.views[v];
      for (std::size_t i = view.first; i < view.first + view.count; ++i) {
        const LinePoint& point = scene.corrected[i];
        double px = 0;
        if (rig.options.edges) {
          const OffsetTerms terms = scene.offsets.terms(i);
          for (std::size_t k = 0; k < terms.count; ++k) px += terms.factor[k] * x(offset + terms.index[k]);
        }
        LineResidual residual;
        REQUIRE(line_residual(
            camera, valid_radius(camera),
            line_in_camera(rotation_of(pose), translation_of(pose), scene.views.model[point.line]),
            Vec2(point.u_px - px * double{scene.edges[i].normal_x}, point.v_px - px * double{scene.edges[i].normal_y}),
            &residual));
        (*out)((*row)++) = residual.value_px() / point.sigma_px;
      }
    }
  }
};

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
    const Matrix covariance = dense.information.inverse();
    Vector gradient = dense.jacobian.transpose() * dense.residuals;
    for (std::size_t s = 0; edges && s < 2; ++s) {
      const EdgeOffsetWorkspace& offsets = rig.side[s]->workspace;
      for (std::size_t i = 0; i < rig.side[s]->offsets.size(); ++i) {
        gradient(dense.first_offset_of(rig, s) + static_cast<Eigen::Index>(i)) +=
            offsets.value[i] / (offsets.sigma[i] * offsets.sigma[i]);
      }
    }
    const Vector left_over = covariance * gradient;  // the step that remains
    for (Eigen::Index i = 0; i < left_over.size(); ++i) {
      CHECK(std::abs(left_over(i)) <= 1e-3 * std::sqrt(covariance(i, i)));
    }
    CHECK(difference(rig.refiner.solution(), covariance) <= 1e-4);
  }
}

TEST_CASE("stereo refiner: offsets of lines that are not estimated widen the covariance") {
  RigOptions options;
  options.edges = false;
  Rig rig(options);
  StereoRefineOptions refine = to_the_end();
  refine.line_offset_px = 0.3;
  REQUIRE(rig.run(rig.T_right_left, refine) == Status::ok);
  const DenseRig dense(rig);
  Matrix covariance = rig.refiner.solution().scale * dense.information.inverse();
  Eigen::Index row = 0;
  for (std::size_t s = 0; s < 2; ++s) {
    const std::vector<LinePoint>& points = rig.side[s]->corrected;
    for (std::size_t line = 0; line < rig.side[s]->views.model.size(); ++line) {
      Vector pull = Vector::Zero(dense.residuals.size());
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (points[i].line == line) pull(row + static_cast<Eigen::Index>(i)) = 1 / points[i].sigma_px;
      }
      const Vector shift = 0.3 * (dense.information.inverse() * (dense.jacobian.transpose() * pull));
      covariance += shift * shift.transpose();
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
    const std::size_t offsets = edges ? rig.side[0]->offsets.size() + rig.side[1]->offsets.size() : 2 * 8;
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
