// SPDX-License-Identifier: MIT
#include "lecalib/match/quad_pose.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// The homography of the unit square (0,0) (1,0) (1,1) (0,1) to four points (Heckbert 1989).
Mat3 square_to_quad(const Vec2 (&p)[4]) {
  const Vec2 d1 = p[1] - p[2];
  const Vec2 d2 = p[3] - p[2];
  const Vec2 sum = p[0] - p[1] + p[2] - p[3];
  const double determinant = d1.x() * d2.y() - d2.x() * d1.y();
  const double g = (sum.x() * d2.y() - d2.x() * sum.y()) / determinant;
  const double h = (d1.x() * sum.y() - sum.x() * d1.y()) / determinant;
  Mat3 H;
  H << p[1].x() - p[0].x() + g * p[1].x(), p[3].x() - p[0].x() + h * p[3].x(), p[0].x(),  //
      p[1].y() - p[0].y() + g * p[1].y(), p[3].y() - p[0].y() + h * p[3].y(), p[0].y(),   //
      g, h, 1.0;
  return H;
}

/// An orthonormal frame of the face's plane and its corners in it.
struct FacePlane {
  Vec3 origin;
  Mat3 axes;  ///< columns: two directions in the plane, the normal
  Vec2 corner[4];
};

FacePlane plane_of(const ModelQuad& quad) {
  FacePlane plane;
  Vec3 corner[4];
  for (int i = 0; i < 4; ++i) corner[i] = Eigen::Map<const Vec3>(quad.corner[i]);
  plane.origin = corner[0];
  plane.axes.col(0) = (corner[1] - corner[0]).normalized();
  plane.axes.col(2) = plane.axes.col(0).cross(corner[3] - corner[0]).normalized();
  plane.axes.col(1) = plane.axes.col(2).cross(plane.axes.col(0));
  for (int i = 0; i < 4; ++i) {
    const Vec3 d = corner[i] - plane.origin;
    plane.corner[i] = Vec2(plane.axes.col(0).dot(d), plane.axes.col(1).dot(d));
  }
  return plane;
}

/// How far the columns of diag(1/f, 1/f, 1) H are from orthonormal, squared.
double departure2(const Mat3& H, double f_px) {
  const double w = 1.0 / (f_px * f_px);
  const auto dot = [&H, w](int i, int j) { return w * (H(0, i) * H(0, j) + H(1, i) * H(1, j)) + H(2, i) * H(2, j); };
  const double a = dot(0, 0);
  const double b = dot(1, 1);
  const double c = dot(0, 1);
  // log(|h1| / |h2|) ~ (a - b) / (a + b), without a logarithm.
  const double ratio = (a - b) / (a + b);
  return c * c / (a * b) + ratio * ratio;
}

/// @return false when a corner lies behind the camera
bool pose_from(const Mat3& H, const FacePlane& plane, double f_px, PoseGuess* out) {
  Mat3 columns = H;
  columns.topRows<2>() /= f_px;
  double scale = 2.0 / (columns.col(0).norm() + columns.col(1).norm());
  if (columns(2, 2) < 0.0) scale = -scale;
  columns *= scale;
  Mat3 axes;
  axes.col(0) = columns.col(0);
  axes.col(1) = columns.col(1);
  axes.col(2) = columns.col(0).cross(columns.col(1));
  const Mat3 R_cam_plane = nearest_rotation(axes);
  const Vec3 t = columns.col(2);
  for (const Vec2& corner : plane.corner) {
    if ((R_cam_plane * Vec3(corner.x(), corner.y(), 0.0) + t).z() <= 0.0) return false;
  }
  const Mat3 R = R_cam_plane * plane.axes.transpose();
  Eigen::Map<RowMat3>(out->R) = R;
  Eigen::Map<Vec3>(out->t) = t - R * plane.origin;
  out->f_px = f_px;
  return true;
}

}  // namespace

std::size_t guess_poses(const ImageQuad& image, const ModelQuad& model, int labeling, const QuadPoseOptions& options,
                        PoseGuess out[kMaxQuadGuesses]) {
  const FacePlane plane = plane_of(model);
  Vec2 corner[4];
  for (int i = 0; i < 4; ++i) {
    const int from = labeling < 4 ? (i + labeling) % 4 : (7 - i + labeling) % 4;
    corner[i] = Eigen::Map<const Vec2>(image.corner[from]);
  }
  const Mat3 H = square_to_quad(corner) * square_to_quad(plane.corner).inverse();
  if (!H.allFinite()) return 0;

  const double limit = options.max_departure * options.max_departure;
  double value[kMaxFocalSteps];
  double focal[kMaxFocalSteps];
  int steps = 0;
  int best = 0;
  for (double f = options.focal.min_px; f <= options.focal.max_px && steps < kMaxFocalSteps; f *= kFocalRatio) {
    focal[steps] = f;
    value[steps] = departure2(H, f);
    if (value[steps] < value[best]) best = steps;
    ++steps;
  }
  if (steps == 0 || !(value[best] < limit)) return 0;
  double f_best = focal[best];
  if (best > 0 && best + 1 < steps) {
    const double curvature = value[best - 1] - 2.0 * value[best] + value[best + 1];
    const double shift = curvature > 0.0 ? 0.5 * (value[best - 1] - value[best + 1]) / curvature : 0.0;
    f_best *= 1.0 + shift * (kFocalRatio - 1.0);
  }
  std::size_t count = 0;
  if (pose_from(H, plane, f_best, &out[count])) ++count;
  int low = best;
  while (low > 0 && value[low - 1] < 0.25 * limit) --low;
  int high = best;
  while (high + 1 < steps && value[high + 1] < 0.25 * limit) ++high;
  // Beyond two steps (a quarter more or less) refinement no longer finds its way from the best one by itself.
  if (best - low > 2 && pose_from(H, plane, focal[low], &out[count])) ++count;
  if (high - best > 2 && pose_from(H, plane, focal[high], &out[count])) ++count;
  return count;
}

}  // namespace lecalib
