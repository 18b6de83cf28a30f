// SPDX-License-Identifier: MIT
/// Which lines of a view belong to the model where they are said to: random samples of as many lines as the linear
/// solvers need, each solution judged by how many lines lie near its image of theirs (Fischler and Bolles 1981, with
/// the truncated cost of Torr and Zisserman 2000, and a refit to all near lines wherever the best is beaten).
#pragma once

#include <cstdint>

#include "lecalib/core/rng.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/solve/calibration_data.hpp"
#include "lecalib/solve/line_dlt.hpp"
#include "lecalib/solve/view_lines.hpp"

namespace lecalib {

struct LineRansacOptions {
  std::uint64_t seed = 1;     ///< same seed, same samples
  int max_samples = 400;      ///< > 0; for each view and straightening of its image
  double failure = 1e-6;      ///< drawing ends when the chance that no sample was free of wrong lines is below; (0, 1)
  double reach_share = 0.04;  ///< of half the image's diagonal: a line is near below this rms distance. > 0
  double min_right_share = 0.5;  ///< of a view's lines; with fewer near ones the whole view is left out. [0, 1]
};

/// Scratch from the caller.
struct LineRansacWorkspace {
  Span<LineSums> sums;    ///< one per model line
  Span<ViewLine> lines;   ///< one per model line
  Span<ViewLine> chosen;  ///< one per model line
};

class LineRansac {
 public:
  /// @param data     validated; must outlive the search; its left_out is not used
  /// @param left_out one per point; written view by view
  /// @return ok | invalid_argument | capacity_exceeded
  Status init(const CalibrationData& data, const LineRansacOptions& options, const LineRansacWorkspace& workspace,
              Span<std::uint8_t> left_out);

  /// Bounded work: one sample, or the verdict over one view.
  /// @return in_progress | ok (left_out is complete) | degenerate_geometry (no view has enough lines that agree)
  Status step();

 private:
  void begin_view();
  void begin_straightening();
  [[nodiscard]] Straightening straightening(int index) const;
  [[nodiscard]] bool enough_samples() const;
  bool draw_sample();
  bool solve(Span<const ViewLine> lines, Mat34* M) const;
  double judge(const Mat34& M, std::size_t* near) const;
  void improve(Mat34 M);
  void mark_view();

  CalibrationData data_;
  LineRansacOptions options_;
  LineRansacWorkspace workspace_;
  Span<std::uint8_t> left_out_;
  Rng rng_{1};
  ModelFrame frame_{ModelShape::collinear, Mat3::Identity(), Vec3::Zero()};
  Mat34 best_ = Mat34::Zero();
  double best_cost_ = 0.0;
  std::size_t best_near_ = 0;
  int best_straightening_ = -1;
  std::size_t view_ = 0;
  std::size_t num_lines_ = 0;  // of the view
  std::size_t sample_size_ = 0;
  std::size_t views_kept_ = 0;
  int straightening_ = 0;
  int samples_ = 0;
};

}  // namespace lecalib
