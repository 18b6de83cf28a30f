// SPDX-License-Identifier: MIT
/// What homographies between a plane of the world and its image tell about the camera.
#pragma once

#include "lecalib/core/records.hpp"
#include "lecalib/math/eigen.hpp"

namespace lecalib {

/// The line through two points as (a, b, c) with a x + b y + c = 0 and a^2 + b^2 = 1; zero for equal points.
Vec3 line_through(const Vec2& p, const Vec2& q);

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
