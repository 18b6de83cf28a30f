// SPDX-License-Identifier: MIT
/// Two cameras before one object, and the oracle for their joint refinement: all its normal equations at once, from
/// finite differences of all residuals.
#pragma once

#include <doctest/doctest.h>

#include <memory>
#include <vector>

#include "lecalib/solve/stereo_refiner.hpp"
#include "support/alloc_counter.hpp"
#include "support/dense_algebra.hpp"
#include "support/edge_scene.hpp"

namespace lecalib::test {

inline constexpr std::size_t kShared = StereoSolution::kParameters;

inline double right_displacement(std::size_t line, bool on) {
  return 0.02 + 0.03 * static_cast<double>(line % 3) - (on ? 0.05 : 0.0);
}
inline double left_displacement(std::size_t line, bool on) {
  return 0.03 + 0.02 * static_cast<double>(line % 4) - (on ? 0.06 : 0.0);
}
inline double no_displacement(std::size_t /*line*/, bool /*on*/) { return 0; }

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
  std::unique_ptr<GuardedArena> memory;
  StereoRefinerWorkspace workspace;
  StereoRefiner refiner;

  explicit Rig(const RigOptions& o) : options(o) {
    Rng rng(o.seed);
    const std::vector<ModelLine> model = random_lines(rng, 8, 1.0, 0.7, 0.6);
    std::vector<ModelLine> relabelled;
    for (const ModelLine& line : model) {
      const Pose back = inverse_of(symmetry);
      relabelled.push_back(make_line(at(back, line.p), at(back, line.q)));
    }
    std::vector<Pose> left;
    std::vector<Pose> right;
    for (int v = 0; v < o.pairs + o.left_alone; ++v) left.push_back(looking_pose(rng, 3.5, 0.5));
    for (int v = 0; v < o.pairs; ++v) {
      right.push_back(product(T_right_left, product(left[static_cast<std::size_t>(v)], symmetry)));
      pairs.push_back({static_cast<std::uint32_t>(v), static_cast<std::uint32_t>(v), symmetry});
    }
    for (int v = 0; v < o.right_alone; ++v) {
      right.push_back(product(T_right_left, product(looking_pose(rng, 3.5, 0.5), symmetry)));
    }
    const Camera cameras[2] = {make_camera(400.0, 402.0, 322.0, 236.0, -0.15, 0.05),
                               make_camera(430.0, 428.0, 312.0, 245.0, -0.05, 0.02)};
    side[0] = std::make_unique<EdgeScene>(cameras[0], model, left, o.noise_px, o.seed + 100,
                                          o.edges ? left_displacement : no_displacement);
    side[1] = std::make_unique<EdgeScene>(cameras[1], relabelled, right, o.noise_px, o.seed + 200,
                                          o.edges ? right_displacement : no_displacement);
    for (std::size_t s = 0; s < 2; ++s) {
      EdgeOffsetOptions offsets;
      offsets.mean_latency_ms = offsets.mean_off_by_speed_px = offsets.mean_on_by_speed_px = 0;
      side[s]->begin(offsets);
      if (o.edges) CHECK(side[s]->settle_offsets(20) <= 1e-3);
      responses[s].resize(kLineErrors * model.size());
    }
    StereoRefinerCapacities capacities;
    capacities.views = 16;
    capacities.model_lines = model.size();
    capacities.edges = o.edges;
    ArenaMeter meter;
    (void)carve(meter, capacities, &workspace);
    memory = std::make_unique<GuardedArena>(meter.peak());
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
    const AllocScope heap;
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

/// All unknowns at once: 9 intrinsics of either camera, 6 of T_right_left, the poses, and the offsets of either camera.
struct DenseRig {
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residuals;
  Eigen::MatrixXd information;  ///< with the offsets' priors
  Eigen::Index first_offset;

  explicit DenseRig(const Rig& rig) {
    const std::size_t left_views = rig.side[0]->poses.size();
    const std::size_t groups = left_views + rig.side[1]->poses.size() - rig.pairs.size();
    first_offset = static_cast<Eigen::Index>(kShared + 6 * groups);
    const std::size_t offsets[2] = {rig.side[0]->offsets.size(), rig.side[1]->offsets.size()};
    const std::size_t num_offsets = rig.options.edges ? offsets[0] + offsets[1] : 0;
    const Eigen::Index size = first_offset + static_cast<Eigen::Index>(num_offsets);
    const auto residuals_at = [&](const Eigen::VectorXd& x) {
      Eigen::VectorXd out(static_cast<Eigen::Index>(rig.side[0]->corrected.size() + rig.side[1]->corrected.size()));
      Eigen::Index row = 0;
      for (std::size_t s = 0; s < 2; ++s) add_side(rig, s, x, left_views, first_offset_of(rig, s), &row, &out);
      return out;
    };
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(size);
    residuals = residuals_at(zero);
    jacobian.resize(residuals.size(), size);
    for (Eigen::Index c = 0; c < size; ++c) {
      Eigen::VectorXd x = zero;
      const double step = c < 18 && c % 9 < 4 ? 1e-3 : 1e-6;
      x(c) = step;
      const Eigen::VectorXd after = residuals_at(x);
      x(c) = -step;
      jacobian.col(c) = (after - residuals_at(x)) / (2 * step);
    }
    information = dense_product(jacobian.transpose(), jacobian);
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

  void add_side(const Rig& rig, std::size_t s, const Eigen::VectorXd& x, std::size_t left_views, Eigen::Index offset,
                Eigen::Index* row, Eigen::VectorXd* out) const {
    const EdgeScene& scene = *rig.side[s];
    Camera camera = scene.refiner.camera();
    for (std::size_t i = 0; i + 1 < kNumIntrinsics; ++i) {
      camera.*kIntrinsics[i] += x(static_cast<Eigen::Index>(kNumIntrinsics * s + i));
    }
    const auto moved = [&x](const Pose& pose, std::size_t at) {
      const Eigen::VectorXd d = x.segment(static_cast<Eigen::Index>(at), 6);
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

}  // namespace lecalib::test
