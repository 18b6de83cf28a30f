// SPDX-License-Identifier: MIT
/// From measured points on model lines to a calibrated camera: initial guess, refinement, covariance, verdict.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "lecalib/core/arena.hpp"
#include "lecalib/core/records.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/solve/calibration_data.hpp"
#include "lecalib/solve/calibration_result.hpp"
#include "lecalib/solve/covariance.hpp"
#include "lecalib/solve/edge_offsets.hpp"
#include "lecalib/solve/initial_guess.hpp"
#include "lecalib/solve/line_ransac.hpp"
#include "lecalib/solve/parameter_policy.hpp"
#include "lecalib/solve/plausibility.hpp"
#include "lecalib/solve/refine.hpp"
#include "lecalib/solve/stereo_refiner.hpp"

namespace lecalib {

struct MonoSolverOptions {
  InitialGuessOptions guess;
  PolicyOptions policy;
  RefineOptions refine;  ///< its loss is not used: the refinement starts with squares and ends with `loss` below
  Loss loss = Loss::huber;
  /// > 0; in robust sigmas of the residuals, and not below the given ones if these are trusted.
  double loss_width = 3.0;
  /// > 0; starts from which the refinement is tried until one ends well. Where none does and lines are few, the first
  /// one is tried once more with focal lengths and poses alone before the other intrinsics are freed.
  int max_attempts = 3;
  /// Where the residuals of the solution to all lines show that some are wrong (and no start was given): find the right
  /// ones by samples, solve with these, and sort anew by the residuals. false: trust all lines.
  bool reject_lines = true;
  LineRansacOptions ransac;
  CovarianceOptions covariance;
  EdgeOffsetOptions offsets;  ///< of points that come with CalibrationData::edges
  PlausibilityOptions plausibility;
};

/// Rounds of sorting lines and solving anew, at most; two or three settle it.
inline constexpr int kMaxSortings = 16;

struct MonoSolverCapacities {
  std::size_t views = 64;
  std::size_t points = 8192;
  std::size_t model_lines = 64;
  std::size_t edge_points = 0;  ///< of these points, those that may come with CalibrationData::edges
};

struct MonoSolverWorkspace {
  InitialGuessWorkspace guess;
  Span<float> residuals;              ///< one per point, in sigmas
  Span<float> sorted_residuals;       ///< one per point, scratch
  Span<float> feet;                   ///< one per point, scratch
  Span<ViewResult> results;           ///< one per view
  Span<ViewLineResult> line_results;  ///< see max_line_results()
  Span<std::uint8_t> left_out;        ///< one per point
  Span<ViewLine> chosen;              ///< one per model line, scratch
  Span<LineResponse> responses;       ///< kLineErrors per model line
  Span<LinePoint> corrected;          ///< one per edge point: where it is without its offsets
  Span<std::uint8_t> wrong_edges;     ///< one per edge point
  EdgeOffsetWorkspace offsets;
};

/// Pairs of a view and a model line that is seen in it, at most.
constexpr std::size_t max_line_results(const MonoSolverCapacities& c) {
  return std::min(c.views * c.model_lines, c.points);
}

template <class Carver>
constexpr bool carve(Carver& carver, const MonoSolverCapacities& capacities, MonoSolverWorkspace* out) {
  return carver.carve(capacities.model_lines, &out->guess.sums) &&
         carver.carve(capacities.model_lines, &out->guess.lines) &&
         carver.carve(capacities.views, &out->guess.linear) &&
         carver.carve(capacities.views, &out->guess.focal_lengths) &&
         carver.carve(capacities.views, &out->guess.views) && carver.carve(capacities.points, &out->residuals) &&
         carver.carve(capacities.points, &out->sorted_residuals) && carver.carve(capacities.points, &out->feet) &&
         carver.carve(capacities.views, &out->results) &&
         carver.carve(max_line_results(capacities), &out->line_results) &&
         carver.carve(capacities.points, &out->left_out) && carver.carve(capacities.model_lines, &out->chosen) &&
         carver.carve(kLineErrors * capacities.model_lines, &out->responses) &&
         carver.carve(capacities.edge_points, &out->corrected) &&
         carver.carve(capacities.edge_points, &out->wrong_edges) &&
         (capacities.edge_points == 0 || carve(carver, EdgeOffsetCapacities{capacities.model_lines}, &out->offsets));
}

constexpr std::size_t required_bytes(const MonoSolverCapacities& capacities) {
  ArenaMeter meter;
  MonoSolverWorkspace workspace;
  carve(meter, capacities, &workspace);
  return meter.peak();
}

/// A start that somebody else has found, e.g. the correspondence search.
struct MonoStart {
  Camera camera;
  Span<const Pose> T_cam_world;  ///< one per view; copied
};

/// State machine: init(), then step() until it no longer returns in_progress, then result().
class MonoSolver {
 public:
  /// @param data  outlives the solver; its points must be grouped by view, best by line within a view
  /// @return ok | invalid_argument (edges as well: see init_on_edges()) | too_few_lines | capacity_exceeded (data
  /// larger than the workspace)
  Status init(const CalibrationData& data, const MonoSolverOptions& options, const MonoSolverWorkspace& workspace,
              const MonoStart& start);
  /// The same for points that come with CalibrationData::edges.
  Status init_on_edges(const CalibrationData& data, const MonoSolverOptions& options,
                       const MonoSolverWorkspace& workspace, const MonoStart& start);
  /// The same without a start: the solver finds its own, from a view's lines in space or in a plane.
  Status init(const CalibrationData& data, const MonoSolverOptions& options, const MonoSolverWorkspace& workspace);

  /// Bounded work: the linear solution of one view, one comparison of candidates, one iteration of the refinement, one
  /// sample of lines, or one sorting of the lines by their residuals.
  /// @return in_progress | ok (result() is usable) | wrong_state (no init) | and, final, with result().status the same:
  /// too_few_lines, degenerate_geometry, not_converged, implausible_result, undetermined, numerical_failure
  Status step();

  /// Final when step() has returned something else than in_progress; its spans live in the workspace.
  [[nodiscard]] const CalibrationResult& result() const { return result_; }

  /// Residual of each point at the end of the last refinement, in its own sigmas; of those left out as well.
  [[nodiscard]] Span<const float> residuals() const { return workspace_.residuals; }

  /// Per point, not 0: its line was found to be wrong. Empty where all lines are used. Edges are sorted in any case:
  /// some of those that fire where a line is expected are others.
  [[nodiscard]] Span<const std::uint8_t> left_out() const { return data_.left_out; }

  /// For a refinement together with another camera, once step() has returned ok.
  StereoCamera stereo_camera();
  /// Takes over what came of it. @param side 0: this was the left camera, 1: the right one
  void take_stereo(const StereoSolution& solution, std::size_t side);

 private:
  /// Lines that a view with a given pose needs to add anything to six pose parameters.
  static constexpr std::size_t kMinPosedLines = 3;
  /// Fewer degrees of freedom than this say nothing about the scale of the residuals.
  static constexpr double kMinScaleDof = 10.0;
  /// Spread, in sigmas, below which residuals are rounding.
  static constexpr double kMinSpread = 1e-6;

  enum class Phase : std::uint8_t { idle, guess, refine, refine_robust, ransac, done };

  // The search for a start and what edges take are reached through pointers alone, which the init() that needs them
  // sets: a program that never calls it does not hold their code.
  Status prepare(const CalibrationData& data, const MonoSolverOptions& options, const MonoSolverWorkspace& workspace);
  Status take_start(const MonoStart& start);
  Status search(Status attempt);
  void begin_guess();
  Status step_guess();
  void begin_refinement(const Camera& camera, ViewGeometry geometry);
  [[nodiscard]] ViewGeometry classify() const;
  Status step_refinement();
  Status begin_ransac();
  Status step_ransac();
  [[nodiscard]] bool has_edges() const { return sort_edges_ != nullptr; }
  void begin_edges();
  void drop_open_views();
  bool move_edges();
  bool drop_wrong_edges();
  Status sort_edges();
  [[nodiscard]] double least_spread() const;
  [[nodiscard]] bool has_few_lines() const;
  bool has_wrong_lines();
  bool sort_lines();
  void judge_view(const ReducedSystem& system, std::size_t index, double spread, Span<float> sizes);
  [[nodiscard]] double line_size(const ReducedSystem& system, std::size_t view, std::size_t line, double spread) const;
  bool sort_view(std::size_t index, Span<const float> sizes);
  double fitted_spread();
  double spread_of(Span<const float> residuals);
  Status conclude(Status status);
  Status judge(Status status, CalibrationResult* result);
  void summarise(CalibrationResult* result);
  void summarise_views(CalibrationResult* result);
  std::size_t summarise_lines(const View& view, Span<ViewLineResult> out);
  [[nodiscard]] double squared_distances(const View& view) const;
  [[nodiscard]] bool keeps_enough_lines(const CalibrationResult& result) const;

  CalibrationData data_;
  MonoSolverOptions options_;
  MonoSolverWorkspace workspace_;
  ParameterPolicy policy_;
  InitialGuess guess_;
  LineRansac ransac_;
  Refiner refiner_;
  EdgeOffsets offsets_;
  CalibrationResult result_;
  IntrinsicSpread spread_ = {};
  double best_cost_ = 0.0;
  std::size_t views_used_ = 0;
  int attempts_ = 0;
  int sortings_ = 0;
  int offset_rounds_ = 0;
  Status (MonoSolver::*search_)(Status attempt) = nullptr;
  Status (MonoSolver::*sort_edges_)() = nullptr;
  bool poses_first_ = false;       // the refinement that begins next, or has begun, is of focal lengths and poses alone
  bool poses_were_first_ = false;  // that has been tried
  Phase phase_ = Phase::idle;
};

}  // namespace lecalib
