// SPDX-License-Identifier: MIT
#include "lecalib/segments/plane_projection.hpp"

#include <cmath>

namespace lecalib {

bool make_plane_frame(const EventPlane& plane, PlaneFrame* out) {
  constexpr float kMinAcross = 1e-3F;  // below it the normal is the time axis
  const Point3& n = plane.normal;
  const float across = std::sqrt(n.x * n.x + n.y * n.y);
  if (!(across > kMinAcross)) return false;
  const Point3 v_x{-n.y / across, n.x / across, 0};
  out->origin = plane.centre;
  out->v_x = v_x;
  out->v_y = {v_x.y * n.z - v_x.z * n.y, v_x.z * n.x - v_x.x * n.z, v_x.x * n.y - v_x.y * n.x};
  return true;
}

void project_to_plane(const PlaneFrame& frame, Span<const Point3> points, Span<PlanePoint> out) {
  for (std::size_t i = 0; i < points.size(); ++i) out[i] = to_plane(frame, points[i]);
}

}  // namespace lecalib
