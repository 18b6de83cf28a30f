// SPDX-License-Identifier: MIT
#include "lecalib/math/line_projection.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

/// An error of s px along the line changes the residual by about s^2 / (2 radius of curvature): 1e-11 px here.
constexpr double kFootTolerancePx = 1e-4;

/// Where the next search goes on from the step that this one leaves out, one evaluation does: the error of the
/// residual, 1e-6 px at most, shrinks by its square from one iteration to the next.
constexpr double kWarmTolerancePx = 1e-2;
constexpr int kMaxFootSteps = 40;

/// Share of Gauss-Newton's curvature below which the secant's is not trusted.
constexpr double kMinCurvature = 0.05;

/// Bounds of the radial factor that a start along the line trusts; the steps along the line do the rest.
constexpr double kMinStartFactor = 0.4;
constexpr double kMaxStartFactor = 2.5;

/// Keeps the foot off the fold itself, where the image of a radial line has no tangent.
constexpr double kInsideFold = 0.9999;

/// How far lines are followed, over the radius of the knee.
constexpr double kBeyondKnee = 1.5;

/// A point of the ideal line with its image, relative to the measured pixel.
struct Candidate {
  Vec2 ideal;
  RadialFactor radial;
  Vec2 distorted;
  Vec2 offset_px;   // image - pixel
  Vec2 tangent_px;  // d(image)/ds
};

/// How the image moves, px, when the ideal point moves along `direction`.
Vec2 image_motion(const Camera& c, const Candidate& at, const Vec2& direction) {
  const Vec2 moved = distorted_motion(c, at.ideal, at.radial, direction);
  return {c.fx * moved(0), c.fy * moved(1)};
}

void evaluate(const Camera& c, const IdealLine& line, double s, const Vec2& pixel, Candidate* out) {
  out->ideal = line.origin + s * line.direction;
  out->radial = radial_at(c, out->ideal.squaredNorm(), line.knee);
  out->distorted = distorted_point(c, out->ideal, out->radial);
  out->offset_px = Vec2(c.fx * out->distorted(0) + c.cx - pixel(0), c.fy * out->distorted(1) + c.cy - pixel(1));
  out->tangent_px = image_motion(c, *out, line.direction);
}

/// Where the roughly un-distorted pixel faces the line.
double starting_parameter(const Camera& camera, const IdealLine& line, const Vec2& pixel) {
  const Vec2 distorted((pixel(0) - camera.cx) / camera.fx, (pixel(1) - camera.cy) / camera.fy);
  const double factor = std::clamp(factor_seen_at(camera, distorted.squaredNorm()), kMinStartFactor, kMaxStartFactor);
  return line.direction.dot(distorted) / factor;
}

/// Where a search goes whose step left the bracket: to the line's own end, if that has not been seen, else half way.
double beyond_bracket(const IdealLine& line, double low, double high, double next) {
  if (next >= high && high == line.half_length) return high;
  if (next <= low && low == -line.half_length) return low;
  return 0.5 * (low + high);
}

/// @param[in,out] s where to begin, and the foot
bool search_foot(const Camera& camera, const IdealLine& line, const Vec2& pixel, double tolerance_px, double* s,
                 Candidate* best) {
  double low = -line.half_length;  // the foot is between these, or at the end of the line
  double high = line.half_length;
  *s = std::clamp(*s, low, high);
  double last_s = *s;
  double last_gradient = 0.0;
  for (int i = 0;; ++i) {
    evaluate(camera, line, *s, pixel, best);
    const double speed2 = best->tangent_px.squaredNorm();
    if (!(speed2 > 0.0)) return false;
    const double gradient = best->tangent_px.dot(best->offset_px);
    (gradient > 0.0 ? high : low) = *s;
    // Gauss-Newton's curvature first, then the secant's: near the fold the image bends within a few pixels.
    const double secant = i > 0 ? (gradient - last_gradient) / (*s - last_s) : speed2;
    double next = *s - gradient / (secant > kMinCurvature * speed2 ? secant : speed2);
    if (!(next > low && next < high)) next = beyond_bracket(line, low, high, next);
    last_s = *s;
    last_gradient = gradient;
    const double moved2 = (next - *s) * (next - *s) * speed2;
    *s = next;
    if (moved2 <= tolerance_px * tolerance_px || i == kMaxFootSteps) return true;
  }
}

Vec2 unit_normal(const Vec2& tangent) { return Vec2(-tangent(1), tangent(0)) / tangent.norm(); }

bool find_foot(const Camera& camera, const IdealLine& ideal, const Vec2& pixel, double tolerance_px, LineFoot* foot) {
  Candidate best;
  double s = starting_parameter(camera, ideal, pixel);
  if (!search_foot(camera, ideal, pixel, tolerance_px, &s, &best)) return false;
  *foot = {best.ideal, pixel + best.offset_px, unit_normal(best.tangent_px)};
  return true;
}

}  // namespace

CameraLine line_in_camera(const Mat3& R, const Vec3& t, const ModelLine& line) {
  const Vec3 p = R * Vec3(line.p[0], line.p[1], line.p[2]) + t;
  const Vec3 direction = R * Vec3(line.q[0] - line.p[0], line.q[1] - line.p[1], line.q[2] - line.p[2]);
  return {p.cross(direction), direction};
}

bool straightened_line(const CameraLine& line, double knee, IdealLine* out) {
  if (!ideal_line(line, kBeyondKnee * knee, out)) return false;
  out->knee = knee;
  return true;
}

bool ideal_line(const CameraLine& line, double radius_limit, IdealLine* out) {
  const Vec2 n = line.moment.head<2>();
  const double scale = n.norm();
  if (!(scale > 1e-12 * std::abs(line.moment(2)))) return false;
  const double offset = line.moment(2) / scale;
  const double limit = kInsideFold * radius_limit;
  if (!(std::abs(offset) < limit)) return false;
  out->normal = n / scale;
  out->direction = Vec2(-out->normal(1), out->normal(0));
  out->origin = -offset * out->normal;
  out->scale = scale;
  out->half_length = std::sqrt(limit * limit - offset * offset);
  out->knee = kUnboundedRadius;
  return true;
}

bool find_foot(const Camera& camera, double radius_limit, const CameraLine& line, const Vec2& pixel, LineFoot* foot) {
  IdealLine ideal;
  return ideal_line(line, radius_limit, &ideal) && find_foot(camera, ideal, pixel, kFootTolerancePx, foot);
}

bool find_foot(const Camera& camera, const IdealLine& ideal, const Vec2& pixel, LineFoot* foot) {
  return find_foot(camera, ideal, pixel, kWarmTolerancePx, foot);
}

bool line_residual(const Camera& camera, double radius_limit, const CameraLine& line, const Vec2& pixel,
                   LineResidual* out) {
  IdealLine ideal;
  float foot = kNoFoot;
  return ideal_line(line, radius_limit, &ideal) && line_residual(camera, line, ideal, pixel, &foot, out);
}

bool line_residual(const Camera& camera, const CameraLine& line, const IdealLine& ideal, const Vec2& pixel, float* foot,
                   LineResidual* out) {
  Candidate best;
  const bool cold = *foot == kNoFoot;
  double s = cold ? starting_parameter(camera, ideal, pixel) : static_cast<double>(*foot);
  if (!search_foot(camera, ideal, pixel, cold ? kFootTolerancePx : kWarmTolerancePx, &s, &best)) return false;
  *foot = static_cast<float>(s);
  const Vec2 normal = unit_normal(best.tangent_px);
  out->value_px = -normal.dot(best.offset_px);

  // The foot moves across the ideal line by -ideal.normal d(N . m~) / scale.
  const double gain = normal.dot(image_motion(camera, best, ideal.normal)) / ideal.scale;
  const Vec3 m(best.ideal(0), best.ideal(1), 1.0);
  out->d_pose << gain * line.moment.cross(m).transpose(), gain * line.direction.cross(m).transpose();

  out->d_intrinsics(0) = -normal(0) * best.distorted(0);
  out->d_intrinsics(1) = -normal(1) * best.distorted(1);
  out->d_intrinsics(2) = -normal(0);
  out->d_intrinsics(3) = -normal(1);
  out->d_intrinsics.tail<5>() =
      -distortion_gradient(camera, best.ideal, Vec2(normal(0) * camera.fx, normal(1) * camera.fy), ideal.knee);
  return true;
}

}  // namespace lecalib
