// SPDX-License-Identifier: MIT
#include "lecalib/host/exponential.hpp"

#include <cmath>

namespace lecalib::host {
namespace {

// ln 2 in two parts: k * kLn2High is exact for |k| < 2^20.
constexpr double kLn2High = 6.93147180369123816490e-01;
constexpr double kLn2Low = 1.90821492927058770002e-10;
constexpr double kLn2 = 0.69314718055994530942;
constexpr double kRootHalf = 0.70710678118654752440;

}  // namespace

/// x = k ln 2 + r with |r| <= ln 2 / 2, where fourteen terms of the series suffice.
double exponential(double x) {
  const double k = std::floor(x / kLn2 + 0.5);
  const double r = (x - k * kLn2High) - k * kLn2Low;
  double sum = 1.0;
  for (int n = 13; n >= 1; --n) sum = 1.0 + sum * r / n;
  return std::ldexp(sum, static_cast<int>(k));
}

/// x = m 2^k with m in [1/sqrt(2), sqrt(2)); ln m = 2 artanh s with s = (m - 1) / (m + 1), |s| < 0.172.
double logarithm(double x) {
  int k = 0;
  double m = std::frexp(x, &k);
  if (m < kRootHalf) {
    m *= 2.0;
    --k;
  }
  const double s = (m - 1.0) / (m + 1.0);
  const double s2 = s * s;
  double sum = 0.0;
  for (int n = 21; n >= 3; n -= 2) sum = s2 * (1.0 / n + sum);
  return k * kLn2High + (2.0 * (s + s * sum) + k * kLn2Low);
}

}  // namespace lecalib::host
