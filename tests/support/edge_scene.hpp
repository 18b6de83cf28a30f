// SPDX-License-Identifier: MIT
#pragma once

#include <doctest/doctest.h>

#include <memory>
#include <vector>

#include "lecalib/solve/edge_offsets.hpp"
#include "support/guarded_arena.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib::test {

/// Views whose points are edges, displaced by offsets that are known.
struct EdgeScene {
  SyntheticViews views;
  std::vector<EdgePoint> edges;
  std::vector<LinePoint> corrected;
  std::unique_ptr<GuardedArena> memory;
  EdgeOffsetWorkspace workspace;
  EdgeOffsets offsets;
  std::vector<RefineView> poses;
  std::vector<float> residuals;
  Refiner refiner;

  /// @param displacement of line and polarity towards the dark, px
  template <class Displacement>
  EdgeScene(int num_views, int num_lines, double noise_px, Displacement displacement) {
    Rng rng(20);
    views.camera = make_camera(400.0, 402.0, 322.0, 236.0, -0.15, 0.05);
    views.model = random_lines(rng, num_lines, 1.2, 0.9, 0.6);
    std::vector<Pose> seen_from;
    for (int v = 0; v < num_views; ++v) seen_from.push_back(looking_pose(rng, 3.0, 0.5));
    fill(seen_from, noise_px, 5, displacement);
  }
  /// The same with a camera, a model and poses of the caller's.
  template <class Displacement>
  EdgeScene(const Camera& camera, const std::vector<ModelLine>& model, const std::vector<Pose>& seen_from,
            double noise_px, std::uint64_t noise_seed, Displacement displacement) {
    views.camera = camera;
    views.model = model;
    fill(seen_from, noise_px, noise_seed, displacement);
  }

  template <class Displacement>
  void fill(const std::vector<Pose>& seen_from, double noise_px, std::uint64_t noise_seed, Displacement displacement) {
    Rng noise(noise_seed);
    for (std::size_t v = 0; v < seen_from.size(); ++v) {
      views.add_view(seen_from[v], 3, 0.0, 0.05, noise);
      const View& view = views.views.back();
      for (std::uint32_t i = view.first; i < view.first + view.count; ++i) {
        const std::uint32_t on_line = (i - view.first) / 3 * 3 + view.first;
        const Vec2 along(views.points[on_line + 2].u_px - views.points[on_line].u_px,
                         views.points[on_line + 2].v_px - views.points[on_line].v_px);
        const Vec2 normal = Vec2(-along(1), along(0)).normalized();
        EdgePoint edge{};
        edge.normal_x = static_cast<float>(normal(0));
        edge.normal_y = static_cast<float>(normal(1));
        edge.speed_px_per_s = ((v + views.points[i].line) % 2 == 0 ? 400.0F : -300.0F);
        edge.along = 0.5F * static_cast<float>(i - on_line) - 0.5F;
        edge.events = 3;
        edge.dark = views.points[i].line % 3 == 0 ? 1 : -1;
        edge.model_side = edge.dark;
        edge.polarity = (edge.dark > 0) == (edge.speed_px_per_s > 0) ? 1 : -1;
        edges.push_back(edge);
      }
    }
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const double px =
          displacement(views.points[i].line, edges[i].polarity > 0) * edges[i].dark + noise_px * gaussian(noise);
      views.points[i].u_px += px * double{edges[i].normal_x};
      views.points[i].v_px += px * double{edges[i].normal_y};
    }
  }

  [[nodiscard]] CalibrationData data() const {
    CalibrationData out = views.data();
    out.edges = edges;
    return out;
  }

  void begin(const EdgeOffsetOptions& options = {}, const ParameterPolicy& policy = {}) {
    const EdgeOffsetCapacities capacities{views.model.size()};
    ArenaMeter meter;
    (void)carve(meter, capacities, &workspace);
    memory = std::make_unique<GuardedArena>(meter.peak());
    REQUIRE(carve(memory->arena(), capacities, &workspace));
    offsets.init(data(), options, workspace);
    corrected.resize(views.points.size());
    offsets.correct(corrected);
    for (const Pose& pose : views.poses) {
      RefineView view{};
      view.pose = pose;
      view.used = true;
      poses.push_back(view);
    }
    residuals.resize(views.points.size());
    CalibrationData seen = data();
    seen.points = corrected;
    RefineOptions refine;
    refine.decrease_tolerance = 1e-12;
    refiner.init(seen, policy, refine, views.camera, poses, residuals);
    settle();
  }
  void settle() {
    Status status = Status::in_progress;
    while (status == Status::in_progress) status = refiner.step();
    CHECK(status == Status::ok);
  }
  /// Moves offsets and points in turn until the offsets stand still. @return the last change of one, px
  double settle_offsets(int rounds) {
    double change = 1;
    for (int round = 0; round < rounds && change > 1e-4; ++round) {
      REQUIRE(offsets.solve(refiner, &change));
      offsets.correct(corrected);
      refiner.points_changed();
      settle();
    }
    return change;
  }
};

}  // namespace lecalib::test
