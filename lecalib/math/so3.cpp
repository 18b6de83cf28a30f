// SPDX-License-Identifier: MIT
#include "lecalib/math/so3.hpp"

#include <cmath>

#include "lecalib/math/jacobi_eigen.hpp"
#include "lecalib/math/trigonometry.hpp"

namespace lecalib {
namespace {

/// Below this |w| the series of sin(a)/a and (1 - cos a)/a^2 to their second term are exact to rounding.
constexpr double kSmallAngle = 1e-4;

/// Matrix of a unit quaternion (w, x, y, z).
Mat3 from_quaternion(const Eigen::Vector4d& q) {
  const double w = q(0), x = q(1), y = q(2), z = q(3);
  Mat3 R;
  R << 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),  //
      2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),   //
      2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y);
  return R;
}

/// Unit quaternion with w >= 0, from the largest of its four squares, so that no difference of near numbers is divided
/// by a small one (Shepperd 1978).
Eigen::Vector4d to_quaternion(const Mat3& R) {
  Eigen::Vector4d square;  // 4 w^2, 4 x^2, 4 y^2, 4 z^2
  square << 1.0 + R(0, 0) + R(1, 1) + R(2, 2), 1.0 + R(0, 0) - R(1, 1) - R(2, 2), 1.0 - R(0, 0) + R(1, 1) - R(2, 2),
      1.0 - R(0, 0) - R(1, 1) + R(2, 2);
  int largest = 0;
  square.maxCoeff(&largest);
  const Vec3 odd(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));   // 4 w (x, y, z)
  const Vec3 even(R(2, 1) + R(1, 2), R(0, 2) + R(2, 0), R(1, 0) + R(0, 1));  // 4 (y z, x z, x y)
  Eigen::Vector4d q;
  if (largest == 0) {
    q << square(0), odd;
  } else if (largest == 1) {
    q << odd(0), square(1), even(2), even(1);
  } else if (largest == 2) {
    q << odd(1), even(2), square(2), even(0);
  } else {
    q << odd(2), even(1), even(0), square(3);
  }
  q /= q.norm();
  if (q(0) < 0.0) q = -q;
  return q;
}

}  // namespace

Mat3 hat(const Vec3& a) {
  Mat3 A;
  A << 0.0, -a(2), a(1), a(2), 0.0, -a(0), -a(1), a(0), 0.0;
  return A;
}

Mat3 so3_exp(const Vec3& w) {
  const double angle2 = w.squaredNorm();
  const double angle = std::sqrt(angle2);
  double a = 1.0 - angle2 / 6.0;   // sin(angle) / angle
  double b = 0.5 - angle2 / 24.0;  // (1 - cos(angle)) / angle^2
  if (angle > kSmallAngle) {
    double sine = 0.0;
    double cosine = 1.0;
    sin_cos(0.5 * angle, &sine, &cosine);  // half the angle: 1 - cos = 2 sin^2(angle / 2) loses no digits
    a = 2.0 * sine * cosine / angle;
    b = 2.0 * sine * sine / angle2;
  }
  const Mat3 W = hat(w);
  return Mat3::Identity() + a * W + b * (W * W);
}

Vec3 so3_log(const Mat3& R) {
  const Eigen::Vector4d q = to_quaternion(R);
  const Vec3 v = q.tail<3>();
  const double sine = v.norm();
  const double scale = sine > 1e-9 ? 2.0 * arc_tan2(sine, q(0)) / sine : 2.0 / q(0);
  return scale * v;
}

Mat3 nearest_rotation(const Mat3& A) {
  // tr(R' A) = q' N q; its maximum over unit q is the eigenvector of N's largest eigenvalue.
  Eigen::Matrix4d N;
  const double xx = A(0, 0), yy = A(1, 1), zz = A(2, 2);
  N << xx + yy + zz, A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1),  //
      A(2, 1) - A(1, 2), xx - yy - zz, A(0, 1) + A(1, 0), A(0, 2) + A(2, 0),   //
      A(0, 2) - A(2, 0), A(0, 1) + A(1, 0), yy - xx - zz, A(1, 2) + A(2, 1),   //
      A(1, 0) - A(0, 1), A(0, 2) + A(2, 0), A(1, 2) + A(2, 1), zz - xx - yy;
  Eigen::Vector4d values;
  Eigen::Matrix4d vectors;
  jacobi_eigen(N, &values, &vectors);
  return from_quaternion(vectors.col(3) / vectors.col(3).norm());
}

}  // namespace lecalib
