// SPDX-License-Identifier: MIT
/// Sine, cosine and arc tangent from + - * / and sqrt alone. The C library's differ in their last bit from target to
/// target (and with the processor's features on one target); a calibration must not.
#pragma once

namespace lecalib {

inline constexpr double kPi = 3.14159265358979323846;

constexpr double deg_to_rad(double degrees) noexcept { return degrees * (kPi / 180.0); }
constexpr double rad_to_deg(double radians) noexcept { return radians * (180.0 / kPi); }

/// Sine and cosine of `angle` rad, absolute error below 4e-16 for |angle| <= 1e5 (not a number beyond 1e9).
void sin_cos(double angle, double* sine, double* cosine) noexcept;

/// Angle of (x, y) in (-pi, pi], absolute error below 1e-15; 0 for (0, 0).
double arc_tan2(double y, double x) noexcept;

/// Tangent of half a field of view and the like: sine / cosine.
inline double tangent(double angle) noexcept {
  double sine = 0.0;
  double cosine = 1.0;
  sin_cos(angle, &sine, &cosine);
  return sine / cosine;
}

}  // namespace lecalib
