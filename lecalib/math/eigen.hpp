// SPDX-License-Identifier: MIT
/// The one way by which Eigen comes in: its asserts go through our hook, so that no printf or abort is linked.
#pragma once

#include "lecalib/core/config.hpp"

#ifndef eigen_assert
#define eigen_assert(expression) LECALIB_ASSERT(expression)
#endif

#include <Eigen/Cholesky>  // IWYU pragma: export
#include <Eigen/Core>      // IWYU pragma: export
#include <Eigen/Geometry>  // IWYU pragma: export
#include <Eigen/LU>        // IWYU pragma: export

namespace lecalib {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using RowMat3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

}  // namespace lecalib
