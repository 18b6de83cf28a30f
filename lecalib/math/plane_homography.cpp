// SPDX-License-Identifier: MIT
#include "lecalib/math/plane_homography.hpp"

#include <cmath>

#include "lecalib/math/dlt_system.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// Change of depth over the image, relative; below it the plane is fronto-parallel to rounding and f is not in H.
constexpr double kMinPerspective = 1e-7;

template <class First, class Second>
bool make_normaliser(Span<const PlaneLinePair> pairs, First first, Second second, Normaliser<2>* out) {
  for (const PlaneLinePair& pair : pairs) {
    out->add_to_centre(pair.*first);
    out->add_to_centre(pair.*second);
  }
  out->finish_centre();
  for (const PlaneLinePair& pair : pairs) {
    out->add_to_scale(pair.*first);
    out->add_to_scale(pair.*second);
  }
  return out->finish_scale();
}

/// Columns b1 b2 b3 scaled so that their sum is b4: maps the canonical basis and (1, 1, 1) to the four lines.
bool projective_basis(const Vec3 (&lines)[4], Mat3* basis) {
  Mat3 B;
  B << lines[0], lines[1], lines[2];
  const double determinant = B.determinant();
  const Vec3 weights(Vec3(lines[1].cross(lines[2])).dot(lines[3]), Vec3(lines[2].cross(lines[0])).dot(lines[3]),
                     Vec3(lines[0].cross(lines[1])).dot(lines[3]));
  // Each is the determinant of three of the four lines: zero when they meet in one point.
  if (!(weights.cwiseAbs().minCoeff() > 1e-9) || !(std::abs(determinant) > 1e-9)) return false;
  *basis = B * Vec3(weights / determinant).asDiagonal();
  return true;
}

/// H with the principal point moved to the origin.
Mat3 centred(const Mat3& H, double cx, double cy) {
  Mat3 G = H;
  G.row(0) -= cx * H.row(2);
  G.row(1) -= cy * H.row(2);
  return G;
}

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

bool homography_from_four_lines(const PlaneLinePair (&pairs)[4], Mat3* H) {
  const Span<const PlaneLinePair> all(pairs);
  Normaliser<2> model;
  Normaliser<2> image;
  if (!make_normaliser(all, &PlaneLinePair::model_p, &PlaneLinePair::model_q, &model)) return false;
  if (!make_normaliser(all, &PlaneLinePair::image_p, &PlaneLinePair::image_q, &image)) return false;
  Vec3 model_lines[4];
  Vec3 image_lines[4];
  for (int i = 0; i < 4; ++i) {
    model_lines[i] = line_through(model.apply(pairs[i].model_p), model.apply(pairs[i].model_q));
    image_lines[i] = line_through(image.apply(pairs[i].image_p), image.apply(pairs[i].image_q));
  }
  Mat3 model_basis;
  Mat3 image_basis;
  if (!projective_basis(model_lines, &model_basis) || !projective_basis(image_lines, &image_basis)) return false;
  // Lines map by inverse(H)': image_basis = inverse(H)' model_basis.
  const Mat3 normalised = (model_basis * image_basis.inverse()).transpose();
  const Mat3 result = image.inverse() * normalised * model.matrix();
  if (!result.allFinite()) return false;
  *H = result / result.norm();
  return true;
}

bool homography_from_lines(Span<const PlaneLinePair> pairs, Mat3* H) {
  if (pairs.size() < 4) return false;
  Normaliser<2> model;
  Normaliser<2> image;
  if (!make_normaliser(pairs, &PlaneLinePair::model_p, &PlaneLinePair::model_q, &model)) return false;
  if (!make_normaliser(pairs, &PlaneLinePair::image_p, &PlaneLinePair::image_q, &image)) return false;
  DltSystem<2> system;
  for (const PlaneLinePair& pair : pairs) {
    system.add(line_through(image.apply(pair.image_p), image.apply(pair.image_q)), model.apply(pair.model_p),
               model.apply(pair.model_q));
  }
  Mat3 normalised;
  if (!system.solve(&normalised)) return false;
  const Mat3 result = image.inverse() * normalised * model.matrix();
  if (!result.allFinite()) return false;
  *H = result / result.norm();
  return true;
}

bool focal_lengths_from_homography(const Mat3& H, double cx, double cy, double* fx, double* fy) {
  Mat3 G = centred(H, cx, cy);
  // Brings 1/f^2 near one, so that the determinant's threshold below means something.
  const double scale = G.row(2).head<2>().norm() / G.topLeftCorner<2, 2>().norm();
  if (!(scale * (std::abs(cx) + std::abs(cy) + 1.0) > kMinPerspective) || !std::isfinite(scale)) return false;
  G.topRows<2>() *= scale;
  G /= G.leftCols<2>().norm();
  const FocalEquations e = focal_equations(G);
  const double determinant = e.A.determinant();
  if (!(std::abs(determinant) > 1e-9 * e.A.squaredNorm())) return false;
  const double wx = (e.A(1, 1) * e.c(0) - e.A(0, 1) * e.c(1)) / determinant;
  const double wy = (e.A(0, 0) * e.c(1) - e.A(1, 0) * e.c(0)) / determinant;
  if (!(wx > 0.0 && wy > 0.0)) return false;
  *fx = 1.0 / (std::sqrt(wx) * scale);
  *fy = 1.0 / (std::sqrt(wy) * scale);
  return true;
}

bool focal_length_from_homography(const Mat3& H, double cx, double cy, double* f) {
  const FocalEquations e = focal_equations(centred(H, cx, cy));
  const Vec2 a = e.A.rowwise().sum();
  const double w = a.dot(e.c) / a.squaredNorm();
  if (!(w > 0.0) || !std::isfinite(w)) return false;
  *f = 1.0 / std::sqrt(w);
  return true;
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
  Mat3 G = centred(H, camera.cx, camera.cy);
  G.row(0) /= camera.fx;
  G.row(1) /= camera.fy;
  double scale = 2.0 / (G.col(0).norm() + G.col(1).norm());
  if (G.row(2).dot(Vec3(visible(0), visible(1), 1.0)) < 0.0) scale = -scale;
  G *= scale;
  Mat3 A;
  A << G.col(0), G.col(1), Vec3(G.col(0)).cross(Vec3(G.col(1)));
  return make_pose(nearest_rotation(A), G.col(2));
}

}  // namespace lecalib
