// SPDX-License-Identifier: MIT
#include "lecalib/solve/next_view.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/cholesky.hpp"
#include "lecalib/math/line_projection.hpp"
#include "lecalib/math/so3.hpp"
#include "lecalib/math/trigonometry.hpp"
#include "lecalib/solve/parameter_policy.hpp"

namespace lecalib {
namespace {

constexpr int kPointsPerLine = 3;
constexpr std::size_t kMinForecastLines = 4;
/// A pose whose pivots fall below this rests on lines that are all but parallel.
constexpr double kMinForecastPivot = 1e-7;
/// What is forecast: so many views, each with points as good as an edge's.
constexpr double kViews = 4;
constexpr double kPointSigmaPx = 0.1;

constexpr double kTiltDeg = 25;
constexpr double kQuarterTurnDeg = 90;
constexpr double kCloser = 2.0 / 3.0;
/// Where a shifted object's centre stands between the image's centre and its edge.
constexpr double kShift = 0.6;

/// The normal equations of one view.
struct ViewEquations {
  Mat6 pose = Mat6::Zero();
  Mat69 cross = Mat69::Zero();
  Mat9 camera = Mat9::Zero();

  void add(const LineResidual& residual) {
    pose += residual.d_pose().transpose() * residual.d_pose();
    cross += residual.d_pose().transpose() * residual.d_intrinsics();
    camera += residual.d_intrinsics().transpose() * residual.d_intrinsics();
  }
};

bool is_inside(const Camera& camera, const Vec2& pixel) {
  return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() <= camera.width - 1.0 && pixel.y() <= camera.height - 1.0;
}

/// @return how many of the line's points are seen
int add_line(const Camera& camera, double radius_limit, const ModelLine& line, const Mat3& R, const Vec3& t,
             ViewEquations* equations) {
  const CameraLine in_camera = line_in_camera(R, t, line);
  const Vec3 p = Eigen::Map<const Vec3>(line.p);
  const Vec3 q = Eigen::Map<const Vec3>(line.q);
  int seen = 0;
  for (int k = 0; k < kPointsPerLine; ++k) {
    const double s = (k + 0.5) / kPointsPerLine;
    const Vec3 x = R * (p + s * (q - p)) + t;
    Vec2 pixel;
    LineResidual residual;
    if (!(x.z() > 0.0) || !project(camera, x, &pixel) || !is_inside(camera, pixel) ||
        !line_residual(camera, radius_limit, in_camera, pixel, &residual)) {
      continue;
    }
    equations->add(residual);
    ++seen;
  }
  return seen;
}

Vec3 centre_of(Span<const ModelLine> model) {
  Vec3 sum = Vec3::Zero();
  for (const ModelLine& line : model) sum += Eigen::Map<const Vec3>(line.p) + Eigen::Map<const Vec3>(line.q);
  return sum / (2.0 * static_cast<double>(model.size()));
}

/// The object turned about its centre and put elsewhere, both in the camera's frame.
Pose moved(const Pose& from, const Vec3& centre, const Mat3& turn, const Vec3& to) {
  const Mat3 R = turn * rotation_of(from);
  return make_pose(R, to - R * centre);
}

struct ViewCandidate {
  ViewMove move;
  Vec3 turn_deg;
  double distance;
  Vec2 towards;  ///< in half images; zero: it stays where it is
};

constexpr std::size_t kNumCandidates = 12;
void list_candidates(ViewCandidate (&out)[kNumCandidates]) {
  const Vec3 none = Vec3::Zero();
  const Vec2 here = Vec2::Zero();
  out[0] = {ViewMove::stay, none, 1.0, here};
  out[1] = {ViewMove::tilt, Vec3(kTiltDeg, 0, 0), 1.0, here};
  out[2] = {ViewMove::tilt, Vec3(-kTiltDeg, 0, 0), 1.0, here};
  out[3] = {ViewMove::tilt, Vec3(0, kTiltDeg, 0), 1.0, here};
  out[4] = {ViewMove::tilt, Vec3(0, -kTiltDeg, 0), 1.0, here};
  out[5] = {ViewMove::roll, Vec3(0, 0, kQuarterTurnDeg), 1.0, here};
  out[6] = {ViewMove::closer, none, kCloser, here};
  out[7] = {ViewMove::away, none, 1.0 / kCloser, here};
  out[8] = {ViewMove::left, none, 1.0, Vec2(-kShift, 0)};
  out[9] = {ViewMove::right, none, 1.0, Vec2(kShift, 0)};
  out[10] = {ViewMove::top, none, 1.0, Vec2(0, -kShift)};
  out[11] = {ViewMove::bottom, none, 1.0, Vec2(0, kShift)};
}

Pose pose_of(const ViewCandidate& candidate, const Camera& camera, const Pose& from, const Vec3& centre) {
  Vec3 at = candidate.distance * (rotation_of(from) * centre + translation_of(from));
  if (candidate.towards.x() != 0.0) at.x() = at.z() * candidate.towards.x() * 0.5 * camera.width / camera.fx;
  if (candidate.towards.y() != 0.0) at.y() = at.z() * candidate.towards.y() * 0.5 * camera.height / camera.fy;
  const Vec3 turn(deg_to_rad(candidate.turn_deg.x()), deg_to_rad(candidate.turn_deg.y()),
                  deg_to_rad(candidate.turn_deg.z()));
  return moved(from, centre, so3_exp(turn), at);
}

}  // namespace

std::size_t add_view_information(const Camera& camera, Span<const ModelLine> model, const Pose& T_cam_world,
                                 double sigma_px, Mat9* information) {
  const Mat3 R = rotation_of(T_cam_world);
  const Vec3 t = translation_of(T_cam_world);
  const double radius_limit = valid_radius(camera);
  ViewEquations equations;
  std::size_t lines = 0;
  for (const ModelLine& line : model) {
    if (add_line(camera, radius_limit, line, R, t, &equations) >= 2) ++lines;
  }
  Cholesky<6> factor;
  if (lines < kMinForecastLines || !factor.factor(equations.pose, kMinForecastPivot)) return lines;
  const Mat69 solved = factor.solve(equations.cross);
  *information += (equations.camera - equations.cross.transpose().lazyProduct(solved)) / (sigma_px * sigma_px);
  return lines;
}

bool forecast_moves(const Camera& camera, Span<const ModelLine> model, const Mat9& information, const bool (&held)[9],
                    const Pose& from, std::size_t parameter, MoveForecast* out) {
  const auto k = static_cast<Eigen::Index>(parameter);
  const Vec9 unit = Vec9::Unit(k);
  Cholesky<9> factor;
  if (!factor.factor(information)) return false;
  MoveForecast forecast;
  const double sigma = std::sqrt(factor.solve(unit)(k));
  std::fill(forecast.sigma, forecast.sigma + kNumViewMoves, sigma);
  ViewCandidate candidates[kNumCandidates];
  list_candidates(candidates);
  const Vec3 centre = centre_of(model);
  for (const ViewCandidate& candidate : candidates) {
    Mat9 added = Mat9::Zero();
    (void)add_view_information(camera, model, pose_of(candidate, camera, from, centre),
                               kPointSigmaPx / std::sqrt(kViews), &added);
    for (Eigen::Index i = 0; i < 9; ++i) {
      if (!held[i]) continue;
      added.row(i).setZero();
      added.col(i).setZero();
    }
    if (!factor.factor(information + added)) continue;
    double& best = forecast.sigma[static_cast<std::size_t>(candidate.move)];
    best = std::min(best, std::sqrt(factor.solve(unit)(k)));
  }
  *out = forecast;
  return true;
}

}  // namespace lecalib
