// SPDX-License-Identifier: MIT
#include "lecalib/planes/plane_moments.hpp"

#include "lecalib/math/eigen.hpp"
#include "lecalib/math/jacobi_eigen.hpp"

namespace lecalib {

bool fit_plane(const PlaneMoments& m, PlaneFit* out) {
  if (m.n < 3) return false;
  const float per_n = 1.0F / m.n;
  const float x = m.x * per_n;
  const float y = m.y * per_n;
  const float z = m.z * per_n;
  Eigen::Matrix3f covariance;
  covariance(0, 0) = m.xx * per_n - x * x;
  covariance(1, 1) = m.yy * per_n - y * y;
  covariance(2, 2) = m.zz * per_n - z * z;
  covariance(0, 1) = covariance(1, 0) = m.xy * per_n - x * y;
  covariance(0, 2) = covariance(2, 0) = m.xz * per_n - x * z;
  covariance(1, 2) = covariance(2, 1) = m.yz * per_n - y * z;
  Eigen::Vector3f values;
  Eigen::Matrix3f vectors;
  jacobi_eigen<float, 3>(covariance, &values, &vectors);
  const float sign = vectors(0, 0) < 0 || (vectors(0, 0) == 0 && vectors(1, 0) < 0) ? -1.0F : 1.0F;
  out->centre = {x, y, z};
  out->normal = {sign * vectors(0, 0), sign * vectors(1, 0), sign * vectors(2, 0)};
  for (int i = 0; i < 3; ++i) out->variance[i] = values(i) > 0 ? values(i) : 0;
  return true;
}

}  // namespace lecalib
