// SPDX-License-Identifier: MIT
#include "lecalib/math/chance.hpp"

#include <cstdint>
#include <cstring>

namespace lecalib {

float natural_log(float x) {
  constexpr float kSmallest = 1.17549435e-38F;
  constexpr float kLn2 = 0.693147181F;
  if (!(x >= kSmallest)) x = kSmallest;
  std::uint32_t bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  int exponent = static_cast<int>(bits >> 23U) - 127;
  bits = (bits & 0x007FFFFFU) | 0x3F800000U;
  float mantissa = 0;
  std::memcpy(&mantissa, &bits, sizeof mantissa);
  if (mantissa > 1.41421356F) {  // into [sqrt(1/2), sqrt(2)], where the series is short
    mantissa *= 0.5F;
    ++exponent;
  }
  // ln m = 2 artanh y with y = (m - 1) / (m + 1), |y| < 0.172.
  const float y = (mantissa - 1) / (mantissa + 1);
  const float y2 = y * y;
  const float series = 2 * y * (1 + y2 * (1.0F / 3 + y2 * (1.0F / 5 + y2 * (1.0F / 7 + y2 * (1.0F / 9)))));
  return static_cast<float>(exponent) * kLn2 + series;
}

float evidence_against_chance(float events, float expected) {
  constexpr float kLeastExpected = 0.1F;
  if (events <= expected) return 0;
  const float mean = expected > kLeastExpected ? expected : kLeastExpected;
  if (events <= mean) return 0;
  // p(n) by Stirling's formula, which lies below n!, times the geometric series that bounds the rest of the tail.
  constexpr float kTwoPi = 6.28318531F;
  const float chernoff = events * natural_log(events / mean) - (events - mean);
  const float sharper =
      chernoff + 0.5F * natural_log(kTwoPi * events) + natural_log((events + 1 - mean) / (events + 1));
  return sharper > chernoff ? sharper : chernoff;
}

}  // namespace lecalib
