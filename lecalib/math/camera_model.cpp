// SPDX-License-Identifier: MIT
#include "lecalib/math/camera_model.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

/// Bounds of the radial factor that a single step of un-distortion trusts.
constexpr double kMinFactor = 0.4;
constexpr double kMaxFactor = 2.5;

bool is_finite(const Vec2& v) { return std::isfinite(v(0)) && std::isfinite(v(1)); }

}  // namespace

Vec2 roughly_undistorted(const Camera& c, const Vec2& pixel) {
  const Vec2 distorted((pixel(0) - c.cx) / c.fx, (pixel(1) - c.cy) / c.fy);
  return distorted / std::clamp(factor_seen_at(c, distorted.squaredNorm()), kMinFactor, kMaxFactor);
}

Vec2 distort(const Camera& c, const Vec2& ideal, Mat2* d_ideal, Mat25* d_coefficients) {
  const RadialFactor radial = radial_at(c, ideal.squaredNorm());
  if (d_ideal != nullptr) {
    d_ideal->col(0) = distorted_motion(c, ideal, radial, Vec2(1.0, 0.0), ideal(0));
    d_ideal->col(1) = distorted_motion(c, ideal, radial, Vec2(0.0, 1.0), ideal(1));
  }
  if (d_coefficients != nullptr) {
    for (const int i : {0, 1}) {
      double gradient[5];
      distortion_gradient(c, ideal, Vec2::Unit(i), kUnboundedRadius, gradient);
      d_coefficients->row(i) = Eigen::Map<const Eigen::Matrix<double, 1, 5>>(gradient);
    }
  }
  return distorted_point(c, ideal, radial);
}

bool project(const Camera& c, const Vec3& x_cam, Vec2* pixel, Mat23* d_point, Mat29* d_intrinsics) {
  if (x_cam(2) == 0.0) return false;
  const double inverse_z = 1.0 / x_cam(2);
  const Vec2 ideal(x_cam(0) * inverse_z, x_cam(1) * inverse_z);
  const double q = ideal.squaredNorm();
  if (!(q < kUnboundedRadius * kUnboundedRadius)) return false;
  if (!surely_inside(c, q)) {
    const double limit = valid_radius(c);
    if (!(q < limit * limit)) return false;
  }
  Mat2 d_ideal;
  Mat25 d_coefficients;
  const Vec2 distorted =
      distort(c, ideal, d_point != nullptr ? &d_ideal : nullptr, d_intrinsics != nullptr ? &d_coefficients : nullptr);
  const Vec2 result(c.fx * distorted(0) + c.cx, c.fy * distorted(1) + c.cy);
  if (!is_finite(result)) return false;
  *pixel = result;
  const Vec2 focal(c.fx, c.fy);
  if (d_point != nullptr) {
    Mat23 d_division;
    d_division << inverse_z, 0.0, -ideal(0) * inverse_z, 0.0, inverse_z, -ideal(1) * inverse_z;
    *d_point = focal.asDiagonal() * d_ideal * d_division;
  }
  if (d_intrinsics != nullptr) {
    d_intrinsics->leftCols<4>() << distorted(0), 0.0, 1.0, 0.0, 0.0, distorted(1), 0.0, 1.0;
    d_intrinsics->rightCols<5>() = focal.asDiagonal() * d_coefficients;
  }
  return true;
}

bool unproject(const Camera& c, const Vec2& pixel, Vec2* ideal) { return unproject(c, valid_radius(c), pixel, ideal); }

bool unproject(const Camera& c, double limit, const Vec2& pixel, Vec2* ideal) {
  const Vec2 distorted((pixel(0) - c.cx) / c.fx, (pixel(1) - c.cy) / c.fy);
  if (!is_finite(distorted)) return false;
  const double distorted_radius = distorted.norm();
  const double r = undistort_radius(c, distorted_radius, limit);
  Vec2 x = distorted_radius > 0.0 ? Vec2(distorted * (r / distorted_radius)) : distorted;
  if (c.p1 == 0.0 && c.p2 == 0.0) {
    if (!(r < limit)) return false;
    *ideal = x;
    return true;
  }
  for (int i = 0; i < 50; ++i) {
    Mat2 J;
    const Vec2 error = distort(c, x, &J) - distorted;
    const double determinant = J(0, 0) * J(1, 1) - J(0, 1) * J(1, 0);
    if (!(determinant > 0.0)) return false;  // at or beyond the fold
    const Vec2 step((J(1, 1) * error(0) - J(0, 1) * error(1)) / determinant,
                    (J(0, 0) * error(1) - J(1, 0) * error(0)) / determinant);
    x -= step;
    if (!(x.norm() < limit)) return false;
    if (step.norm() <= 1e-14 * (1.0 + x.norm())) {
      *ideal = x;
      return true;
    }
  }
  return false;
}

}  // namespace lecalib
