// SPDX-License-Identifier: MIT
#include "lecalib/solve/visibility.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/line_projection.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// |tangential part| <= 3 (|p1| + |p2|) r^2, and twice that is safe for points near it.
constexpr double kTangentialReach = 6.0;

/// Depth's sign of the point of `line` that is seen at m~ = (ideal, 1): X = z m~ and (X - X_p) x D = 0, so
/// z (m~ x D) = X_p x D, the line's moment.
bool is_in_front(const CameraLine& line, const Vec2& ideal) {
  return line.moment.dot(Vec3(ideal(0), ideal(1), 1.0).cross(line.direction)) > 0.0;
}

}  // namespace

void add_visibility(const CalibrationData& data, const View& view, const Camera& camera, const Pose& pose,
                    double cap_px, Visibility* sum) {
  const Mat3 R = rotation_of(pose);
  const Vec3 t = translation_of(pose);
  const double radius_limit = valid_radius(camera);
  const double cap2 = cap_px * cap_px;
  std::uint32_t held_line = 0xFFFFFFFFU;
  CameraLine line{};
  IdealLine ideal{};
  bool visible = false;
  for (std::size_t i = view.first; i < view.first + view.count; ++i) {
    if (is_left_out(data, i)) continue;
    const LinePoint& point = data.points[i];
    const Vec2 pixel(point.u_px, point.v_px);
    if (point.line != held_line) {
      held_line = point.line;
      line = line_in_camera(R, t, data.model[held_line]);
      visible = ideal_line(line, radius_limit, &ideal);
    }
    LineFoot foot;
    ++sum->points;
    if (!visible || !find_foot(camera, ideal, pixel, &foot)) {
      sum->cost += cap2;
      continue;
    }
    if (is_in_front(line, foot.ideal)) ++sum->in_front;
    sum->cost += std::min(cap2, (foot.pixel - pixel).squaredNorm());
  }
}

std::size_t count_in_front(const CalibrationData& data, const View& view, const Camera& camera, const Pose& pose) {
  const Mat3 R = rotation_of(pose);
  const Vec3 t = translation_of(pose);
  std::size_t count = 0;
  std::uint32_t held_line = 0xFFFFFFFFU;
  CameraLine line{};
  for (std::size_t i = view.first; i < view.first + view.count; ++i) {
    if (is_left_out(data, i)) continue;
    const LinePoint& point = data.points[i];
    if (point.line != held_line) {
      held_line = point.line;
      line = line_in_camera(R, t, data.model[held_line]);
    }
    if (is_in_front(line, roughly_undistorted(camera, Vec2(point.u_px, point.v_px)))) ++count;
  }
  return count;
}

std::size_t count_inside(const CalibrationData& data, const View& view, const Camera& camera) {
  std::size_t count = 0;
  const double radius_limit = valid_radius(camera);
  // Well inside the image of the fold there is nothing to solve for; p1, p2 move points by less than the margin.
  const double tangential = std::abs(camera.p1) + std::abs(camera.p2);
  const double fold = radius_limit * radial_at(camera, radius_limit * radius_limit).value;
  const double surely = fold - kTangentialReach * tangential * radius_limit * radius_limit;
  for (std::size_t i = view.first; i < view.first + view.count; ++i) {
    if (is_left_out(data, i)) continue;
    const LinePoint& point = data.points[i];
    Vec2 ideal;
    const Vec2 distorted((point.u_px - camera.cx) / camera.fx, (point.v_px - camera.cy) / camera.fy);
    if (distorted.norm() < surely) {
      ++count;
      continue;
    }
    if (unproject(camera, radius_limit, Vec2(point.u_px, point.v_px), &ideal)) ++count;
  }
  return count;
}

}  // namespace lecalib
