// SPDX-License-Identifier: MIT
#include "lecalib/host/protocol_limit.hpp"

#include "lecalib/math/camera_model.hpp"
#include "lecalib/math/cholesky.hpp"
#include "lecalib/math/line_projection.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib::host {
namespace {

constexpr Eigen::Index kFreeIntrinsics = 6;

}  // namespace

bool find_limit(const Trial& trial, Span<const ModelLine> model, TrialLimit* out) {
  const Mat3 R = rotation_of(trial.T_cam_world);
  const Vec3 t = translation_of(trial.T_cam_world);
  const double radius_limit = valid_radius(trial.camera);
  TrialMatrix information = TrialMatrix::Zero();
  TrialVector gradient = TrialVector::Zero();
  for (std::size_t i = 0; i < trial.points.size(); ++i) {
    const LinePoint& point = trial.points[i];
    const CameraLine line = line_in_camera(R, t, model[point.line]);
    LineFoot foot;
    LineResidual residual;
    if (!find_foot(trial.camera, radius_limit, line, trial.exact_px[i], &foot) ||
        !line_residual(trial.camera, radius_limit, line, trial.exact_px[i], &residual)) {
      return false;
    }
    TrialVector derivatives;
    derivatives << residual.d_intrinsics().head<kFreeIntrinsics>().transpose(), residual.d_pose().transpose();
    const Vec2 noise = Vec2(point.u_px, point.v_px) - trial.exact_px[i] - Vec2::Constant(trial.noise_mean_px);
    information += derivatives * derivatives.transpose();
    gradient -= derivatives * foot.normal.dot(noise);
  }
  Cholesky<kTrialParameters> factor;
  if (!factor.factor(information)) return false;
  *out = {factor.inverse(), factor.solve(gradient)};
  return true;
}

void displace(const Trial& trial, const TrialVector& error, Camera* camera, Pose* T_cam_world) {
  *camera = trial.camera;
  for (Eigen::Index i = 0; i < kFreeIntrinsics; ++i) camera->*kIntrinsics[i] += error(i);
  const Mat3 turn = so3_exp(error.segment<3>(kFreeIntrinsics));
  const Vec3 shift = error.tail<3>();
  *T_cam_world = make_pose(turn * rotation_of(trial.T_cam_world), turn * translation_of(trial.T_cam_world) + shift);
}

}  // namespace lecalib::host
