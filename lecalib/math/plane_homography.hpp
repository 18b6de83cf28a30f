// SPDX-License-Identifier: MIT
/// The homography between a plane of model lines and their image, from line pairs, and what it tells about the camera.
#pragma once

#include "lecalib/core/records.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/math/eigen.hpp"

namespace lecalib {

/// A line of the model plane, by two of its points (plane coordinates, metres), and its image, by two of its points
/// (px). The points need not correspond, and neither pair may coincide.
struct PlaneLinePair {
  Vec2 model_p, model_q;
  Vec2 image_p, image_q;
};

/// The line through two points as (a, b, c) with a x + b y + c = 0 and a^2 + b^2 = 1; zero for equal points.
Vec3 line_through(const Vec2& p, const Vec2& q);

/// Closed form for four pairs: H maps plane points (x, y, 1) to pixels, |H| = 1 (Frobenius), either sign.
/// @return false, *H unchanged, where three model or three image lines meet in a point or are parallel
bool homography_from_four_lines(const PlaneLinePair (&pairs)[4], Mat3* H);

/// Least squares for four pairs or more: l . H P = 0 for both model points ([Liu24] eq. 3, planar), both sides
/// normalised, smallest eigenvector of A'A.
/// @return false, *H unchanged, with fewer than four pairs or where they leave H undefined
bool homography_from_lines(Span<const PlaneLinePair> pairs, Mat3* H);

/// Both focal lengths (px) from a homography with known principal point ([Liu24] eq. 6: the two columns of the rotation
/// are orthogonal and of equal length).
/// @return false, outputs unchanged, where no positive pair exists or the plane's tilt does not tell (fronto-parallel)
bool focal_lengths_from_homography(const Mat3& H, double cx, double cy, double* fx, double* fy);

/// As above with fx = fy: one unknown for two equations, hence defined for more poses and less sensitive to noise.
bool focal_length_from_homography(const Mat3& H, double cx, double cy, double* f);

/// Stacks homographies of several views of one camera: adds the two equations of H (principal point at the origin, |H|
/// arbitrary, coordinates near one) to the normal equations A'A w = A'c for w = (1/fx^2, 1/fy^2) (Zhang 2000).
void add_focal_equations(const Mat3& H, Eigen::Matrix2d* AtA, Vec2* Atc);

/// Both focal lengths, or one for both axes, from stacked equations.
/// @return false, outputs unchanged, where the least-squares w is not positive or not unique
bool solve_focal_lengths(const Eigen::Matrix2d& AtA, const Vec2& Atc, double* fx, double* fy);
bool solve_focal_length(const Eigen::Matrix2d& AtA, const Vec2& Atc, double* f);

/// Pose of the plane (z = 0 of the world frame) for a known camera; distortion is left aside.
/// @param visible a point of the plane that is in front of the camera: it picks one of the two poses with the same
/// image
Pose pose_from_homography(const Mat3& H, const Camera& camera, const Vec2& visible);

}  // namespace lecalib
