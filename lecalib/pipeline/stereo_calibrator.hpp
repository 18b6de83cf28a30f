// SPDX-License-Identifier: MIT
/// From the events of two cameras on one clock, fixed to each other, to both cameras and the pose between them.
///
///     push: events of either camera -> that camera's window
///     step: both cameras' windows of the same time -> lines -> both banks, which keep the same windows
///           each camera by itself, as MonoCalibrator does it
///           poses of the windows that both have matched -> T_right_left -> all refined together
#pragma once

#include <cstdint>
#include <limits>

#include "lecalib/core/arena.hpp"
#include "lecalib/core/records.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/pipeline/mono_calibrator.hpp"
#include "lecalib/solve/stereo_pose.hpp"
#include "lecalib/solve/stereo_refiner.hpp"

namespace lecalib {

enum class StereoSide : std::uint8_t { left = 0, right = 1 };
inline constexpr std::size_t kStereoSides = 2;

struct StereoCapacities {
  Capacities left, right;  ///< of as many windows
};

struct StereoOptions {
  /// gyro_samples must be empty; windows_on_grid is set, and window is that of the left one for both.
  MonoOptions left, right;
  StereoPoseOptions pose;
  /// independent_views, line_errors and max_tie_chi2_per_dof (of chi2_per_dof) are those of the left camera's solver
  StereoRefineOptions refine;
};

/// What is being worked on: each camera by itself, then both together.
enum class StereoPhase : std::uint8_t { idle, collecting, left, right, between, done, failed };
/// The phase's name. Never null.
const char* to_string(StereoPhase phase) noexcept;

struct StereoResult {
  Status status = Status::in_progress;
  CalibrationResult left, right;  ///< as MonoCalibrator::result(), refined together
  Pose T_right_left;              ///< x_right = T_right_left x_left
  double covariance[36] = {};     ///< of T_right_left, as ViewResult::covariance: (w, t), R = exp(w) R_true
  double tie_chi2_per_dof = 0;    ///< see StereoSolution; 0 before both were refined together
  std::uint32_t instants = 0;     ///< seen by both cameras, in use
  /// Seen by both, but the cameras' poses did not agree: used for each by itself. All of them where that is the reason
  /// for no_match; where that is 0 the cameras never see the object at the same time.
  std::uint32_t disagreeing = 0;
};

/// Symmetries of a model that are tried at most: those of a cube. Of a regular polygon with more than 12 sides the
/// first ones.
inline constexpr std::size_t kMaxSymmetries = 24;

struct StereoWorkspace {
  Span<std::byte> camera[kStereoSides];
  StereoRefinerWorkspace refiner;
  Span<PosePair> poses;    ///< [views of one camera]
  Span<StereoPair> pairs;  ///< the same
  Span<Pose> symmetries;
};

constexpr StereoRefinerCapacities refiner_capacities(const StereoCapacities& c) {
  StereoRefinerCapacities out;
  out.views = 2 * std::size_t{c.left.windows};
  out.model_lines = c.left.model_lines > c.right.model_lines ? c.left.model_lines : c.right.model_lines;
  out.edges = c.left.edges && c.right.edges;
  return out;
}

template <class Carver>
constexpr bool carve(Carver& carver, const StereoCapacities& c, StereoWorkspace* out) {
  const StereoRefinerCapacities refiner = refiner_capacities(c);
  Span<std::max_align_t> aligned;  // of no element: where the second camera's memory begins
  return carver.carve(required_bytes(c.left), &out->camera[0]) && carver.carve(0, &aligned) &&
         carver.carve(required_bytes(c.right), &out->camera[1]) && carve(carver, refiner, &out->refiner) &&
         carver.carve(refiner.views, &out->poses) && carver.carve(refiner.views, &out->pairs) &&
         carver.carve(kMaxSymmetries, &out->symmetries);
}

/// Bytes that StereoCalibrator::init() needs.
constexpr std::size_t required_bytes(const StereoCapacities& capacities) {
  ArenaMeter meter;
  StereoWorkspace workspace;
  (void)carve(meter, capacities, &workspace);
  return meter.peak();
}

/// Calibrates two cameras. Call it from one thread, as a MonoCalibrator. Clocks may be set back, for both cameras
/// alike, as between two recordings: after a camera's n-th time its windows are paired with those after the other's
/// n-th.
class StereoCalibrator {
 public:
  /// @param memory at least required_bytes(capacities), aligned to kArenaAlign; must outlive the calibrator
  /// @param model  must outlive the calibrator
  /// @return what MonoCalibrator::init() gives | invalid_argument (gyro samples, capacities of unlike windows)
  Status init(Span<std::byte> memory, const StereoCapacities& capacities, const StereoOptions& options,
              Span<const ModelLine> model);

  /// Takes events of one camera from the front of *events.
  /// @return ok (all taken) | in_progress (that camera's window is full: push the other one's events and call step())
  ///         | wrong_state
  Status push(StereoSide side, Span<const Event>* events);

  /// No more events of this camera come. @return ok | wrong_state
  Status finish(StereoSide side);

  /// One bounded piece of work: the lines of two windows, a step of one camera's matcher or solver, or one iteration of
  /// both together.
  /// @return in_progress (call again) | need_more_data (see wanted()) | ok (result() is there) | wrong_state (before
  ///         init()) | final: what MonoCalibrator::step() gives, phase at which it failed: failed_in(); no_match (the
  ///         cameras' poses do not agree); not_converged, degenerate_geometry, numerical_failure; implausible_result in
  ///         StereoPhase::between (their poses agree roughly, but not as well as each is known)
  Status step();

  /// Whose events are needed next, where step() returned need_more_data.
  [[nodiscard]] StereoSide wanted() const;

  /// @return ok | what the last step() returned; *out is filled as far as it was computed
  Status result(StereoResult* out) const;

  [[nodiscard]] StereoPhase phase() const { return phase_; }
  [[nodiscard]] StereoPhase failed_in() const { return failed_in_; }
  [[nodiscard]] const MonoCalibrator& camera(StereoSide side) const { return cameras_[index_of(side)]; }
  /// 0 to 1, never 1 before success. It falls back once where one camera has edges and the other lines alone.
  [[nodiscard]] float progress() const;

 private:
  static constexpr std::size_t index_of(StereoSide side) { return static_cast<std::size_t>(side); }

  /// Of one camera, as its windows tell it.
  struct Clock {
    std::uint32_t set_back = 0;                                        ///< how often it was
    std::int64_t begin_us = std::numeric_limits<std::int64_t>::min();  ///< of the last window worked on
    [[nodiscard]] std::uint32_t times_set_back(const EventWindow& window) const;
  };

  Status collect();
  Status work_on(bool left, bool right);
  Status calibrate(StereoSide side);
  Status begin_between();
  std::size_t pair_views();
  Status finish_between();
  Status fail(Status status);

  MonoCalibrator cameras_[kStereoSides];
  StereoWorkspace workspace_;
  StereoOptions options_;
  Span<const ModelLine> model_;
  StereoRefiner refiner_;
  StereoResult result_;
  Clock clocks_[kStereoSides];
  bool finished_[kStereoSides] = {};
  StereoPhase phase_ = StereoPhase::idle;
  StereoPhase failed_in_ = StereoPhase::idle;
  Status verdict_ = Status::wrong_state;
};

}  // namespace lecalib
