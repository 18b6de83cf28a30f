// SPDX-License-Identifier: MIT
/// Refinement of the intrinsics and of all poses at once by Levenberg-Marquardt ([Liu24] eq. 13, with the residual in
/// distorted pixels).
#pragma once

#include <cstdint>
#include <limits>

#include "lecalib/core/records.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/math/eigen.hpp"
#include "lecalib/math/line_projection.hpp"
#include "lecalib/math/robust_loss.hpp"
#include "lecalib/solve/calibration_data.hpp"
#include "lecalib/solve/parameter_policy.hpp"
#include "lecalib/solve/pose_group.hpp"

namespace lecalib {

/// Why a refinement stopped. Values are stable.
enum class StopReason : std::uint8_t {
  none = 0,            ///< not stopped yet
  small_decrease = 1,  ///< cost - predicted cost <= decrease_tolerance * cost of the next step, which is not made
  small_step = 2,      ///< every parameter's step <= step_tolerance times its own scale
  no_descent = 3,      ///< damping reached its limit: the cost cannot be lowered further in floating point
  iteration_limit = 4,
  numerical_failure = 5,
  settled = 6,  ///< at the iteration limit, but nearer to the minimum than a tenth of a sigma
};
const char* to_string(StopReason reason) noexcept;

struct RefineOptions {
  Loss loss = Loss::squared;
  double loss_width = 3.0;           ///< sigmas; where the loss leaves the square
  int max_iterations = 100;          ///< steps tried, accepted or not; > 0
  double decrease_tolerance = 1e-6;  ///< relative; of 50 points' cost this is some 0.007 sigma, in the step left out
  double step_tolerance = 1e-11;     ///< relative
};

/// One view in the making. Its pose block of the normal equations is eliminated on the spot, by itself or together with
/// one other view's, so time and memory are linear in the number of views.
struct RefineView {
  Pose pose;
  Pose previous;            ///< the other end of the last step: where a rejected one returns to
  double pose_block[36];    ///< J_pose' W J_pose, 6 x 6, lower triangle valid
  double cross_block[54];   ///< J_pose' W J_intrinsics, 6 x 9, column-major
  double pose_gradient[6];  ///< -J_pose' W r
  bool used;                ///< false: the view has no start or too few lines, and is left out
  std::uint32_t partner;    ///< the view that a known turn ties this one to, or kNoView; set by the Refiner
  std::uint32_t turn;       ///< that turn's index, where there is a partner
};
inline constexpr std::uint32_t kNoView = 0xFFFFFFFFU;

inline Mat6 pose_block_of(const RefineView& view) { return Eigen::Map<const Mat6>(view.pose_block); }
inline Mat69 cross_block_of(const RefineView& view) { return Eigen::Map<const Mat69>(view.cross_block); }

/// A pivot below this share of its diagonal: the six pose parameters are not independent (all lines parallel, or all
/// through one point).
inline constexpr double kMinPosePivot = 1e-11;

/// The intrinsics' own normal equations with the poses eliminated.
struct ReducedSystem {
  Mat9 matrix;  ///< Schur complement, priors included; identity rows where a parameter is held
  Vec9 gradient;
};

/// What all points of a model line can be off in all views alike, towards the same side of it: by an offset, a tilt
/// (from end to end) and a bend (see bend_at()).
inline constexpr std::size_t kLineErrors = 3;

/// One sigma of each, px. 0: there is none.
struct LineErrorSizes {
  double offset_px = 0, tilt_px = 0, bend_px = 0;
  [[nodiscard]] bool any() const { return offset_px > 0 || tilt_px > 0 || bend_px > 0; }
  /// @param response its index among kLineErrors for each model line
  [[nodiscard]] double of(std::size_t response) const {
    const double sizes[kLineErrors] = {offset_px, tilt_px, bend_px};
    return sizes[response % kLineErrors];
  }
};

/// How a bend of 1 px goes along a line, from -1/2 to 1/2: 1 at its ends, 0 on average.
constexpr double bend_at(double along) { return 6 * along * along - 0.5; }

/// What one error of one model line does, per px of it. Those of a line follow each other.
struct LineResponse {
  double gradient[kNumIntrinsics];  ///< to the reduced gradient
  double shift[kNumIntrinsics];     ///< to the intrinsics
  double pose[6];                   ///< to one view's pose at fixed intrinsics; scratch
};

class EdgeOffsets;  // see edge_offsets.hpp
struct EdgeOffsetWorkspace;
struct OffsetTerms;

/// Least squares over data and priors. Usage: init(), then step() until it no longer returns in_progress.
class Refiner {
 public:
  /// Starts from `camera` and from the poses in `views`, one RefineView per view of `data` with `used` set.
  /// @param residuals one per point: residual in sigmas of the current state (kLostSigmas for a point without a foot)
  /// @param feet      scratch, one per point; may be empty, at the price of longer searches for each point's foot
  void init(const CalibrationData& data, const ParameterPolicy& policy, const RefineOptions& options,
            const Camera& camera, Span<RefineView> views, Span<float> residuals, Span<float> feet = {});

  /// One iteration: one linear solve and one pass over the points (two where the step is rejected).
  /// @return in_progress | ok (converged) | not_converged (iteration limit, and the minimum is not near) |
  /// numerical_failure (the start has no finite cost, or the equations stay singular)
  Status step();

  /// Makes the step that step() has found too small to be worth new equations, where it stopped for that. Residuals,
  /// cost and equations stay those of the state before, which is as near as the step is small.
  void make_last_step();
  /// Residuals, cost and equations become those of the present state and points. @return false where they are not
  /// finite
  bool renew_equations() { return linearise(); }

  /// Changes the loss and goes on from the current state; step() may be called again after it has returned ok.
  /// @param sigma_scale true over given sigma of the points, as far as known: priors are in true units, so they count
  /// sigma_scale^2 beside data weighted by the given sigmas. > 0
  void set_loss(Loss loss, double width, double sigma_scale);
  void set_decrease_tolerance(double tolerance) { options_.decrease_tolerance = tolerance; }

  /// The reduced normal equations of the current state, undamped.
  /// @return false, *out unchanged, where a view's pose is not determined
  bool reduced_system(ReducedSystem* out) const { return reduce(0.0, out); }

  /// What the priors alone contribute to the reduced matrix.
  [[nodiscard]] Mat9 prior_information() const;

  /// Fills `gradient` of the answers to the errors of every model line, at the current state.
  /// @param responses kLineErrors per model line
  void line_responses(Span<LineResponse> responses) const;

  /// Answers of the reduced gradient to what all known turns have in common (RelativePrior::shared_rad, about each
  /// axis), through one of them.
  /// @return zero where one of its views is not used
  [[nodiscard]] Eigen::Matrix<double, 9, 3> turn_response(std::size_t turn) const;

  /// How many parameters the known turns determine, and not the points.
  /// @param inverse as for pose_covariance()
  [[nodiscard]] double parameters_from_turns(const Mat9& inverse) const;

  /// Covariance of one view's pose, by the increments (w, v) of x_cam' = exp(w) x_cam + v.
  /// @param inverse   covariance of the intrinsics for true sigmas, without the lines' errors; 0 where held
  /// @param scale     true over given variance of the points
  /// @param errors    of the lines; where there are any, `responses` hold their shifts
  /// @return false, *out unchanged, where the pose is not determined
  bool pose_covariance(std::size_t view, const Mat9& inverse, double scale, const LineErrorSizes& errors,
                       Span<LineResponse> responses, Mat6* out) const;
  /// Adds what the points say of the offsets of their edges, poses eliminated, to matrix (lower triangle), gradient
  /// (downhill) and by_camera, at the current state.
  void add_offset_equations(const EdgeOffsets& offsets, const EdgeOffsetWorkspace& out) const;
  [[nodiscard]] double prior_weight() const { return prior_weight_; }  ///< see set_loss()

  // What a refinement of several cameras needs that share poses (stereo_refiner.hpp): this one's equations before any
  // pose is eliminated, and its state to be set.
  [[nodiscard]] Span<RefineView> views() const { return views_; }
  [[nodiscard]] bool is_free(std::size_t intrinsic) const { return policy_.free[intrinsic]; }
  /// Of the intrinsics, priors included, at the current state; lower triangle valid, also of held ones.
  [[nodiscard]] const Mat9& intrinsic_block() const { return intrinsic_block_; }
  [[nodiscard]] const Vec9& intrinsic_gradient() const { return intrinsic_gradient_; }
  /// Adds what one view says of its edges' offsets to matrix, gradient and by_camera, and sets by_pose to it.
  void add_view_rows(std::size_t view, const EdgeOffsets& offsets, const EdgeOffsetWorkspace& out) const;
  /// The same of the errors of each model line, see line_responses(): adds to `gradient`, held ones included, and sets
  /// `pose`.
  void add_line_rows(std::size_t view, Span<LineResponse> responses) const;
  /// To be followed by renew_equations(), as is a change of views()'s poses.
  void set_camera(const Camera& camera) { camera_ = camera; }
  /// The points have moved: the next step() begins with new residuals.
  void points_changed() { linearised_ = false; }

  /// Residuals over the spread that the fit leaves to each: r / sqrt(1 - h) with the leverage h of its point, and
  /// r / sqrt(1 + h) for points left out. A wrong point that pulls the solution to itself has a small residual only.
  /// @param out one per point; 0 for the points of views not used
  /// @return false where the equations are singular
  bool standardised_residuals(Span<float> out) const;

  /// How badly one line of a view fits all others: the squares of its residuals from the solution without it, over what
  /// those and that solution's spread explain; chi-squared of as many degrees of freedom as it has points in an image,
  /// where it is right. To first order, so that a line that is in use need not be taken out for it.
  /// @param[out] points those with a residual: in use, or all of a line left out
  /// @return 0 where the others leave the solution open
  double line_misfit(const ReducedSystem& system, std::size_t view, std::uint16_t line, std::size_t* points) const;

  [[nodiscard]] const Camera& camera() const { return camera_; }
  [[nodiscard]] double cost() const { return cost_; }            ///< sum of rho over points, priors included
  [[nodiscard]] double data_cost() const { return data_cost_; }  ///< without the priors
  [[nodiscard]] int iterations() const { return iterations_; }
  [[nodiscard]] StopReason reason() const { return reason_; }
  [[nodiscard]] std::size_t points_used() const { return points_used_; }
  [[nodiscard]] std::size_t num_turns() const { return data_.relative.size(); }
  [[nodiscard]] std::size_t points_lost() const { return points_lost_; }

 private:
  bool linearise(double most_cost = std::numeric_limits<double>::max());
  bool linearise_view(std::size_t index, double knee, double most_cost);
  void add_priors();
  [[nodiscard]] bool all_within(Loss loss, double width) const;
  [[nodiscard]] double prior_precision(std::size_t i) const;
  [[nodiscard]] double aspect_precision() const;
  template <class Visit>
  void visit_points(std::size_t view, double knee, const Visit& visit, std::uint32_t only_line = kNoView) const;
  void factors_of_errors(std::size_t view, std::size_t point, double (&factors)[kLineErrors]) const;
  bool pose_solution(std::size_t view, Mat69* eliminated, Mat6* own, Mat6* partner) const;
  [[nodiscard]] double turn_precision(std::size_t turn) const;
  bool answer_to_turn(std::size_t turn, Mat3* residual, Eigen::Matrix<double, 9, 3>* gradient) const;
  void pair_views();
  void gather(std::size_t view, PoseGroup<6>* out) const;
  void gather(std::size_t view, PoseGroup<12>* out) const;
  template <int N>
  bool eliminate(std::size_t view, double damping, ReducedSystem* system) const;
  template <int N>
  void move_poses(std::size_t view, const Vec9& delta, double* predicted, double* largest_step);
  void add_view_offsets(std::size_t index, const EdgeOffsets& offsets, const EdgeOffsetWorkspace& out) const;
  void add_point_offsets(std::size_t index, const CameraLine& line, double knee, const OffsetTerms& terms,
                         const EdgeOffsetWorkspace& out) const;
  void standardise_view(std::size_t index, const Mat9& covariance, Span<float> out) const;
  bool reduce(double damping, ReducedSystem* out) const;
  bool solve_damped(Vec9* delta) const;
  double apply(const Vec9& delta, double* largest_relative_step);
  void restore(const Camera& camera);
  Status finish_at_limit();
  Status finish(StopReason reason, Status status);

  CalibrationData data_;
  ParameterPolicy policy_;
  RefineOptions options_;
  Span<RefineView> views_;
  Span<float> residuals_;
  Span<float> feet_;
  Camera camera_;
  Camera next_camera_;  // of the step left out
  Mat9 data_block_ = Mat9::Zero();
  Vec9 data_gradient_ = Vec9::Zero();
  Mat9 intrinsic_block_ = Mat9::Zero();
  Vec9 intrinsic_gradient_ = Vec9::Zero();  // these two with the priors
  double cost_ = 0.0;
  double data_cost_ = 0.0;
  double damping_ = 0.0;
  double damping_growth_ = 2.0;
  double prior_weight_ = 1.0;
  std::size_t points_used_ = 0;
  std::size_t points_lost_ = 0;
  int free_[kNumIntrinsics] = {};  // indices of the free intrinsics
  int num_free_ = 0;
  int iterations_ = 0;
  bool linearised_ = false;
  StopReason reason_ = StopReason::none;
};

/// What a point costs, in sigmas, where its line has no image inside the valid radius. Constant, so that it pulls
/// nowhere, and high, so that no step gains by pushing lines out of the image.
inline constexpr double kLostSigmas = 1e3;

}  // namespace lecalib
