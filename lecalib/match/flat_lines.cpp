// SPDX-License-Identifier: MIT
#include "lecalib/match/flat_lines.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/camera_model.hpp"

namespace lecalib {
namespace {

/// Smallest denominator of the division model that is trusted: beyond, points fly off to infinity.
constexpr double kMinDenominator = 0.1;
/// Stands for "the border is not seen" in a FlatFrame.
constexpr double kNoBorderPx = 1e6;
/// Radii at which two lens models are compared.
constexpr int kFitRadii = 32;

template <class Flatten>
void flatten_each(Span<const EventLine> lines, Span<FlatLine> out, const Flatten& flatten_point) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    FlatLine& flat = out[i];
    const EventLine& line = lines[i];
    flat.usable = true;
    flat.sigma_px = static_cast<double>(std::max(line.sigma_begin_px, line.sigma_end_px));
    for (std::size_t k = 0; k < kNumInstants; ++k) {
      Vec2 points[kLinePoints];
      line_points(line, static_cast<Instant>(k), points);
      for (std::size_t q = 0; q < kLinePoints; ++q) {
        Vec2 point = Vec2::Zero();
        flat.usable = flatten_point(points[q], &point) && flat.usable;
        flat.x[k][q] = point.x();
        flat.y[k][q] = point.y();
      }
    }
    const double dx = flat.x[1][2] - flat.x[1][0];
    const double dy = flat.y[1][2] - flat.y[1][0];
    flat.length_px = std::sqrt(dx * dx + dy * dy);
    flat.usable = flat.usable && flat.length_px > 1.0;  // false for NaN too
  }
}

template <class Flatten>
FlatFrame frame_of(double cx, double cy, double width, double height, const Flatten& flatten_point) {
  FlatFrame frame{-kNoBorderPx, -kNoBorderPx, kNoBorderPx, kNoBorderPx};
  Vec2 flat;
  if (flatten_point(Vec2(0.0, cy), &flat)) frame.x0 = flat.x();
  if (flatten_point(Vec2(width - 1.0, cy), &flat)) frame.x1 = flat.x();
  if (flatten_point(Vec2(cx, 0.0), &flat)) frame.y0 = flat.y();
  if (flatten_point(Vec2(cx, height - 1.0), &flat)) frame.y1 = flat.y();
  return frame;
}

}  // namespace

void line_points(const EventLine& line, Instant instant, Vec2 points[kLinePoints]) {
  // Weight of the end's position: 0 at the window's begin, 1 at its end.
  const double w = 0.5 * static_cast<double>(instant);
  const Segment& a = line.begin;
  const Segment& b = line.end;
  points[0] = Vec2(a.x1, a.y1) * (1.0 - w) + Vec2(b.x1, b.y1) * w;
  points[2] = Vec2(a.x2, a.y2) * (1.0 - w) + Vec2(b.x2, b.y2) * w;
  const Vec2 chord = points[2] - points[0];
  const double length = chord.norm();
  points[1] = 0.5 * (points[0] + points[2]);
  if (length > 0) points[1] += Vec2(-chord.y(), chord.x()) * (static_cast<double>(line.bend_px) / length);
}

bool flatten(const Lens& lens, const Vec2& pixel, Vec2* flat, Eigen::Matrix<double, 2, 3>* d_lens) {
  const Vec2 d = pixel - Vec2(lens.cx, lens.cy);
  const double r2 = d.squaredNorm();
  const double denominator = 1.0 + lens.lambda * r2;
  if (!(denominator >= kMinDenominator)) return false;
  const double scale = 1.0 / denominator;
  *flat = d * scale;
  if (d_lens != nullptr) {
    d_lens->col(0) = -d * (r2 * scale * scale);
    const Vec2 pull = d * (2.0 * lens.lambda * scale * scale);
    d_lens->col(1) = Vec2(-scale, 0.0) + pull * d.x();
    d_lens->col(2) = Vec2(0.0, -scale) + pull * d.y();
  }
  return true;
}

Vec2 unflatten(const Lens& lens, const Vec2& flat) {
  // r = r_d / (1 + lambda r_d^2) solved for r_d, the branch through 0, without cancellation.
  const double discriminant = 1.0 - 4.0 * lens.lambda * flat.squaredNorm();
  const double scale = 2.0 / (1.0 + std::sqrt(std::max(0.0, discriminant)));
  return flat * scale + Vec2(lens.cx, lens.cy);
}

void flatten_lines(const Lens& lens, Span<const EventLine> lines, Span<FlatLine> out) {
  flatten_each(lines, out, [&lens](const Vec2& pixel, Vec2* flat) { return flatten(lens, pixel, flat); });
}

void flatten_lines(const Camera& camera, Span<const EventLine> lines, Span<FlatLine> out) {
  flatten_each(lines, out, [&camera](const Vec2& pixel, Vec2* flat) {
    if (!unproject(camera, pixel, flat)) return false;
    *flat *= camera.fx;
    return true;
  });
}

FlatFrame flat_frame(const Lens& lens, std::uint16_t width, std::uint16_t height) {
  return frame_of(lens.cx, lens.cy, width, height,
                  [&lens](const Vec2& pixel, Vec2* flat) { return flatten(lens, pixel, flat); });
}

FlatFrame flat_frame(const Camera& camera) {
  return frame_of(camera.cx, camera.cy, camera.width, camera.height, [&camera](const Vec2& pixel, Vec2* flat) {
    if (!unproject(camera, pixel, flat)) return false;
    *flat *= camera.fx;
    return true;
  });
}

Camera brown_camera(const Lens& lens, std::uint16_t width, std::uint16_t height, double radius_px) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = lens.f_px;
  camera.cx = lens.cx;
  camera.cy = lens.cy;
  // Least squares of r_d / r - 1 = k1 r^2 + k2 r^4, each radius weighted by r^2 (an error of scale is an error in px).
  Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
  Vec2 b = Vec2::Zero();
  for (int i = 1; i <= kFitRadii; ++i) {
    const double r_d = radius_px * i / kFitRadii;
    const double denominator = 1.0 + lens.lambda * r_d * r_d;
    if (denominator < kMinDenominator) break;
    const double r = r_d / denominator / lens.f_px;
    const Vec2 row(r * r * r, r * r * r * r * r);
    A += row * row.transpose();
    b += row * (r * (denominator - 1.0));
  }
  const double determinant = A.determinant();
  if (determinant > 1e-12 * A(0, 0) * A(1, 1)) {
    camera.k1 = (A(1, 1) * b(0) - A(0, 1) * b(1)) / determinant;
    camera.k2 = (A(0, 0) * b(1) - A(0, 1) * b(0)) / determinant;
  } else {
    camera.k1 = lens.lambda * lens.f_px * lens.f_px;
  }
  return camera;
}

Lens division_lens(const Camera& camera, double radius_px) {
  Lens lens{camera.fx, camera.cx, camera.cy, 0.0};
  double a = 0.0;
  double b = 0.0;
  for (int i = 1; i <= kFitRadii; ++i) {
    const double r_d = radius_px * i / kFitRadii;
    Vec2 ideal;
    if (!unproject(camera, Vec2(camera.cx + r_d, camera.cy), &ideal)) break;
    const double r = ideal.norm() * camera.fx;
    // r_d - r = lambda r r_d^2
    const double row = r * r_d * r_d;
    a += row * row;
    b += row * (r_d - r);
  }
  if (a > 0) lens.lambda = b / a;
  return lens;
}

}  // namespace lecalib
