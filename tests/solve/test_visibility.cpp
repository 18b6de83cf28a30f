// SPDX-License-Identifier: MIT
#include "lecalib/solve/visibility.hpp"

#include <doctest/doctest.h>

#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

TEST_CASE("depth, cost and domain of the points of a view") {
  Rng rng(1);
  test::SyntheticViews s;
  s.camera = test::make_camera(400.0, 400.0, 319.5, 239.5);
  s.model = test::box_edges(1.0, 0.8, 0.6);
  const Pose pose = make_pose(so3_exp(Vec3(0.3, 0.4, 0.0)), Vec3(-0.4, -0.3, 3.0));
  s.add_view(pose, 3, 0.0, 1.0, rng);
  Visibility seen;
  add_visibility(s.data(), s.views[0], s.camera, pose, 100.0, &seen);
  CHECK(seen.points == 36);
  CHECK(seen.in_front == 36);
  CHECK(seen.cost < 1e-12);
  CHECK(count_in_front(s.data(), s.views[0], s.camera, pose) == 36);

  // The same images come from the object mirrored through the camera's centre.
  Visibility mirrored;
  Mat3 R = rotation_of(pose);
  const Pose behind = make_pose(R, -translation_of(pose));
  test::SyntheticViews turned = s;
  for (ModelLine& line : turned.model) {
    for (int k = 0; k < 3; ++k) line.p[k] = -line.p[k], line.q[k] = -line.q[k];
  }
  add_visibility(turned.data(), s.views[0], s.camera, behind, 100.0, &mirrored);
  CHECK(mirrored.in_front == 0);
  CHECK(count_in_front(turned.data(), s.views[0], s.camera, behind) == 0);
  CHECK(mirrored.cost < 1e-12);

  Visibility off;
  Camera shifted = s.camera;
  shifted.cx += 3.0;
  shifted.cy += 4.0;
  add_visibility(s.data(), s.views[0], shifted, pose, 2.0, &off);
  CHECK(off.cost > 0.0);
  CHECK(off.cost <= 36 * 4.0);
  CHECK(count_inside(s.data(), s.views[0], s.camera) == 36);
  Camera folded = s.camera;
  folded.k1 = -1000.0;
  CHECK(count_inside(s.data(), s.views[0], folded) < 36);
}

}  // namespace
}  // namespace lecalib
