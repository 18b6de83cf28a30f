// SPDX-License-Identifier: MIT
/// The radial part of each distortion model of core/records.hpp: ideal radius r to distorted radius r_d. With
/// B(x) = x (1 + k1 x^2 + k2 x^4 + k3 x^6):
///
/// | model      | curve                                           | ends                                              |
/// |------------|-------------------------------------------------|---------------------------------------------------|
/// | brown      | r_d = B(r)                                      | where B' = 0: the image folds back over itself    |
/// | polynomial | r = B(r_d), solved by Newton steps              | at r = B(x) with B'(x) = 0: no r_d shows more     |
/// | division   | r_d = 2 r / (1 + sqrt(1 - 4 k1 r^2))            | k1 > 0: at r = 1 / (2 sqrt(k1)); else nowhere     |
///
/// No function here returns a point of the folded branch.
#pragma once

#include <algorithm>
#include <cmath>

#include "lecalib/core/records.hpp"
#include "lecalib/math/eigen.hpp"

namespace lecalib {

/// What valid_radius() returns where the radial curve never ends; nobody looks further than 89.9 degrees aside.
inline constexpr double kUnboundedRadius = 1e3;

/// Largest ideal radius |(x, y)| of the branch through 0 (p1, p2 left aside), see the table above.
double valid_radius(const Camera& camera);

/// The smallest r > 0 where d(r_d)/dr has fallen to `slope`, in [0, 1), or, with the inverse models, risen to
/// 1 / slope; kUnboundedRadius where there is none.
double radius_of_slope(const Camera& camera, double slope);

/// r_d / r and its derivative by the squared ideal radius q.
struct RadialFactor {
  double value;
  double by_q;
};

/// radial_at() of the polynomial and of the division model.
RadialFactor inverse_radial_at(const Camera& camera, double q);

inline RadialFactor brown_radial_at(const Camera& c, double q) {
  return {1.0 + q * (c.k1 + q * (c.k2 + q * c.k3)), c.k1 + q * (2.0 * c.k2 + q * 3.0 * c.k3)};
}

/// @param q squared ideal radius, below that of valid_radius()
inline RadialFactor radial_at(const Camera& c, double q) {
  return c.model == DistortionModel::brown ? brown_radial_at(c, q) : inverse_radial_at(c, q);
}

/// The same with the radial curve going on straight from the radius `knee` on: a curve without an end, for searches on
/// the way to a camera whose points all lie inside.
inline RadialFactor radial_at(const Camera& c, double q, double knee) {
  if (!(q > knee * knee)) return radial_at(c, q);
  const RadialFactor end = radial_at(c, knee * knee);
  const double slope = end.value + 2.0 * knee * knee * end.by_q;
  const double r = std::sqrt(q);
  const double value = (knee * end.value + slope * (r - knee)) / r;
  return {value, (slope - value) / (2.0 * q)};
}

/// About r_d / r of a point that is seen at the squared distorted radius q_d; exact for the inverse models. May be
/// anything outside of the curve's domain.
inline double factor_seen_at(const Camera& c, double q_d) {
  if (c.model == DistortionModel::division) return 1.0 + c.k1 * q_d;
  const double polynomial = 1.0 + q_d * (c.k1 + q_d * (c.k2 + q_d * c.k3));
  return c.model == DistortionModel::brown ? polynomial : 1.0 / std::max(polynomial, 1e-3);
}

/// d(r_d / r)/d(k1 k2 k3) of the polynomial and of the division model.
Vec3 inverse_radial_gradient(const Camera& camera, double q);

/// d(r_d / r)/d(k1 k2 k3), at a fixed ideal radius.
/// @param q squared ideal radius, below that of valid_radius()
inline Vec3 radial_gradient(const Camera& c, double q) {
  return c.model == DistortionModel::brown ? Vec3(q, q * q, q * q * q) : inverse_radial_gradient(c, q);
}

/// The ideal radius in [0, radius_limit] whose distorted radius is `distorted_radius` (p1, p2 left aside);
/// radius_limit, at most valid_radius(), where it lies beyond.
/// @param tolerance relative, of the last Newton step
double undistort_radius(const Camera& camera, double distorted_radius, double radius_limit, double tolerance = 1e-15);

/// Whether it is cheap to tell that the curve does not end within the squared ideal radius q. false tells nothing.
bool surely_inside(const Camera& camera, double q);

}  // namespace lecalib
