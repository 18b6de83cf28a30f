// SPDX-License-Identifier: MIT
#include "lecalib/math/plane_homography.hpp"

#include <cmath>

#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// The two equations a (1/fx^2) + b (1/fy^2) = c of orthogonal and of equally long columns.
struct FocalEquations {
  Eigen::Matrix2d A;
  Vec2 c;
};

FocalEquations focal_equations(const Mat3& G) {
  const Vec3 g = G.col(0);
  const Vec3 h = G.col(1);
  FocalEquations e;
  e.A << g(0) * h(0), g(1) * h(1), g(0) * g(0) - h(0) * h(0), g(1) * g(1) - h(1) * h(1);
  e.c << -g(2) * h(2), h(2) * h(2) - g(2) * g(2);
  return e;
}

}  // namespace

Vec3 line_through(const Vec2& p, const Vec2& q) {
  const Vec2 d = q - p;
  const double length = d.norm();
  if (!(length > 0.0)) return Vec3::Zero();
  const Vec2 n(-d(1) / length, d(0) / length);
  return {n(0), n(1), -n.dot(0.5 * (p + q))};
}

void add_focal_equations(const Mat3& H, Eigen::Matrix2d* AtA, Vec2* Atc) {
  const FocalEquations e = focal_equations(H / H.leftCols<2>().norm());
  *AtA += e.A.transpose() * e.A;
  *Atc += e.A.transpose() * e.c;
}

bool solve_focal_lengths(const Eigen::Matrix2d& AtA, const Vec2& Atc, double* fx, double* fy) {
  const double determinant = AtA.determinant();
  const double trace = AtA.trace();
  if (!(determinant > 1e-12 * trace * trace)) return false;
  const double wx = (AtA(1, 1) * Atc(0) - AtA(0, 1) * Atc(1)) / determinant;
  const double wy = (AtA(0, 0) * Atc(1) - AtA(1, 0) * Atc(0)) / determinant;
  if (!(wx > 0.0 && wy > 0.0) || !std::isfinite(wx + wy)) return false;
  *fx = 1.0 / std::sqrt(wx);
  *fy = 1.0 / std::sqrt(wy);
  return true;
}

bool solve_focal_length(const Eigen::Matrix2d& AtA, const Vec2& Atc, double* f) {
  const double w = Atc.sum() / AtA.sum();  // the equations with wx = wy
  if (!(w > 0.0) || !std::isfinite(w)) return false;
  *f = 1.0 / std::sqrt(w);
  return true;
}

Pose pose_from_homography(const Mat3& H, const Camera& camera, const Vec2& visible) {
  Mat3 G = H;
  G.row(0) = (H.row(0) - camera.cx * H.row(2)) / camera.fx;
  G.row(1) = (H.row(1) - camera.cy * H.row(2)) / camera.fy;
  double scale = 2.0 / (G.col(0).norm() + G.col(1).norm());
  if (G.row(2).dot(Vec3(visible(0), visible(1), 1.0)) < 0.0) scale = -scale;
  G *= scale;
  Mat3 A;
  A << G.col(0), G.col(1), Vec3(G.col(0)).cross(Vec3(G.col(1)));
  return make_pose(nearest_rotation(A), G.col(2));
}

}  // namespace lecalib
