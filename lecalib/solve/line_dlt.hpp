// SPDX-License-Identifier: MIT
/// Normalised direct linear transformation from line correspondences ([Liu24] eq. 3 to 7), planar and non-planar.
#pragma once

#include <cstdint>

#include "lecalib/core/records.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/math/eigen.hpp"
#include "lecalib/math/plane_homography.hpp"
#include "lecalib/solve/view_lines.hpp"

namespace lecalib {

using Mat34 = Eigen::Matrix<double, 3, 4>;

/// Smallest number of line correspondences of the two solvers.
inline constexpr std::size_t kMinPlanarLines = 4;
inline constexpr std::size_t kMinNonPlanarLines = 6;

/// How the model lines of a view lie in space.
enum class ModelShape : std::uint8_t {
  collinear,  ///< all in one line: nothing can be had
  planar,     ///< in one plane, or nearly: a start from a homography is the better one
  non_planar,
};

/// The model lines' own frame: x_plane = axes (x_world - origin); rows of `axes` by falling extent, right-handed.
struct ModelFrame {
  ModelShape shape;
  Mat3 axes;
  Vec3 origin;
};

/// Principal axes of the end points of the lines seen in a view. Planar when thinner than 2 % of the extent.
ModelFrame find_model_frame(Span<const ModelLine> model, Span<const ViewLine> lines);

/// The 3 x 4 projection matrix, l . M (P, 1) = 0 for both end points P of each model line, |M| = 1, either sign.
/// @param lines >= kMinNonPlanarLines
/// @return false, *M unchanged, with too few lines or where they leave M undefined
bool solve_line_dlt(Span<const ModelLine> model, Span<const ViewLine> lines, Mat34* M);

/// The homography from the (x, y) of `frame` to the image, |H| = 1, either sign.
/// @param lines >= kMinPlanarLines
/// @return false, *H unchanged, with too few lines or where they leave H undefined
bool solve_planar_line_dlt(Span<const ModelLine> model, Span<const ViewLine> lines, const ModelFrame& frame, Mat3* H);

/// Intrinsics and pose of a projection matrix.
struct Decomposition {
  double fx, fy, cx, cy;
  Mat3 R;
  Vec3 t;
};

/// M = K [R | t] by RQ decomposition; positive focal lengths, R proper, skew left aside.
/// @return false, *out unchanged, for a singular left 3 x 3 part
bool decompose_projection(const Mat34& M, Decomposition* out);

/// The focal lengths with known principal point, from the row norms of the centred matrix.
/// @return false, outputs unchanged, where they are not positive and finite
bool find_focal_lengths(const Mat34& M, double cx, double cy, double* fx, double* fy);

/// As above with known principal point: these focal lengths, R the rotation nearest.
bool decompose_projection(const Mat34& M, double cx, double cy, Decomposition* out);

/// Pose for a known camera (distortion left aside), R the rotation nearest to inverse(K) M.
bool pose_from_projection(const Mat34& M, const Camera& camera, Pose* pose);

}  // namespace lecalib
