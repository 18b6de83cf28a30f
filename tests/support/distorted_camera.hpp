// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/core/records.hpp"

namespace lecalib::test {

/// 640 x 480, pixels not square and the principal point beside the centre, so that no mix-up of axes goes unseen.
inline Camera make_camera(double k1, double k2, double p1, double p2, double k3) {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = 410.0;
  camera.fy = 395.0;
  camera.cx = 322.0;
  camera.cy = 238.5;
  camera.k1 = k1;
  camera.k2 = k2;
  camera.p1 = p1;
  camera.p2 = p2;
  camera.k3 = k3;
  return camera;
}

}  // namespace lecalib::test
