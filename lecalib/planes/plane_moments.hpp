// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/core/event_cloud.hpp"

namespace lecalib {

/// Sums over points from which the covariance of [Liu24] eq. 1 follows; additive, so that a growing region's plane
/// costs O(1) a point. Float keeps its digits only when points are given relative to an origin near by.
struct PlaneMoments {
  float n = 0;
  float x = 0, y = 0, z = 0;
  float xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;

  void add(float px, float py, float pz) noexcept {
    n += 1;
    x += px;
    y += py;
    z += pz;
    xx += px * px;
    xy += px * py;
    xz += px * pz;
    yy += py * py;
    yz += py * pz;
    zz += pz * pz;
  }
};

/// A plane through points and how they lie about it.
struct PlaneFit {
  Point3 centre;      ///< mean of the points, relative to the moments' origin
  Point3 normal;      ///< unit, the smallest eigenvalue's direction
  float variance[3];  ///< eigenvalues, ascending, px^2
};

/// Total least squares: mean, and the eigenvectors of the covariance ([Liu24] eq. 1). The normal's (x, y) part points
/// to the right, or straight down, so that equal planes have equal normals.
/// @return false for fewer than three points; *out is then unchanged
bool fit_plane(const PlaneMoments& moments, PlaneFit* out);

}  // namespace lecalib
