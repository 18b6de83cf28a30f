// SPDX-License-Identifier: MIT
#include "lecalib/solve/line_dlt.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/dlt_system.hpp"
#include "lecalib/math/jacobi_eigen.hpp"
#include "lecalib/math/line_projection.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// Extents relative to the largest one. Flat models give a badly conditioned M; a homography that overlooks a thickness
/// of 2 % is the better start, and the refinement knows the true model.
constexpr double kMaxPlanarThickness = 0.02;
constexpr double kMaxCollinearWidth = 1e-3;

Vec2 start_of(const ViewLine& line) { return {line.image_p[0], line.image_p[1]}; }
Vec2 end_of(const ViewLine& line) { return {line.image_q[0], line.image_q[1]}; }

/// Where the model's lines are used, as multiples of their own spread. A line has no ends: one whose end points lie far
/// beyond all others would set the scale of the whole system and drown them.
constexpr double kReachSpreads = 3.0;
constexpr int kMaxReachPasses = 40;
constexpr double kSettledSpread = 0.9;

/// Least share of the part inside that must lie between a line's own ends for these to be kept.
constexpr double kMinInside = 0.05;

/// A ball that holds what the lines are used for.
struct ModelReach {
  Vec3 centre = Vec3::Zero();
  double radius = 0.0;  // 0: unbounded
};

bool is_inside(const ModelLine& line, const ModelReach& reach) {
  const double radius2 = reach.radius * reach.radius;
  return (start_of(line) - reach.centre).squaredNorm() <= radius2 &&
         (end_of(line) - reach.centre).squaredNorm() <= radius2;
}

/// Two points of a model line inside a ball, or the nearest to it.
ModelLine within(const ModelLine& line, const ModelReach& reach) {
  if (!(reach.radius > 0.0) || is_inside(line, reach)) return line;
  const Vec3 p = start_of(line);
  const Vec3 d = end_of(line) - p;
  const double foot = d.dot(reach.centre - p) / d.squaredNorm();
  const double aside2 = (p + foot * d - reach.centre).squaredNorm();
  const double half = std::sqrt(std::max(reach.radius * reach.radius - aside2, 0.0) / d.squaredNorm());
  if (foot - half <= 0.0 && foot + half >= 1.0) return line;
  double low = std::max(foot - half, 0.0);
  double high = std::min(foot + half, 1.0);
  if (!(high - low > kMinInside * 2.0 * half)) {  // its ends lie outside: the part inside serves as well
    low = foot - std::max(half, kMinInside * reach.radius / d.norm());
    high = foot + std::max(half, kMinInside * reach.radius / d.norm());
  }
  const Vec3 a = p + low * d;
  const Vec3 b = p + high * d;
  return {{a(0), a(1), a(2)}, {b(0), b(1), b(2)}};
}

/// Shrinks a ball about all lines until it no longer hangs on a few far ends. Unbounded where it holds them all.
ModelReach find_reach(Span<const ModelLine> model, Span<const ViewLine> lines) {
  ModelReach reach;
  double previous = 0.0;
  for (int pass = 0; pass < kMaxReachPasses; ++pass) {
    Vec3 sum = Vec3::Zero();
    double squares = 0.0;
    for (const ViewLine& line : lines) {
      const ModelLine part = within(model[line.model_line], reach);
      sum += start_of(part) + end_of(part) - 2.0 * reach.centre;
      squares += (start_of(part) - reach.centre).squaredNorm() + (end_of(part) - reach.centre).squaredNorm();
    }
    const double n = 2.0 * static_cast<double>(lines.size());
    const double spread = std::sqrt(std::max(squares / n - (sum / n).squaredNorm(), 0.0));
    if (pass > 0 && !(spread < kSettledSpread * previous)) break;
    previous = spread;
    reach.centre += sum / n;
    reach.radius = kReachSpreads * spread;
  }
  const auto inside = [&](const ViewLine& line) { return is_inside(model[line.model_line], reach); };
  if (std::all_of(lines.begin(), lines.end(), inside)) reach.radius = 0.0;
  return reach;
}

/// Sets up normalisation and equations; `position` gives a model point its D coordinates.
template <int D, class Position>
bool solve_dlt(Span<const ModelLine> model, Span<const ViewLine> lines, Position position,
               Eigen::Matrix<double, 3, D + 1>* M) {
  Normaliser<D> space;
  Normaliser<2> image;
  const ModelReach reach = find_reach(model, lines);
  for (const ViewLine& line : lines) {
    const ModelLine truth = within(model[line.model_line], reach);
    space.add_to_centre(position(start_of(truth)));
    space.add_to_centre(position(end_of(truth)));
    image.add_to_centre(start_of(line));
    image.add_to_centre(end_of(line));
  }
  space.finish_centre();
  image.finish_centre();
  for (const ViewLine& line : lines) {
    const ModelLine truth = within(model[line.model_line], reach);
    space.add_to_scale(position(start_of(truth)));
    space.add_to_scale(position(end_of(truth)));
    image.add_to_scale(start_of(line));
    image.add_to_scale(end_of(line));
  }
  if (!space.finish_scale() || !image.finish_scale()) return false;
  DltSystem<D> system;
  for (const ViewLine& line : lines) {
    const ModelLine truth = within(model[line.model_line], reach);
    system.add(line_through(image.apply(start_of(line)), image.apply(end_of(line))),
               space.apply(position(start_of(truth))), space.apply(position(end_of(truth))));
  }
  Eigen::Matrix<double, 3, D + 1> normalised;
  if (!system.solve(&normalised)) return false;
  const Eigen::Matrix<double, 3, D + 1> result = image.inverse() * normalised * space.matrix();
  if (!result.allFinite()) return false;
  *M = result / result.norm();
  return true;
}

/// M with a proper left 3 x 3 part (positive determinant).
bool make_proper(const Mat34& M, Mat34* out) {
  const double determinant = M.leftCols<3>().determinant();
  if (!(std::abs(determinant) > 0.0) || !std::isfinite(determinant)) return false;
  *out = determinant > 0.0 ? M : Mat34(-M);
  return true;
}

}  // namespace

ModelFrame find_model_frame(Span<const ModelLine> model, Span<const ViewLine> lines) {
  ModelFrame frame{ModelShape::collinear, Mat3::Identity(), Vec3::Zero()};
  if (lines.empty()) return frame;
  const ModelReach reach = find_reach(model, lines);
  for (const ViewLine& line : lines) {
    const ModelLine part = within(model[line.model_line], reach);
    frame.origin += start_of(part) + end_of(part);
  }
  frame.origin /= 2.0 * static_cast<double>(lines.size());
  Mat3 scatter = Mat3::Zero();
  for (const ViewLine& line : lines) {
    const ModelLine part = within(model[line.model_line], reach);
    const Vec3 p = start_of(part) - frame.origin;
    const Vec3 q = end_of(part) - frame.origin;
    scatter += p * p.transpose() + q * q.transpose();
  }
  Vec3 values;
  Mat3 vectors;
  jacobi_eigen(scatter, &values, &vectors);
  frame.axes.row(0) = vectors.col(2).transpose();
  frame.axes.row(1) = vectors.col(1).transpose();
  frame.axes.row(2) = vectors.col(2).cross(vectors.col(1)).transpose();
  if (values(1) <= kMaxCollinearWidth * kMaxCollinearWidth * values(2)) return frame;
  const bool flat = values(0) <= kMaxPlanarThickness * kMaxPlanarThickness * values(2);
  frame.shape = flat ? ModelShape::planar : ModelShape::non_planar;
  return frame;
}

bool solve_line_dlt(Span<const ModelLine> model, Span<const ViewLine> lines, Mat34* M) {
  if (lines.size() < kMinNonPlanarLines) return false;
  return solve_dlt<3>(
      model, lines, [](const Vec3& x) { return x; }, M);
}

bool solve_planar_line_dlt(Span<const ModelLine> model, Span<const ViewLine> lines, const ModelFrame& frame, Mat3* H) {
  if (lines.size() < kMinPlanarLines) return false;
  const auto in_plane = [&frame](const Vec3& x) -> Vec2 { return frame.axes.topRows<2>() * (x - frame.origin); };
  return solve_dlt<2>(model, lines, in_plane, H);
}

bool decompose_projection(const Mat34& M, Decomposition* out) {
  Mat34 P;
  if (!make_proper(M, &P)) return false;
  // Rows from below: m3 = k33 r3, m2 = k22 r2 + k23 r3, m1 = k11 r1 + k12 r2 + k13 r3.
  const Vec3 m1 = P.row(0).head<3>().transpose();
  const Vec3 m2 = P.row(1).head<3>().transpose();
  const Vec3 m3 = P.row(2).head<3>().transpose();
  const double k33 = m3.norm();
  const Vec3 r3 = m3 / k33;
  const double k23 = m2.dot(r3);
  const Vec3 rest = m2 - k23 * r3;
  const double k22 = rest.norm();
  const Vec3 r2 = rest / k22;
  const Vec3 r1 = r2.cross(r3);
  const double k11 = m1.dot(r1);
  const double k12 = m1.dot(r2);
  const double k13 = m1.dot(r3);
  Decomposition result{k11 / k33, k22 / k33, k13 / k33, k23 / k33, Mat3::Identity(), Vec3::Zero()};
  result.R << r1.transpose(), r2.transpose(), r3.transpose();
  const double t3 = P(2, 3) / k33;
  const double t2 = (P(1, 3) - k23 * t3) / k22;
  result.t = Vec3((P(0, 3) - k12 * t2 - k13 * t3) / k11, t2, t3);
  if (!(result.fx > 0.0 && result.fy > 0.0) || !result.R.allFinite() || !result.t.allFinite()) return false;
  *out = result;
  return true;
}

bool find_focal_lengths(const Mat34& M, double cx, double cy, double* fx, double* fy) {
  const Mat3 A = M.leftCols<3>();
  const double scale = A.row(2).norm();
  const double x = (A.row(0) - cx * A.row(2)).norm() / scale;
  const double y = (A.row(1) - cy * A.row(2)).norm() / scale;
  if (!(x > 0.0 && y > 0.0) || !std::isfinite(x + y)) return false;
  *fx = x;
  *fy = y;
  return true;
}

bool decompose_projection(const Mat34& M, double cx, double cy, Decomposition* out) {
  Camera camera;
  camera.cx = cx;
  camera.cy = cy;
  Pose pose;
  if (!find_focal_lengths(M, cx, cy, &camera.fx, &camera.fy) || !pose_from_projection(M, camera, &pose)) return false;
  *out = {camera.fx, camera.fy, cx, cy, rotation_of(pose), translation_of(pose)};
  return true;
}

bool pose_from_projection(const Mat34& M, const Camera& camera, Pose* pose) {
  Mat34 P;
  if (!make_proper(M, &P)) return false;
  P.row(0) = (P.row(0) - camera.cx * P.row(2)) / camera.fx;
  P.row(1) = (P.row(1) - camera.cy * P.row(2)) / camera.fy;
  const Mat3 A = P.leftCols<3>();
  const double scale = A.norm() / std::sqrt(3.0);
  const Vec3 t = P.col(3) / scale;
  if (!(scale > 0.0) || !t.allFinite()) return false;
  *pose = make_pose(nearest_rotation(A / scale), t);
  return true;
}

}  // namespace lecalib
