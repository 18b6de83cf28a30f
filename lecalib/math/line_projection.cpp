// SPDX-License-Identifier: MIT
#include "lecalib/math/line_projection.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

/// An error of s px along the line changes the residual by about s^2 / (2 radius of curvature): 1e-11 px here.
constexpr double kFootTolerancePx = 1e-4;
constexpr int kMaxFootSteps = 8;

/// Relative; the steps along the line do the rest.
constexpr double kStartTolerance = 1e-2;

/// Keeps the foot off the fold itself, where the image of a radial line has no tangent.
constexpr double kInsideFold = 0.9999;

/// A line's ideal image: origin + s direction, |s| <= half_length inside the valid radius.
struct IdealLine {
  Vec2 normal;
  Vec2 direction;
  Vec2 origin;   // the line's point nearest to the principal point
  double scale;  // moment = scale (normal, offset)
  double half_length;
};

bool make_ideal_line(const Vec3& moment, double radius_limit, IdealLine* out) {
  const Vec2 n = moment.head<2>();
  const double scale = n.norm();
  if (!(scale > 1e-12 * std::abs(moment(2)))) return false;
  const double offset = moment(2) / scale;
  const double limit = kInsideFold * radius_limit;
  if (!(std::abs(offset) < limit)) return false;
  out->normal = n / scale;
  out->direction = Vec2(-out->normal(1), out->normal(0));
  out->origin = -offset * out->normal;
  out->scale = scale;
  out->half_length = std::sqrt(limit * limit - offset * offset);
  return true;
}

/// The state of the search: a point of the ideal line with its image, relative to the measured pixel.
struct Candidate {
  Vec2 ideal;
  Vec2 offset_px;   // image - pixel
  Vec2 tangent_px;  // d(image)/ds
  Mat2 d_ideal;     // d(image)/d(ideal), px
};

void evaluate(const Camera& camera, const IdealLine& line, double s, const Vec2& pixel, Candidate* out) {
  out->ideal = line.origin + s * line.direction;
  const Vec2 distorted = distort(camera, out->ideal, &out->d_ideal);
  out->offset_px =
      Vec2(camera.fx * distorted(0) + camera.cx - pixel(0), camera.fy * distorted(1) + camera.cy - pixel(1));
  out->d_ideal.row(0) *= camera.fx;
  out->d_ideal.row(1) *= camera.fy;
  out->tangent_px = out->d_ideal * line.direction;
}

double starting_parameter(const Camera& camera, double radius_limit, const IdealLine& line, const Vec2& pixel) {
  const Vec2 distorted((pixel(0) - camera.cx) / camera.fx, (pixel(1) - camera.cy) / camera.fy);
  const double radius = distorted.norm();
  const double shrink = radius > 0.0 ? undistort_radius(camera, radius, radius_limit, kStartTolerance) / radius : 1.0;
  return std::clamp(shrink * line.direction.dot(distorted), -line.half_length, line.half_length);
}

bool search_foot(const Camera& camera, double radius_limit, const IdealLine& line, const Vec2& pixel, Candidate* best) {
  double s = starting_parameter(camera, radius_limit, line, pixel);
  for (int i = 0;; ++i) {
    evaluate(camera, line, s, pixel, best);
    const double speed2 = best->tangent_px.squaredNorm();
    if (!(speed2 > 0.0)) return false;
    const double next =
        std::clamp(s - best->tangent_px.dot(best->offset_px) / speed2, -line.half_length, line.half_length);
    const double moved2 = (next - s) * (next - s) * speed2;
    if (moved2 <= kFootTolerancePx * kFootTolerancePx || i == kMaxFootSteps) return true;
    s = next;
  }
}

Vec2 unit_normal(const Vec2& tangent) { return Vec2(-tangent(1), tangent(0)) / tangent.norm(); }

}  // namespace

CameraLine line_in_camera(const Mat3& R, const Vec3& t, const ModelLine& line) {
  const Vec3 p = R * Vec3(line.p[0], line.p[1], line.p[2]) + t;
  const Vec3 direction = R * Vec3(line.q[0] - line.p[0], line.q[1] - line.p[1], line.q[2] - line.p[2]);
  return {p.cross(direction), direction};
}

bool find_foot(const Camera& camera, double radius_limit, const CameraLine& line, const Vec2& pixel, LineFoot* foot) {
  IdealLine ideal;
  Candidate best;
  if (!make_ideal_line(line.moment, radius_limit, &ideal)) return false;
  if (!search_foot(camera, radius_limit, ideal, pixel, &best)) return false;
  *foot = {best.ideal, pixel + best.offset_px, unit_normal(best.tangent_px)};
  return true;
}

bool line_residual(const Camera& camera, double radius_limit, const CameraLine& line, const Vec2& pixel,
                   LineResidual* out) {
  IdealLine ideal;
  Candidate best;
  if (!make_ideal_line(line.moment, radius_limit, &ideal)) return false;
  if (!search_foot(camera, radius_limit, ideal, pixel, &best)) return false;
  const Vec2 normal = unit_normal(best.tangent_px);
  out->value_px = -normal.dot(best.offset_px);

  // The foot moves across the ideal line by -ideal.normal d(N . m~) / scale.
  const double gain = normal.dot(best.d_ideal * ideal.normal) / ideal.scale;
  const Vec3 m(best.ideal(0), best.ideal(1), 1.0);
  out->d_pose << gain * line.moment.cross(m).transpose(), gain * line.direction.cross(m).transpose();

  Mat25 d_coefficients;
  const Vec2 distorted = distort(camera, best.ideal, nullptr, &d_coefficients);
  out->d_intrinsics(0) = -normal(0) * distorted(0);
  out->d_intrinsics(1) = -normal(1) * distorted(1);
  out->d_intrinsics(2) = -normal(0);
  out->d_intrinsics(3) = -normal(1);
  out->d_intrinsics.tail<5>() =
      -(normal(0) * camera.fx * d_coefficients.row(0) + normal(1) * camera.fy * d_coefficients.row(1));
  return true;
}

}  // namespace lecalib
