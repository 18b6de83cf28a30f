// SPDX-License-Identifier: MIT
/// Refinement of two cameras that are fixed to each other: both cameras' intrinsics, all poses of the left one, and the
/// pose between the two, at once.
///
/// Each camera has been refined by itself. Where both see the object at the same instant, the right one's pose follows
/// from the left one's:
///     T_right_model = T_right_left T_left_model symmetry
/// so that 6 unknowns serve both. Their poses, and those of instants that one camera alone has seen, are eliminated
/// view by view; what remains are the offsets of both cameras' edges, both cameras and T_right_left.
#pragma once

#include <cstdint>

#include "lecalib/core/arena.hpp"
#include "lecalib/core/records.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/math/eigen.hpp"
#include "lecalib/math/packed_cholesky.hpp"
#include "lecalib/solve/edge_offsets.hpp"
#include "lecalib/solve/refine.hpp"

namespace lecalib {

/// One of the two cameras, converged by itself. Everything it points to is changed.
struct StereoCamera {
  Refiner* refiner = nullptr;
  EdgeOffsets* offsets = nullptr;  ///< of its points' edges; null: lines have errors that are not estimated
  Span<LinePoint> corrected;       ///< the refiner's points: where they are without the offsets
  Span<LineResponse> responses;    ///< kLineErrors per model line; used where there are no EdgeOffsets
};

/// Two views of one instant.
struct StereoPair {
  std::uint32_t left = 0, right = 0;  ///< their indices
  /// What the right camera's labels call x is symmetry x by the left one's: the identity, unless the model has
  /// symmetries.
  Pose symmetry;
};

struct StereoRefineOptions {
  int max_iterations = 50;           ///< steps tried, > 0
  double decrease_tolerance = 1e-6;  ///< as RefineOptions::decrease_tolerance
  /// Of views that count as independent, as CovarianceOptions::independent_views. 0: all of them are
  double independent_views = 36;
  LineErrorSizes line_errors;       ///< as CovarianceOptions::line_errors, where lines have no EdgeOffsets
  double max_tie_chi2_per_dof = 0;  ///< of StereoSolution::tie_chi2_per_dof; 0: no bound
};

/// What both cameras and the pose between them are, and how sure.
struct StereoSolution {
  static constexpr std::size_t kParameters = 2 * kNumIntrinsics + 6;
  Pose T_right_left;
  /// Of the left camera's intrinsics, the right one's, and the increment (w, v) of x_right' = exp(w) x_right + v, with
  /// scale; 0 for what was held. Row-major.
  double covariance[kParameters * kParameters] = {};
  double scale = 1;         ///< of variances, counted in
  double chi2_per_dof = 0;  ///< of both cameras' points
  /// What it adds to the cost of each camera by itself that instants have one pose for both, per unknown that this
  /// saves: 1 where the points' sigmas are true, less where these hold a systematic part. More means two clocks, or
  /// cameras that are not fixed to each other.
  double tie_chi2_per_dof = 0;
};

struct StereoRefinerCapacities {
  std::size_t views = 128;  ///< of one camera
  std::size_t model_lines = 64;
  bool edges = true;  ///< both cameras may have EdgeOffsets
};

/// n = offsets of both cameras + StereoSolution::kParameters.
struct StereoRefinerWorkspace {
  Span<double> matrix;             ///< [n (n + 1) / 2] normal equations, lower triangle by rows
  Span<double> tail;               ///< as matrix, of all but the offsets
  Span<double> gradient;           ///< [n]
  Span<double> step;               ///< [n]
  Span<double> columns;            ///< [n x 6] of one group of views: what ties their pose to each parameter
  Span<std::uint16_t> active;      ///< [n] the parameters that have such columns
  Span<double> kept_offsets;       ///< [offsets of both cameras] before the last step
  Span<std::uint32_t> partner[2];  ///< [views] of each camera's: the pair that it belongs to, or kNoView
};

constexpr std::size_t offsets_of_camera(const StereoRefinerCapacities& c) {
  return c.edges ? kSharedOffsets + kOffsetsPerLine * c.model_lines : kLineErrors * c.model_lines;
}

template <class Carver>
constexpr bool carve(Carver& carver, const StereoRefinerCapacities& c, StereoRefinerWorkspace* out) {
  const std::size_t offsets = 2 * offsets_of_camera(c);
  const std::size_t n = offsets + StereoSolution::kParameters;
  return carver.carve(n * (n + 1) / 2, &out->matrix) &&
         carver.carve(triangle_index(StereoSolution::kParameters, 0), &out->tail) && carver.carve(n, &out->gradient) &&
         carver.carve(n, &out->step) && carver.carve(6 * n, &out->columns) && carver.carve(n, &out->active) &&
         carver.carve(offsets, &out->kept_offsets) && carver.carve(c.views, &out->partner[0]) &&
         carver.carve(c.views, &out->partner[1]);
}

/// Usage: init(), then step() until it no longer returns in_progress, then solution().
class StereoRefiner {
 public:
  /// @param pairs outlive the refiner; a view is in one pair at most
  /// @return ok | too_few_lines (no pair of which both views are used) | invalid_argument (an index out of range or
  /// named twice, a known turn between views, offsets of one camera only) | capacity_exceeded (workspace) |
  /// numerical_failure (no finite cost)
  Status init(const StereoCamera& left, const StereoCamera& right, Span<const StereoPair> pairs,
              const Pose& T_right_left, const StereoRefineOptions& options, const StereoRefinerWorkspace& workspace);

  /// One iteration. @return in_progress | ok | not_converged | degenerate_geometry (the equations are singular) |
  /// numerical_failure | implausible_result (above max_tie_chi2_per_dof)
  Status step();

  /// Valid once step() returned ok; the cameras, their poses and offsets are those of the refiners.
  [[nodiscard]] const StereoSolution& solution() const { return solution_; }

 private:
  static constexpr std::size_t kSides = 2;

  [[nodiscard]] bool is_estimated() const { return cameras_[0].offsets != nullptr; }
  [[nodiscard]] std::size_t first_offset(std::size_t side) const { return side == 0 ? 0 : num_offsets_[0]; }
  [[nodiscard]] std::size_t first_intrinsic(std::size_t side) const {
    return num_offsets_[0] + num_offsets_[1] + kNumIntrinsics * side;
  }
  [[nodiscard]] std::size_t first_between() const { return first_intrinsic(kSides); }
  [[nodiscard]] std::size_t size() const { return first_between() + 6; }
  [[nodiscard]] bool has_room() const;
  Status tie_views();
  [[nodiscard]] const StereoPair* pair_of(std::size_t side, std::size_t view) const;
  [[nodiscard]] Mat6 right_by_left() const;

  void place_right_views();
  bool linearise();
  [[nodiscard]] double offset_cost() const;
  void clear_rows();
  const double* pose_row(std::size_t side, std::size_t offset) const;
  void fill_rows(std::size_t side, std::size_t view);
  std::size_t add_columns(std::size_t side, std::size_t view, const Mat6& by_pose, std::size_t active);
  bool gather(std::size_t side, std::size_t view, double damping, Mat6* block, Vec6* gradient, std::size_t* active);
  void add_between(std::size_t view);
  double eliminate(const Mat6& block, const Vec6& gradient, std::size_t active);
  void build_shared(double damping);
  bool build(double damping, double* pose_decrease);
  void add_intrinsics(std::size_t side);
  void add_offsets(std::size_t side);
  void hold(std::size_t parameter);
  bool factor_equations();
  void solve_for_step();
  bool move_views(double damping);
  void move_shared();
  void keep_state();
  void restore_state();
  Status finish();
  bool compute_covariance();

  StereoCamera cameras_[kSides];
  Span<const StereoPair> pairs_;
  StereoRefineOptions options_;
  StereoRefinerWorkspace workspace_;
  StereoSolution solution_;
  std::size_t num_offsets_[kSides] = {};
  Camera kept_cameras_[kSides];
  Pose kept_between_;
  double cost_ = 0;
  double cost_alone_ = 0;  ///< of both cameras, each by itself
  std::size_t tied_ = 0;   ///< pairs
  double damping_ = 0;
  int iterations_ = 0;
};

}  // namespace lecalib
