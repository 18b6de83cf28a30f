// SPDX-License-Identifier: MIT
#include "lecalib/host/simulator_renderer.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/camera_model.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib::host {
namespace {

constexpr int kRays = 34;
constexpr double kEdgeStep = 0.75;  ///< px between the points at which an outline marks pixels
constexpr double kNear = 1e-3;      ///< m; what is nearer to the camera's plane is not marked

/// Integral of the centred cubic B-spline up to x: a sum of truncated powers.
double spline_cdf(double x) {
  constexpr double kBinomial[] = {1, -4, 6, -4, 1};
  double sum = 0;
  for (int k = 0; k < 5; ++k) {
    const double d = std::max(0.0, x + 2.0 - k);
    sum += kBinomial[k] * d * d * d * d;
  }
  return sum / 24.0;
}

double spline_quantile(double probability) {
  double low = -2, high = 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (spline_cdf(middle) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// The Fibonacci lattice: evenly spread in the plane and, unlike a grid, in both of its projections.
std::vector<Vec2> ray_offsets() {
  constexpr int kGenerator = 21;  // the Fibonacci number before kRays
  std::vector<Vec2> offsets;
  for (int i = 0; i < kRays; ++i) {
    const int j = i * kGenerator % kRays;
    offsets.emplace_back(spline_quantile((i + 0.5) / kRays), spline_quantile((j + 0.5) / kRays));
  }
  return offsets;
}

/// Cuts [a, b] to low <= value(a + s (b - a)) <= high for one coordinate. @return false when nothing is left
bool clip(double from, double change, double low, double high, double* s0, double* s1) {
  if (change == 0.0) return from >= low && from <= high;
  const double at_low = (low - from) / change;
  const double at_high = (high - from) / change;
  *s0 = std::max(*s0, std::min(at_low, at_high));
  *s1 = std::min(*s1, std::max(at_low, at_high));
  return *s0 <= *s1;
}

}  // namespace

Renderer::Renderer(const Scene& scene, const Camera& camera) : scene_(scene), camera_(camera), offsets_(ray_offsets()) {
  for (const Vec2& offset : offsets_) reach_ = std::max(reach_, offset.cwiseAbs().maxCoeff());
  reach_ += 0.5 * kEdgeStep;
  prepare_rays();
  prepare_figures();
  const std::size_t pixels = rays_.size();
  radiance_.assign(pixels, kVoidRadiance);
  stamp_.assign(pixels, 0);
}

void Renderer::prepare_rays() {
  constexpr double kStep = 0.25;  // px, for the derivative of the ray
  ideal_min_ = Vec2::Constant(1e30);
  ideal_max_ = Vec2::Constant(-1e30);
  for (int y = 0; y < camera_.height; ++y) {
    for (int x = 0; x < camera_.width; ++x) {
      Vec2 center, left, right, above, below;
      const bool defined = unproject(camera_, Vec2(x, y), &center) && unproject(camera_, Vec2(x - kStep, y), &left) &&
                           unproject(camera_, Vec2(x + kStep, y), &right) &&
                           unproject(camera_, Vec2(x, y - kStep), &above) &&
                           unproject(camera_, Vec2(x, y + kStep), &below);
      if (!defined) {
        rays_.push_back({0, 0, 0, 0, 0, 0, false});
        continue;
      }
      const Vec2 du = (right - left) / (2 * kStep), dv = (below - above) / (2 * kStep);
      const Eigen::Matrix<float, 6, 1> f =
          (Vec6() << center(0), center(1), du(0), dv(0), du(1), dv(1)).finished().cast<float>();
      rays_.push_back({f(0), f(1), f(2), f(3), f(4), f(5), true});
      const Vec2 margin = (reach_ + 1.0) * (du.cwiseAbs() + dv.cwiseAbs());
      ideal_min_ = ideal_min_.cwiseMin(center - margin);
      ideal_max_ = ideal_max_.cwiseMax(center + margin);
    }
  }
}

void Renderer::prepare_figures() {
  for (const Face& face : scene_.faces) {
    first_figure_.push_back(figures_.size());
    for (const Figure& figure : face.figures) {
      FigureView view{1e30, -1e30, 1e30, -1e30, half_planes_.size(), figure.corners.size(), figure.radiance};
      for (std::size_t i = 0; i < figure.corners.size(); ++i) {
        const Vec2& p = figure.corners[i];
        const Vec2 along = figure.corners[(i + 1) % figure.corners.size()] - p;
        half_planes_.push_back({-along(1), along(0), along(1) * p(0) - along(0) * p(1)});
        view.u_min = std::min(view.u_min, p(0));
        view.u_max = std::max(view.u_max, p(0));
        view.v_min = std::min(view.v_min, p(1));
        view.v_max = std::max(view.v_max, p(1));
      }
      figures_.push_back(view);
    }
  }
  first_figure_.push_back(figures_.size());
}

Span<const std::uint32_t> Renderer::render(const Pose& pose) {
  ++pose_;
  place(pose);
  marked_before_.swap(marked_);
  marked_.clear();
  mark_outlines(pose);
  changed_ = marked_;
  for (const std::uint32_t pixel : marked_before_) {
    if (stamp_[pixel] != pose_) changed_.push_back(pixel);
  }
  if (pose_ == 1) {
    changed_.resize(rays_.size());
    for (std::size_t i = 0; i < changed_.size(); ++i) changed_[i] = static_cast<std::uint32_t>(i);
  }
  for (const std::uint32_t pixel : changed_) radiance_[pixel] = pixel_radiance(rays_[pixel]);
  return changed_;
}

/// The ray's direction in the world is w = R' (x, y, 1), the camera stands at c: with the face's plane n (c - o + k w)
/// = 0 its depth is k = n (o - c) / (n w), and u = u0 (c - o) + k (u0 w); both times n w are linear in the ray.
void Renderer::place(const Pose& pose) {
  const Mat3 R = rotation_of(pose);
  const Vec3 center = -R.transpose() * translation_of(pose);
  views_.clear();
  for (std::size_t i = 0; i < scene_.faces.size(); ++i) {
    const Face& face = scene_.faces[i];
    const Vec3 from_face = center - face.origin;
    const double height = face.normal().dot(from_face);
    if (height <= 0.0) continue;  // seen from behind
    const Vec3 depth = R * face.normal();
    const Vec3 u = face.u.dot(from_face) * depth - height * (R * face.u);
    const Vec3 v = face.v.dot(from_face) * depth - height * (R * face.v);
    views_.push_back({&face, u, v, depth, first_figure_[i]});
  }
  rods_.clear();
  for (const Rod& rod : scene_.rods) {
    const Vec3 p = R * rod.p + translation_of(pose);
    const Vec3 along = R * (rod.q - rod.p);
    rods_.push_back({p, along, p.cross(along), rod.radius, rod.radiance});
  }
}

void Renderer::mark_outlines(const Pose& pose) {
  const Mat3 R = rotation_of(pose);
  const Vec3 t = translation_of(pose);
  const auto mark_polygon = [&](const Face& face, const std::vector<Vec2>& corners) {
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vec3 p = face.point(corners[i]);
      const Vec3 q = face.point(corners[(i + 1) % corners.size()]);
      mark_edge(R * p + t, R * q + t, 0.0);
    }
  };
  for (const FaceView& view : views_) {
    const Face& face = *view.face;
    mark_polygon(face, {{0, 0}, {face.width, 0}, {face.width, face.height}, {0, face.height}});
    for (const Figure& figure : face.figures) mark_polygon(face, figure.corners);
  }
  for (const RodView& rod : rods_) mark_edge(rod.p, rod.p + rod.along, rod.radius);
}

/// A straight edge stays straight in ideal coordinates: cut it to the field of view there, then walk along it.
void Renderer::mark_edge(const Vec3& p_cam, const Vec3& q_cam, double half_width) {
  double s0 = 0, s1 = 1;
  if (!clip(p_cam(2), q_cam(2) - p_cam(2), kNear, 1e30, &s0, &s1)) return;
  const Vec3 p = p_cam + s0 * (q_cam - p_cam), q = p_cam + s1 * (q_cam - p_cam);
  const double focal = std::max(camera_.fx, camera_.fy);
  const double half_width_px = half_width * focal / std::max(kNear, std::min(p(2), q(2)));
  const Vec2 a = p.head<2>() / p(2);
  const Vec2 change = q.head<2>() / q(2) - a;
  const Vec2 margin = Vec2::Constant(half_width_px / focal);
  s0 = 0;
  s1 = 1;
  for (int i = 0; i < 2; ++i) {
    if (!clip(a(i), change(i), ideal_min_(i) - margin(i), ideal_max_(i) + margin(i), &s0, &s1)) return;
  }
  const double length_px = (s1 - s0) * change.norm() * focal;
  const int steps = static_cast<int>(length_px / kEdgeStep) + 1;
  for (int i = 0; i <= steps; ++i) {
    const Vec2 at = a + (s0 + (s1 - s0) * i / steps) * change;
    Vec2 pixel;
    if (project(camera_, Vec3(at(0), at(1), 1.0), &pixel)) mark_around(pixel, reach_ + half_width_px);
  }
}

void Renderer::mark_around(const Vec2& pixel, double reach) {
  const auto first = [&](double at) { return static_cast<int>(std::ceil(std::max(at - reach, 0.0))); };
  const auto last = [&](double at, int side) { return static_cast<int>(std::floor(std::min(at + reach, side - 1.0))); };
  if (pixel.minCoeff() < -reach || pixel(0) > camera_.width + reach || pixel(1) > camera_.height + reach) return;
  for (int y = first(pixel(1)); y <= last(pixel(1), camera_.height); ++y) {
    for (int x = first(pixel(0)); x <= last(pixel(0), camera_.width); ++x) {
      mark(static_cast<std::uint32_t>(y * camera_.width + x));
    }
  }
}

void Renderer::mark(std::uint32_t pixel) {
  if (stamp_[pixel] == pose_) return;
  stamp_[pixel] = pose_;
  marked_.push_back(pixel);
}

float Renderer::pixel_radiance(const PixelRay& ray) const {
  if (!ray.defined) return kVoidRadiance;
  float sum = 0;
  for (const Vec2& offset : offsets_) {
    const double u = offset(0), v = offset(1);
    const double x =
        static_cast<double>(ray.x) + static_cast<double>(ray.dx_du) * u + static_cast<double>(ray.dx_dv) * v;
    const double y =
        static_cast<double>(ray.y) + static_cast<double>(ray.dy_du) * u + static_cast<double>(ray.dy_dv) * v;
    sum += ray_radiance(x, y);
  }
  return sum / kRays;
}

float Renderer::ray_radiance(double x, double y) const {
  for (const RodView& rod : rods_) {
    if (meets(rod, Vec3(x, y, 1.0))) return rod.radiance;
  }
  for (const FaceView& view : views_) {
    const double depth = view.depth(0) * x + view.depth(1) * y + view.depth(2);
    if (depth >= 0.0) continue;
    const double u = view.u(0) * x + view.u(1) * y + view.u(2);
    const double v = view.v(0) * x + view.v(1) * y + view.v(2);
    if (u > 0.0 || v > 0.0 || u < view.face->width * depth || v < view.face->height * depth) continue;  // beside it
    return figure_radiance(view, u / depth, v / depth);
  }
  return kVoidRadiance;
}

/// Whether the ray from the origin passes the rod within its radius. |ray . moment| / |ray x along| is how far the two
/// straight lines pass each other; only few rays need the nearest points themselves.
bool Renderer::meets(const RodView& rod, const Vec3& ray) {
  const Vec3 &p = rod.p, &along = rod.along;
  const double radius = rod.radius;
  const double rr = ray.squaredNorm(), ra = ray.dot(along), aa = along.squaredNorm();
  const double determinant = rr * aa - ra * ra;
  const double passing = ray.dot(rod.moment);
  if (passing * passing > radius * radius * determinant) return false;
  const double rp = ray.dot(p), ap = along.dot(p);
  const double s = determinant > 0 ? std::clamp((ra * rp - rr * ap) / determinant, 0.0, 1.0) : 0.0;
  const Vec3 on_rod = p + s * along;
  const double depth = std::max(0.0, ray.dot(on_rod) / rr);
  return (depth * ray - on_rod).squaredNorm() <= radius * radius;
}

float Renderer::figure_radiance(const FaceView& view, double u, double v) const {
  for (std::size_t i = view.first_figure + view.face->figures.size(); i-- > view.first_figure;) {
    const FigureView& figure = figures_[i];
    if (u < figure.u_min || u > figure.u_max || v < figure.v_min || v > figure.v_max) continue;
    const HalfPlane* side = half_planes_.data() + figure.first_side;
    std::size_t inside = 0;
    while (inside < figure.sides && side[inside].a * u + side[inside].b * v + side[inside].c >= 0.0) ++inside;
    if (inside == figure.sides) return figure.radiance;
  }
  return view.face->radiance;
}

}  // namespace lecalib::host
