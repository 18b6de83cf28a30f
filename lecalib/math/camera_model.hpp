// SPDX-License-Identifier: MIT
/// The camera of core/records.hpp: pinhole with distortion, ideal to distorted ([Liu24] eq. 8). With x = X/Z, y = Y/Z,
/// r2 = x^2 + y^2 and the radial factor f(r2) = r_d / r of the camera's model (math/radial_curve.hpp):
///
///     x_d = x f(r2) + 2 p1 x y + p2 (r2 + 2 x^2),   u = fx x_d + cx
///     y_d = y f(r2) + 2 p2 x y + p1 (r2 + 2 y^2),   v = fy y_d + cy
///
/// The radial curve has an end, where the image folds back over itself (Brown) or nothing more is seen (the inverse
/// models). No function here returns a point of the folded branch.
#pragma once

#include <algorithm>
#include <cmath>

#include "lecalib/core/records.hpp"
#include "lecalib/math/eigen.hpp"
#include "lecalib/math/radial_curve.hpp"

namespace lecalib {

using Mat2 = Eigen::Matrix2d;
using Mat23 = Eigen::Matrix<double, 2, 3>;
using Mat25 = Eigen::Matrix<double, 2, 5>;
using Mat29 = Eigen::Matrix<double, 2, 9>;

/// Whether the lens is centred, as most are taken to be.
inline bool is_centred(const Camera& c) { return c.p1 == 0.0 && c.p2 == 0.0; }

/// The image of an ideal point whose radial factor is at hand, normalised coordinates.
inline Vec2 distorted_point(const Camera& c, const Vec2& ideal, const RadialFactor& radial) {
  const double x = ideal(0), y = ideal(1);
  if (is_centred(c)) return {x * radial.value, y * radial.value};
  const double xy2 = 2.0 * x * y, q = x * x + y * y;
  return {x * radial.value + c.p1 * xy2 + c.p2 * (q + 2.0 * x * x),
          y * radial.value + c.p2 * xy2 + c.p1 * (q + 2.0 * y * y)};
}

/// How that image moves when the ideal point moves by `v`: J v.
/// @param outward ideal . v, which callers know
inline Vec2 distorted_motion(const Camera& c, const Vec2& ideal, const RadialFactor& radial, const Vec2& v,
                             double outward) {
  const double x = ideal(0), y = ideal(1);
  const double stretch = 2.0 * radial.by_q * outward;
  const Vec2 by_radius(radial.value * v(0) + x * stretch, radial.value * v(1) + y * stretch);
  if (is_centred(c)) return by_radius;
  const double cross = 2.0 * (c.p1 * x + c.p2 * y);
  return {by_radius(0) + (2.0 * c.p1 * y + 6.0 * c.p2 * x) * v(0) + cross * v(1),
          by_radius(1) + cross * v(0) + (2.0 * c.p2 * x + 6.0 * c.p1 * y) * v(1)};
}

/// weight . d(image)/d(k1 k2 p1 p2 k3), image in normalised coordinates.
/// @param knee radius from which on the radial curve is taken to go on straight, as radial_at() with a knee does
inline void distortion_gradient(const Camera& c, const Vec2& ideal, const Vec2& weight, double knee,
                                double (&gradient)[5]) {
  const double x = ideal(0), y = ideal(1);
  const double q = x * x + y * y, xy2 = 2.0 * x * y;
  const double q_bent = std::min(q, knee * knee);  // the curve's bent part ends there
  double along = weight(0) * x + weight(1) * y;
  if (q_bent < q) along *= std::sqrt(q_bent / q);
  const Vec3 radial = radial_gradient(c, q_bent);
  gradient[0] = along * radial(0);
  gradient[1] = along * radial(1);
  gradient[2] = weight(0) * xy2 + weight(1) * (q + 2.0 * y * y);
  gradient[3] = weight(0) * (q + 2.0 * x * x) + weight(1) * xy2;
  gradient[4] = along * radial(2);
}

/// About the ideal point of a pixel, in one step: where a search begins, or where only a sign is asked.
Vec2 roughly_undistorted(const Camera& camera, const Vec2& pixel);

/// Ideal to distorted normalised coordinates, without any check of the domain: for loops that hold valid_radius().
/// @param[out] d_ideal        2 x 2, may be null
/// @param[out] d_coefficients 2 x 5 in the order k1 k2 p1 p2 k3, may be null
Vec2 distort(const Camera& camera, const Vec2& ideal, Mat2* d_ideal = nullptr, Mat25* d_coefficients = nullptr);

/// Pixel of a point in the camera frame. A point behind the camera (Z < 0) is projected too, as the point of its ray:
/// the image of an infinite line knows no front.
/// @param[out] d_point      2 x 3, px per unit of x_cam, may be null
/// @param[out] d_intrinsics 2 x 9 in the order of kIntrinsics, may be null
/// @return false, outputs unchanged, for Z = 0, beyond valid_radius() or where a value is not finite
bool project(const Camera& camera, const Vec3& x_cam, Vec2* pixel, Mat23* d_point = nullptr,
             Mat29* d_intrinsics = nullptr);

/// Ideal normalised coordinates of a pixel.
/// @return false, *ideal unchanged, where no point of the un-folded branch has this image
bool unproject(const Camera& camera, const Vec2& pixel, Vec2* ideal);

/// As above, for loops that hold `radius_limit` = valid_radius(camera).
bool unproject(const Camera& camera, double radius_limit, const Vec2& pixel, Vec2* ideal);

}  // namespace lecalib
