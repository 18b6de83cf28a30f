// SPDX-License-Identifier: MIT
/// A camera and a pose per view to refine from, found without any hint.
///
/// For each of a few straightenings of the image (lenses bend lines, and a linear solution of bent lines may have no
/// real focal length): the linear solution of every view, then candidate focal lengths - both from the orthonormality
/// stacked over all planar views, one shared by both axes, the median over the non-planar views, and a sweep over
/// fields of view, which needs no luck - each with its own poses. The candidate with the smallest cost in pixels is the
/// start. Most lenses need none of this: where the plain linear solution is promising it is handed out at once, and the
/// search only goes on when its refinement has failed.
#pragma once

#include <cstdint>

#include "lecalib/core/records.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/math/eigen.hpp"
#include "lecalib/solve/calibration_data.hpp"
#include "lecalib/solve/line_dlt.hpp"
#include "lecalib/solve/parameter_policy.hpp"
#include "lecalib/solve/refine.hpp"
#include "lecalib/solve/view_lines.hpp"

namespace lecalib {

struct InitialGuessOptions {
  double good_enough_px = 1.0;   ///< rms; a start as near as this ends the search. >= 0
  double promising_share = 0.1;  ///< rms over image width; the plain start is tried first where it is as near as this
  double min_view_deg = 10.0;    ///< focal lengths outside of these horizontal fields of view are not candidates
  double max_view_deg = 170.0;
};

/// The linear solution of one view; scratch.
struct LinearView {
  double projection[12];  ///< column-major: H (3 x 3) of the plane frame, or M (3 x 4)
  double axes[9];         ///< ModelFrame, column-major
  double origin[3];
  double fx, fy;     ///< non-planar views: with the principal point at the image centre; 0 where there is none
  ModelShape shape;  ///< collinear: no solution
};

/// A camera that the search has tried; enough to come back to it.
struct StartCandidate {
  double fx, fy;
  double rms_px;
  int straightening;
};

/// Starts worth keeping: each differs by a quarter or more in its focal length from the others.
inline constexpr std::size_t kMaxStartCandidates = 4;

/// Scratch and results of the search, from the caller.
struct InitialGuessWorkspace {
  Span<LineSums> sums;         ///< one per model line
  Span<ViewLine> lines;        ///< one per model line
  Span<LinearView> linear;     ///< one per view
  Span<double> focal_lengths;  ///< one per view
  Span<RefineView> views;      ///< one per view; result: pose and used, scratch while the search goes on
};

class InitialGuess {
 public:
  /// @param data validated; all spans must outlive the search
  void init(const CalibrationData& data, const InitialGuessOptions& options, const InitialGuessWorkspace& workspace);

  /// Bounded work: the linear solution of one view, the candidates of one straightening, or all poses of one camera.
  /// @return in_progress | ok (camera() and the workspace's views hold the start) | too_few_lines (no view has 4 lines
  /// in a plane or 6 in space) | degenerate_geometry (no view has a linear solution: parallel, concurrent, collinear or
  /// repeated lines)
  Status step();

  /// Where the refinement from the best candidate has failed: searches on if that was handed out early, else turns to
  /// the next best one. step() as above.
  /// @return false where no candidate is left
  bool begin_next_candidate();

  [[nodiscard]] const Camera& camera() const { return camera_; }
  /// How much the views of the start tell about the principal point; as classify_views(), at less cost.
  [[nodiscard]] ViewGeometry geometry() const;
  /// Of the search's views, each distance capped at 100 px.
  [[nodiscard]] double rms_px() const { return rms_px_; }

 private:
  static constexpr int kNone = -1;

  [[nodiscard]] Straightening straightening() const;
  [[nodiscard]] Camera camera_for(double fx, double fy) const;
  void solve_view(std::size_t index);
  void try_straightening();
  void try_planar_focal_lengths();
  void try_spatial_focal_lengths();
  void sweep_focal_lengths();
  void try_camera(double fx, double fy);
  void keep_candidate(const StartCandidate& candidate);
  [[nodiscard]] double promising_px() const;
  Status next_straightening();
  void begin_straightening(int index);
  Status settle();

  CalibrationData data_;
  InitialGuessOptions options_;
  InitialGuessWorkspace workspace_;
  Camera camera_;
  double rms_px_ = 0.0;
  Eigen::Matrix2d focal_matrix_ = Eigen::Matrix2d::Zero();  // stacked orthonormality, normal equations for 1/f^2
  Vec2 focal_vector_ = Vec2::Zero();
  std::size_t stride_ = 1;  // between the views that the search looks at
  std::size_t next_view_ = 0;
  std::size_t most_planar_lines_ = 0;  // of any view
  std::size_t most_spatial_lines_ = 0;
  int straightening_ = 0;
  int solved_ = kNone;         // the straightening that all views' linear solutions are of
  StartCandidate posed_ = {};  // the camera that all views' poses are of, rms_px left aside
  StartCandidate candidates_[kMaxStartCandidates] = {};
  std::size_t num_candidates_ = 0;
  std::size_t candidates_taken_ = 0;  // 0 while the search goes on
  bool exhaustive_ = false;           // all straightenings, whatever the first one gives
  StartCandidate tried_ = {};         // handed out early
};

/// How much the views used tell about the principal point.
ViewGeometry classify_views(const CalibrationData& data, Span<const RefineView> views, Span<LineSums> sums,
                            Span<ViewLine> lines);

}  // namespace lecalib
