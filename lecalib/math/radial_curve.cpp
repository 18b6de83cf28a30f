// SPDX-License-Identifier: MIT
#include "lecalib/math/radial_curve.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lecalib {
namespace {

constexpr double kMaxSquare = kUnboundedRadius * kUnboundedRadius;

/// Keeps a computed limit on the un-folded side in spite of rounding.
constexpr double kInside = 1.0 - 4e-15;

/// Keeps derivatives finite at the very end of an inverse curve.
constexpr double kSmallestSlope = 1e-12;

/// B(x) = x (1 + k1 x^2 + k2 x^4 + k3 x^6): Brown's curve, and the polynomial's from the distorted radius.
struct OddCurve {
  double k1, k2, k3;

  explicit OddCurve(const Camera& c) : k1(c.k1), k2(c.k2), k3(c.k3) {}
  OddCurve(double a, double b, double c) : k1(a), k2(b), k3(c) {}

  /// B(x) / x at x^2 = q.
  [[nodiscard]] double factor(double q) const { return 1.0 + q * (k1 + q * (k2 + q * k3)); }
  [[nodiscard]] double factor_by_q(double q) const { return k1 + q * (2.0 * k2 + q * 3.0 * k3); }
  /// B'(x) - below.
  [[nodiscard]] double slope(double q, double below = 0.0) const {
    return (1.0 - below) + q * (3.0 * k1 + q * (5.0 * k2 + q * 7.0 * k3));
  }
  [[nodiscard]] double slope_by_q(double q) const { return 3.0 * k1 + q * (10.0 * k2 + q * 21.0 * k3); }

  /// A lower bound of the slope over [0, q] that is cheap: the terms that pull it down alone.
  [[nodiscard]] bool surely_above(double q, double below = 0.0) const {
    const double down = 3.0 * std::min(k1, 0.0) + q * (5.0 * std::min(k2, 0.0) + q * 7.0 * std::min(k3, 0.0));
    return (1.0 - below) + q * down > 0.0;
  }
};

/// The root of the slope less `below` in [low, high], where it falls from above to below zero exactly once, from below:
/// by Newton steps, halving where one leaves the bracket.
double root_of_slope(const OddCurve& curve, double below, double low, double high) {
  double q = 0.5 * (low + high);
  for (int i = 0; i < 200 && high - low > 1e-16 * high; ++i) {
    const double slope = curve.slope(q, below);
    (slope > 0.0 ? low : high) = q;
    double next = q - slope / curve.slope_by_q(q);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (next <= low || next >= high) break;
    if (std::abs(next - q) <= 1e-15 * q) {
      const double inside = next * kInside;  // Newton may come from either side
      return curve.slope(inside, below) > 0.0 ? inside : low;
    }
    q = next;
  }
  return low;
}

/// The smallest x > 0 with B'(x) = below, kUnboundedRadius where there is none. below < 1
double first_slope(const OddCurve& curve, double below) {
  if (curve.surely_above(kMaxSquare, below)) return kUnboundedRadius;
  if (curve.k3 == 0.0) {  // 1 + 3 k1 q + 5 k2 q^2, its smallest positive root in the form that never cancels
    const double discriminant = 9.0 * curve.k1 * curve.k1 - 20.0 * curve.k2 * (1.0 - below);
    if (!(discriminant >= 0.0)) return kUnboundedRadius;
    const double root = std::sqrt(discriminant);
    const double divisor = root - 3.0 * curve.k1;
    const double q = divisor > 0.0 ? 2.0 * (1.0 - below) / divisor : kMaxSquare;
    return q < kMaxSquare ? std::sqrt(q) * kInside : kUnboundedRadius;
  }
  // The slope is a cubic in q = x^2; between its own turning points (3 k1 + 10 k2 q + 21 k3 q^2 = 0) it is monotonic,
  // so the first of these at or below zero ends the interval that holds the first root.
  double stations[3] = {kMaxSquare, kMaxSquare, kMaxSquare};
  const double discriminant = 25.0 * curve.k2 * curve.k2 - 63.0 * curve.k1 * curve.k3;
  if (discriminant >= 0.0) {
    // Numerically stable pair of roots of 21 k3 q^2 + 10 k2 q + 3 k1.
    const double root = std::sqrt(discriminant);
    const double half = -(5.0 * curve.k2 + (curve.k2 < 0.0 ? -root : root));
    const double q1 = half / (21.0 * curve.k3);
    const double q2 = half != 0.0 ? 3.0 * curve.k1 / half : -1.0;
    if (q1 > 0.0 && q1 < kMaxSquare) stations[0] = q1;
    if (q2 > 0.0 && q2 < kMaxSquare) stations[1] = q2;
    if (stations[1] < stations[0]) std::swap(stations[0], stations[1]);
  }
  double low = 0.0;
  for (const double high : stations) {
    if (!(curve.slope(high, below) > 0.0)) return std::sqrt(root_of_slope(curve, below, low, high));
    low = high;
  }
  return kUnboundedRadius;
}

/// x in [0, limit] with B(x) = image, where B grows all the way; limit where it does not get there.
double inverse_of(const OddCurve& curve, double image, double limit, double tolerance) {
  if (!(image < limit * curve.factor(limit * limit))) return limit;
  double low = 0.0;
  double high = limit;
  double x = std::min(image, high);
  for (int i = 0; i < 100; ++i) {
    const double error = x * curve.factor(x * x) - image;
    (error > 0.0 ? high : low) = x;
    double next = x - error / curve.slope(x * x);
    if (!(next > low && next < high)) next = 0.5 * (low + high);  // Newton left the bracket
    if (std::abs(next - x) <= tolerance * next) return next;
    x = next;
  }
  return x;
}

/// Distorted radius at which an inverse model's curve ends; the division's with k1 < 0 comes near it only at infinity.
double distorted_end(const Camera& c) {
  if (c.model == DistortionModel::polynomial) return first_slope(OddCurve(c), 0.0);
  return c.k1 == 0.0 ? kUnboundedRadius : std::min(kUnboundedRadius, 1.0 / std::sqrt(std::abs(c.k1)));
}

/// r of an inverse model at r_d below distorted_end().
double ideal_radius(const Camera& c, double r_d) {
  const double q_d = r_d * r_d;
  return c.model == DistortionModel::polynomial ? r_d * OddCurve(c).factor(q_d) : r_d / (1.0 + c.k1 * q_d);
}

/// r_d of the polynomial.
double polynomial_radius(const Camera& c, double r) { return inverse_of(OddCurve(c), r, distorted_end(c), 1e-15); }

/// sqrt(1 - 4 k1 q), which is (1 - k1 r_d^2) / (1 + k1 r_d^2).
double division_root(const Camera& c, double q) {
  return std::sqrt(std::max(1.0 - 4.0 * c.k1 * q, kSmallestSlope * kSmallestSlope));
}

/// radius_of_slope() of the division model. With t = k1 r_d^2 the slope is (1 + t)^2 / (1 - t), which falls from 1 to 0
/// at t = -1 and rises from 1 to infinity at t = 1.
double division_radius_of_slope(const Camera& c, double slope) {
  if (c.k1 == 0.0) return kUnboundedRadius;
  const double t = c.k1 < 0.0 ? -2.0 * (1.0 - slope) / (2.0 + slope + std::sqrt(slope * (slope + 8.0)))
                              : 2.0 * (1.0 - slope) / (1.0 + 2.0 * slope + std::sqrt(1.0 + 8.0 * slope));
  if (!(1.0 + t > 0.0)) return kUnboundedRadius;
  return std::min(kUnboundedRadius, std::sqrt(t / c.k1) / (1.0 + t) * kInside);
}

/// radius_of_slope() of the polynomial, whose slope is 1 / B'(r_d).
double polynomial_radius_of_slope(const Camera& c, double slope) {
  double r_d = first_slope(OddCurve(c), slope);
  if (slope > 0.0) {  // where B' rises to 1 / slope, 2 - B' falls to 2 - 1 / slope
    r_d = std::min(r_d, first_slope(OddCurve(-c.k1, -c.k2, -c.k3), 2.0 - 1.0 / slope));
  }
  return std::min(kUnboundedRadius, ideal_radius(c, r_d));
}

}  // namespace

double valid_radius(const Camera& c) { return radius_of_slope(c, 0.0); }

double radius_of_slope(const Camera& c, double slope) {
  switch (c.model) {
    case DistortionModel::brown: return first_slope(OddCurve(c), slope);
    case DistortionModel::polynomial: return polynomial_radius_of_slope(c, slope);
    case DistortionModel::division: return division_radius_of_slope(c, slope);
  }
  return kUnboundedRadius;
}

bool surely_inside(const Camera& c, double q) {
  if (c.model == DistortionModel::brown) return OddCurve(c).surely_above(q);
  return c.model == DistortionModel::division ? c.k1 <= 0.0 : c.k1 >= 0.0 && c.k2 >= 0.0 && c.k3 >= 0.0;
}

RadialFactor inverse_radial_at(const Camera& c, double q) {
  if (c.model == DistortionModel::division) {
    const double root = division_root(c, q);
    const double value = 2.0 / (1.0 + root);
    return {value, c.k1 * value * value / root};
  }
  const OddCurve curve(c);
  const double r_d = polynomial_radius(c, std::sqrt(q));
  const double q_d = r_d * r_d;
  const double value = 1.0 / curve.factor(q_d);
  const double slope = std::max(curve.slope(q_d), kSmallestSlope);
  return {value, -value * value * value * curve.factor_by_q(q_d) / slope};
}

Vec3 inverse_radial_gradient(const Camera& c, double q) {
  if (c.model == DistortionModel::division) {
    const double root = division_root(c, q);
    const double value = 2.0 / (1.0 + root);
    return {q * value * value / root, 0.0, 0.0};
  }
  const OddCurve curve(c);
  const double r_d = polynomial_radius(c, std::sqrt(q));
  const double q_d = r_d * r_d;
  const double slope = std::max(curve.slope(q_d), kSmallestSlope);
  const double by_k1 = -q_d / (curve.factor(q_d) * slope);  // B(r_d; k) = r stays: dr_d = -r_d^3 dk1 / B'
  return {by_k1, by_k1 * q_d, by_k1 * q_d * q_d};
}

double undistort_radius(const Camera& c, double distorted_radius, double radius_limit, double tolerance) {
  if (c.model == DistortionModel::brown) {
    return inverse_of(OddCurve(c), distorted_radius, radius_limit, tolerance);
  }
  if (!(distorted_radius < distorted_end(c))) return radius_limit;
  return std::min(radius_limit, ideal_radius(c, distorted_radius));
}

}  // namespace lecalib
