// SPDX-License-Identifier: MIT
#include "lecalib/math/trigonometry.hpp"

#include <cmath>
#include <limits>

namespace lecalib {
namespace {

// pi/2 in three parts of 33 bits (Cody and Waite): k * part is exact for |k| < 2^20.
constexpr double kHalfPi1 = 1.57079632673412561417e+00;
constexpr double kHalfPi2 = 6.07710050630396597660e-11;
constexpr double kHalfPi3 = 2.02226624871116645580e-21;

/// Taylor series on |x| <= pi/4; the first term left out is below 1e-19.
double sine_series(double x) {
  const double x2 = x * x;
  double sum = 1.0 / 355687428096000.0;    // 1/17!
  sum = sum * x2 - 1.0 / 1307674368000.0;  // 1/15!
  sum = sum * x2 + 1.0 / 6227020800.0;     // 1/13!
  sum = sum * x2 - 1.0 / 39916800.0;       // 1/11!
  sum = sum * x2 + 1.0 / 362880.0;         // 1/9!
  sum = sum * x2 - 1.0 / 5040.0;           // 1/7!
  sum = sum * x2 + 1.0 / 120.0;            // 1/5!
  sum = sum * x2 - 1.0 / 6.0;              // 1/3!
  return x + x * (x2 * sum);
}

double cosine_series(double x) {
  const double x2 = x * x;
  double sum = 1.0 / 20922789888000.0;   // 1/16!
  sum = sum * x2 - 1.0 / 87178291200.0;  // 1/14!
  sum = sum * x2 + 1.0 / 479001600.0;    // 1/12!
  sum = sum * x2 - 1.0 / 3628800.0;      // 1/10!
  sum = sum * x2 + 1.0 / 40320.0;        // 1/8!
  sum = sum * x2 - 1.0 / 720.0;          // 1/6!
  sum = sum * x2 + 1.0 / 24.0;           // 1/4!
  sum = sum * x2 - 0.5;                  // 1/2!
  return 1.0 + x2 * sum;
}

/// Arc tangent of t in [0, 1]: the angle is halved twice, to at most pi/16, where eleven terms of the series suffice.
double arc_tangent_unit(double t) {
  for (int i = 0; i < 2; ++i) t = t / (1.0 + std::sqrt(1.0 + t * t));
  const double t2 = t * t;
  double sum = 0.0;
  for (int k = 21; k >= 3; k -= 2) {
    const double sign = (k / 2) % 2 == 0 ? 1.0 : -1.0;
    sum = t2 * (sign / k + sum);
  }
  return 4.0 * (t + t * sum);
}

}  // namespace

void sin_cos(double angle, double* sine, double* cosine) noexcept {
  if (!(std::abs(angle) <= 1e9)) {
    *sine = *cosine = std::numeric_limits<double>::quiet_NaN();
    return;
  }
  const double quadrant = std::floor(angle * (2.0 / kPi) + 0.5);
  const double x = ((angle - quadrant * kHalfPi1) - quadrant * kHalfPi2) - quadrant * kHalfPi3;
  const double s = sine_series(x);
  const double c = cosine_series(x);
  const double remainder = quadrant - 4.0 * std::floor(quadrant * 0.25);
  if (remainder == 0.0) {
    *sine = s, *cosine = c;
  } else if (remainder == 1.0) {
    *sine = c, *cosine = -s;
  } else if (remainder == 2.0) {
    *sine = -s, *cosine = -c;
  } else {
    *sine = -c, *cosine = s;
  }
}

double arc_tan2(double y, double x) noexcept {
  const double ax = std::abs(x);
  const double ay = std::abs(y);
  if (ax == 0.0 && ay == 0.0) return 0.0;
  double angle = ay <= ax ? arc_tangent_unit(ay / ax) : 0.5 * kPi - arc_tangent_unit(ax / ay);
  if (x < 0.0) angle = kPi - angle;
  return y < 0.0 ? -angle : angle;
}

}  // namespace lecalib
