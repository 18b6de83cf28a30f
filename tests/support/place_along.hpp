// SPDX-License-Identifier: MIT
#pragma once

#include <doctest/doctest.h>

#include <algorithm>

#include "lecalib/core/records.hpp"
#include "lecalib/math/camera_model.hpp"
#include "lecalib/math/eigen.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib::test {

/// Where on a model line, from -1/2 to 1/2, a pixel lies in a view: nearest to its ray by least squares, or its end.
inline double place_along(const Camera& camera, const Pose& pose, const ModelLine& line, const Vec2& pixel) {
  Vec2 ideal;
  REQUIRE(unproject(camera, pixel, &ideal));
  const Vec3 p = rotation_of(pose) * Eigen::Map<const Vec3>(line.p) + translation_of(pose);
  const Vec3 q = rotation_of(pose) * Eigen::Map<const Vec3>(line.q) + translation_of(pose);
  Eigen::Matrix<double, 3, 2> directions;
  directions << q - p, Vec3(-ideal(0), -ideal(1), -1.0);
  const Vec2 places = (directions.transpose() * directions).inverse() * (directions.transpose() * -p);
  return std::clamp(places(0) - 0.5, -0.5, 0.5);
}

}  // namespace lecalib::test
