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
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Vec9 = Eigen::Matrix<double, 9, 1>;
using Mat3 = Eigen::Matrix3d;
using Mat6 = Eigen::Matrix<double, 6, 6>;
using Mat9 = Eigen::Matrix<double, 9, 9>;
using Mat69 = Eigen::Matrix<double, 6, 9>;
using RowMat3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

}  // namespace lecalib
