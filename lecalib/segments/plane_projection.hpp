// SPDX-License-Identifier: MIT
/// Orthographic projection of an event plane's points onto the plane itself and back ([Liu24] eq. 2 and 3).
#pragma once

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/core/span.hpp"

namespace lecalib {

/// A point in a plane's own coordinates, px.
struct PlanePoint {
  float x, y;
};

/// A plane's coordinate system: origin p_c, axes v_x and v_y = v_x x n (eq. 2). [Liu24] leaves the point P_1 open that
/// v_x aims at; here it lies at the same time as p_c, so that v_x is the direction of the line at any one time and v_y
/// the direction in which it moves through space-time.
struct PlaneFrame {
  Point3 origin;
  Point3 v_x, v_y;  ///< unit; v_x has no z
};

/// @return false when the plane is one of constant time, which no line at one time spans
bool make_plane_frame(const EventPlane& plane, PlaneFrame* out);

/// Eq. 3: the part of (point - p_c) along the normal is left out.
inline PlanePoint to_plane(const PlaneFrame& frame, const Point3& point) noexcept {
  const float x = point.x - frame.origin.x;
  const float y = point.y - frame.origin.y;
  const float z = point.z - frame.origin.z;
  return {x * frame.v_x.x + y * frame.v_x.y + z * frame.v_x.z, x * frame.v_y.x + y * frame.v_y.y + z * frame.v_y.z};
}

/// The point of space-time at plane coordinates; inverse of to_plane on the plane.
inline Point3 from_plane(const PlaneFrame& frame, const PlanePoint& p) noexcept {
  return {frame.origin.x + p.x * frame.v_x.x + p.y * frame.v_y.x,
          frame.origin.y + p.x * frame.v_x.y + p.y * frame.v_y.y,
          frame.origin.z + p.x * frame.v_x.z + p.y * frame.v_y.z};
}

/// Projects points. @param[out] out [points.size()]
void project_to_plane(const PlaneFrame& frame, Span<const Point3> points, Span<PlanePoint> out);

}  // namespace lecalib
