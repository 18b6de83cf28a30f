// SPDX-License-Identifier: MIT
#include "lecalib/match/pose_refinement.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/line_projection.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

using Vec4 = Eigen::Matrix<double, 4, 1>;
using Mat4 = Eigen::Matrix<double, 4, 4>;
using Mat64 = Eigen::Matrix<double, 6, 4>;

/// Largest change of the focal length in one step.
constexpr double kMaxFocalStep = 0.2;

struct PointResidual {
  double value_px;
  double weight;
  Vec2 normal;  ///< derivative by the flat point
  double d_f;
  Vec6 d_pose;
};

/// @return false for a line through the camera's centre
bool point_residual(const CameraLine& line, double f_px, const Vec2& flat, double sigma_px,
                    const PoseRefinementOptions& options, PointResidual* out) {
  const double h = line.moment.head<2>().norm();
  if (!(h > 0.0)) return false;
  const Vec3& N = line.moment;
  out->normal = N.head<2>() / h;
  out->value_px = out->normal.dot(flat) + N.z() * f_px / h;
  out->d_f = N.z() / h;
  const Vec2 foot = flat - out->value_px * out->normal;
  const Vec3 m(foot.x(), foot.y(), f_px);
  out->d_pose.head<3>() = N.cross(m) / h;
  out->d_pose.tail<3>() = line.direction.cross(m) / h;
  const double variance = sigma_px * sigma_px + options.sigma_floor_px * options.sigma_floor_px;
  const double u = out->value_px / options.loss_px;
  out->weight = 1.0 / ((1.0 + u * u) * variance);
  return true;
}

/// Sigma of a pose step along each parameter as information.
Vec6 step_information(const Pose& pose, double damping) {
  const double distance = std::max(translation_of(pose).norm(), 1e-9);
  Vec6 information;
  information.head<3>().setConstant(1.0 / (damping * damping));
  information.tail<3>().setConstant(1.0 / (damping * damping * distance * distance));
  return information;
}

/// Adds the prior to the normal equations: the rotation's difference, and the centre's displacement in the camera
/// frame.
void add_pose_prior(const PosePrior& prior, const Pose& pose, Mat6* A, Vec6* a) {
  const Vec3 centre = Eigen::Map<const Vec3>(prior.centre_m);
  const Mat3 R_mean = rotation_of(prior.mean);
  const Vec3 expected = R_mean * centre + translation_of(prior.mean);
  const Vec3 x = rotation_of(pose) * centre + translation_of(pose);
  const Vec3 turned = so3_log(rotation_of(pose) * R_mean.transpose());
  const double information = 1.0 / (prior.sigma_rad * prior.sigma_rad);
  A->diagonal().head<3>().array() += information;
  a->head<3>() -= information * turned;
  const Vec3 sight = expected.normalized();
  const double lateral = 1.0 / (prior.sigma_lateral_m * prior.sigma_lateral_m);
  const double depth = 1.0 / (prior.sigma_depth_m * prior.sigma_depth_m);
  const Mat3 W = lateral * Mat3::Identity() + (depth - lateral) * sight * sight.transpose();
  Eigen::Matrix<double, 3, 6> J;
  J.leftCols<3>() = -hat(x);
  J.rightCols<3>().setIdentity();
  *A += J.transpose() * W * J;
  *a -= J.transpose() * (W * (x - expected));
}

struct LensSystem {
  Mat6 A;
  Mat64 B;
  Mat4 C;
  Vec6 a;
  Vec4 c;
  double cost;
};

/// Normal equations of one view: A pose, C lens, B between them.
void accumulate(Span<const ModelLine> model, const LensView& view, const Lens& lens,
                const PoseRefinementOptions& options, LensSystem* system) {
  const Mat3 R = rotation_of(*view.pose);
  const Vec3 t = translation_of(*view.pose);
  for (const LineMatch& match : view.matches) {
    const CameraLine line = line_in_camera(R, t, model[match.model_line]);
    const EventLine& detected = view.lines[match.line];
    const double sigma = static_cast<double>(std::max(detected.sigma_begin_px, detected.sigma_end_px));
    Vec2 points[kLinePoints];
    line_points(detected, Instant::middle, points);
    for (const Vec2& point : points) {
      Vec2 flat;
      Eigen::Matrix<double, 2, 3> d_lens;
      PointResidual r;
      if (!flatten(lens, point, &flat, &d_lens)) continue;
      if (!point_residual(line, lens.f_px, flat, sigma, options, &r)) continue;
      Vec4 l;
      l(0) = r.d_f;
      l.tail<3>() = d_lens.transpose() * r.normal;
      system->A += r.weight * r.d_pose * r.d_pose.transpose();
      system->B += r.weight * r.d_pose * l.transpose();
      system->C += r.weight * l * l.transpose();
      system->a -= r.weight * r.value_px * r.d_pose;
      system->c -= r.weight * r.value_px * l;
      system->cost += r.weight * r.value_px * r.value_px;
    }
  }
}

void add_prior(const LensPrior& prior, const Lens& lens, Mat4* C, Vec4* c) {
  const double value[4] = {lens.f_px, lens.lambda, lens.cx, lens.cy};
  const double mean[4] = {prior.mean.f_px, prior.mean.lambda, prior.mean.cx, prior.mean.cy};
  const double sigma[4] = {prior.sigma.f_px, prior.sigma.lambda, prior.sigma.cx, prior.sigma.cy};
  for (int i = 0; i < 4; ++i) {
    if (sigma[i] > 0.0) {
      const double information = 1.0 / (sigma[i] * sigma[i]);
      (*C)(i, i) += information;
      (*c)(i) -= information * (value[i] - mean[i]);
    } else {
      C->row(i).setZero();
      C->col(i).setZero();
      (*C)(i, i) = 1.0;
      (*c)(i) = 0.0;
    }
  }
}

}  // namespace

bool refine_pose(const PoseLines& seen, double f_px, const PosePrior* prior, const PoseRefinementOptions& options,
                 Pose* pose, double* rms_px) {
  const std::size_t k = static_cast<std::size_t>(seen.instant);
  Pose refined = *pose;
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    Mat6 A = Mat6::Zero();
    Vec6 a = Vec6::Zero();
    double squares = 0.0;
    double weights = 0.0;
    const Mat3 R = rotation_of(refined);
    const Vec3 t = translation_of(refined);
    for (const Assignment& assignment : seen.assignments) {
      const CameraLine line = line_in_camera(R, t, seen.model[assignment.model_line]);
      const FlatLine& flat = seen.lines[assignment.line];
      for (std::size_t q = 0; q < kLinePoints; ++q) {
        PointResidual r;
        if (!point_residual(line, f_px, Vec2(flat.x[k][q], flat.y[k][q]), flat.sigma_px, options, &r)) continue;
        A += r.weight * r.d_pose * r.d_pose.transpose();
        a -= r.weight * r.value_px * r.d_pose;
        squares += r.weight * r.value_px * r.value_px;
        weights += r.weight;
      }
    }
    if (!(weights > 0.0)) return false;
    A.diagonal() += step_information(refined, options.damping);
    if (prior != nullptr) add_pose_prior(*prior, refined, &A, &a);
    const Vec6 step = A.ldlt().solve(a);
    if (!step.allFinite()) return false;
    refined = moved(refined, step);
    if (rms_px != nullptr) *rms_px = std::sqrt(squares / weights);
  }
  *pose = refined;
  return true;
}

bool refine_lens_step(Span<const ModelLine> model, Span<const LensView> views, const LensPrior& prior,
                      const PoseRefinementOptions& options, Span<LensViewSystem> scratch, Lens* lens, double* cost) {
  Mat4 S = Mat4::Zero();
  Vec4 s = Vec4::Zero();
  *cost = 0.0;
  const double sigma[4] = {prior.sigma.f_px, prior.sigma.lambda, prior.sigma.cx, prior.sigma.cy};
  for (std::size_t v = 0; v < views.size(); ++v) {
    LensSystem system{Mat6::Zero(), Mat64::Zero(), Mat4::Zero(), Vec6::Zero(), Vec4::Zero(), 0.0};
    accumulate(model, views[v], *lens, options, &system);
    for (int i = 0; i < 4; ++i) {
      if (sigma[i] <= 0.0) system.B.col(i).setZero();
    }
    system.A.diagonal() += step_information(*views[v].pose, options.damping);
    const Eigen::LDLT<Mat6> factor(system.A);
    Mat64 gain;  // by columns: for several at once Eigen may take blocks from the heap
    for (int i = 0; i < 4; ++i) gain.col(i) = factor.solve(system.B.col(i));
    const Vec6 step = factor.solve(system.a);
    if (!gain.allFinite() || !step.allFinite()) return false;
    Eigen::Map<Mat64>(scratch[v].gain) = gain;
    Eigen::Map<Vec6>(scratch[v].step) = step;
    S += system.C - system.B.transpose() * gain;
    s += system.c - system.B.transpose() * step;
    *cost += system.cost;
  }
  add_prior(prior, *lens, &S, &s);
  Vec4 step = S.ldlt().solve(s);
  if (!step.allFinite()) return false;
  const double limit = kMaxFocalStep * lens->f_px;
  if (std::abs(step(0)) > limit) step *= limit / std::abs(step(0));
  lens->f_px += step(0);
  lens->lambda += step(1);
  lens->cx += step(2);
  lens->cy += step(3);
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Vec6 pose_step = Eigen::Map<const Vec6>(scratch[v].step) - Eigen::Map<const Mat64>(scratch[v].gain) * step;
    *views[v].pose = moved(*views[v].pose, pose_step);
  }
  return true;
}

}  // namespace lecalib
