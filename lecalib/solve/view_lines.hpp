// SPDX-License-Identifier: MIT
/// The straight lines of one view, fitted to its measured points: what the linear solvers start from.
#pragma once

#include <cstdint>

#include "lecalib/core/span.hpp"
#include "lecalib/solve/calibration_data.hpp"

namespace lecalib {

/// One line of a view: the fitted image line by two points, at the extent of the measured ones.
struct ViewLine {
  double image_p[2];  ///< px, after straightening
  double image_q[2];
  std::uint16_t model_line;
};

/// A radial straightening in pixels, for use before any camera is known: division model about the image centre,
/// x_straight = x / (1 - mu rho^2), with rho = 1 at the image corner. Never folds outward for mu <= 0; for mu > 0
/// points beyond 0.95 of its pole are left where the factor is 1 / 0.05.
struct Straightening {
  double centre_x, centre_y;  ///< px
  double half_diagonal;       ///< px
  double mu;                  ///< > 0 barrel, < 0 pincushion, 0 none
};

/// Of the points of one model line in one view.
struct LineMoments {
  double x, y, xx, xy, yy;
  double direction[2];
  double low, high;  ///< extent along the direction from the mean, px
  std::uint32_t count;
};

/// Distances of a line's points in one view from its image, and their squares, px and px^2.
struct LineDistances {
  double sum, squares;
  double left_out_sum, left_out_squares;  ///< of the points that are left out
  std::uint32_t count, left_out_count;
};

/// Which points of a line are wrong in one view.
struct LineJudgement {
  double size;  ///< the line's misfit, as a share of what is allowed
  std::uint32_t count, wrong;
  std::uint32_t wrong_of_all;  ///< with the points that are left out
};

/// What is known of one model line in one view, one thing at a time; scratch.
union LineSums {
  LineMoments moments;
  LineDistances distances;
  LineJudgement judgement;
};

/// Fits a line (total least squares) to the points of each model line that has two distinct ones.
/// @param sums  scratch, one per model line
/// @param[out] lines  at least one per model line; [0, *count) are written, in the order of the model
void fit_view_lines(const CalibrationData& data, const View& view, const Straightening& straightening,
                    Span<LineSums> sums, Span<ViewLine> lines, std::size_t* count);

/// How many model lines have a point in use in the view.
/// @param sums  scratch, one per model line
std::size_t count_lines(const CalibrationData& data, const View& view, Span<LineSums> sums);

}  // namespace lecalib
