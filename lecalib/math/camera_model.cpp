// SPDX-License-Identifier: MIT
#include "lecalib/math/camera_model.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

/// d(r_d)/dr at r^2 = q.
double radial_slope(const Camera& c, double q, double below = 0.0) {
  return (1.0 - below) + q * (3.0 * c.k1 + q * (5.0 * c.k2 + q * 7.0 * c.k3));
}

/// Keeps a computed limit on the un-folded side in spite of rounding.
constexpr double kInside = 1.0 - 4e-15;

double slope_change(const Camera& c, double q) { return 3.0 * c.k1 + q * (10.0 * c.k2 + q * 21.0 * c.k3); }

/// The root of radial_slope in [low, high], where it falls from above to below zero exactly once, from below: by Newton
/// steps, halving where one leaves the bracket.
double root_of_slope(const Camera& c, double below, double low, double high) {
  double q = 0.5 * (low + high);
  for (int i = 0; i < 200 && high - low > 1e-16 * high; ++i) {
    const double slope = radial_slope(c, q, below);
    (slope > 0.0 ? low : high) = q;
    double next = q - slope / slope_change(c, q);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (next <= low || next >= high) break;
    if (std::abs(next - q) <= 1e-15 * q) {
      const double inside = next * kInside;  // Newton may come from either side
      return radial_slope(c, inside, below) > 0.0 ? inside : low;
    }
    q = next;
  }
  return low;
}

/// A lower bound of the slope over [0, q] that is cheap: the terms that pull it down alone.
bool surely_unfolded(const Camera& c, double q, double below = 0.0) {
  const double down = 3.0 * std::min(c.k1, 0.0) + q * (5.0 * std::min(c.k2, 0.0) + q * 7.0 * std::min(c.k3, 0.0));
  return (1.0 - below) + q * down > 0.0;
}

bool is_finite(const Vec2& v) { return std::isfinite(v(0)) && std::isfinite(v(1)); }

}  // namespace

double valid_radius(const Camera& c) { return radius_of_slope(c, 0.0); }

double radius_of_slope(const Camera& c, double below) {
  constexpr double kMaxSquare = kUnboundedRadius * kUnboundedRadius;
  if (surely_unfolded(c, kMaxSquare, below)) return kUnboundedRadius;
  if (c.k3 == 0.0) {  // 1 + 3 k1 q + 5 k2 q^2, its smallest positive root in the form that never cancels
    const double discriminant = 9.0 * c.k1 * c.k1 - 20.0 * c.k2 * (1.0 - below);
    if (!(discriminant >= 0.0)) return kUnboundedRadius;
    const double root = std::sqrt(discriminant);
    const double divisor = root - 3.0 * c.k1;
    const double q = divisor > 0.0 ? 2.0 * (1.0 - below) / divisor : kMaxSquare;
    return q < kMaxSquare ? std::sqrt(q) * kInside : kUnboundedRadius;
  }
  // The slope is a cubic in q = r^2; between its own turning points (3 k1 + 10 k2 q + 21 k3 q^2 = 0) it is monotonic,
  // so the first of these at or below zero ends the interval that holds the first root.
  double stations[3] = {kMaxSquare, kMaxSquare, kMaxSquare};
  const double discriminant = 25.0 * c.k2 * c.k2 - 63.0 * c.k1 * c.k3;
  if (discriminant >= 0.0) {
    // Numerically stable pair of roots of 21 k3 q^2 + 10 k2 q + 3 k1.
    const double root = std::sqrt(discriminant);
    const double half = -(5.0 * c.k2 + (c.k2 < 0.0 ? -root : root));
    const double q1 = c.k3 != 0.0 ? half / (21.0 * c.k3) : -1.0;
    const double q2 = half != 0.0 ? 3.0 * c.k1 / half : -1.0;
    if (q1 > 0.0 && q1 < kMaxSquare) stations[0] = q1;
    if (q2 > 0.0 && q2 < kMaxSquare) stations[1] = q2;
    if (stations[1] < stations[0]) std::swap(stations[0], stations[1]);
  }
  double low = 0.0;
  for (const double high : stations) {
    if (!(radial_slope(c, high, below) > 0.0)) return std::sqrt(root_of_slope(c, below, low, high));
    low = high;
  }
  return kUnboundedRadius;
}

Vec2 distort(const Camera& c, const Vec2& ideal, Mat2* d_ideal, Mat25* d_coefficients) {
  const RadialFactor radial = radial_at(c, ideal.squaredNorm());
  if (d_ideal != nullptr) {
    d_ideal->col(0) = distorted_motion(c, ideal, radial, Vec2(1.0, 0.0));
    d_ideal->col(1) = distorted_motion(c, ideal, radial, Vec2(0.0, 1.0));
  }
  if (d_coefficients != nullptr) {
    d_coefficients->row(0) = distortion_gradient(ideal, Vec2(1.0, 0.0));
    d_coefficients->row(1) = distortion_gradient(ideal, Vec2(0.0, 1.0));
  }
  return distorted_point(c, ideal, radial);
}

bool project(const Camera& c, const Vec3& x_cam, Vec2* pixel, Mat23* d_point, Mat29* d_intrinsics) {
  if (x_cam(2) == 0.0) return false;
  const double inverse_z = 1.0 / x_cam(2);
  const Vec2 ideal(x_cam(0) * inverse_z, x_cam(1) * inverse_z);
  const double q = ideal.squaredNorm();
  if (!(q < kUnboundedRadius * kUnboundedRadius)) return false;
  if (!surely_unfolded(c, q)) {
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

double undistort_radius(const Camera& c, double distorted_radius, double radius_limit, double tolerance) {
  if (!(distorted_radius < radius_limit * radial_at(c, radius_limit * radius_limit).value)) return radius_limit;
  double low = 0.0;
  double high = radius_limit;
  double r = std::min(distorted_radius, high);
  for (int i = 0; i < 100; ++i) {
    const double error = r * radial_at(c, r * r).value - distorted_radius;
    (error > 0.0 ? high : low) = r;
    double next = r - error / radial_slope(c, r * r);
    if (!(next > low && next < high)) next = 0.5 * (low + high);  // Newton left the bracket
    if (std::abs(next - r) <= tolerance * next) return next;
    r = next;
  }
  return r;
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
