// SPDX-License-Identifier: MIT
#include "lecalib/host/protocol_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lecalib/math/so3.hpp"
#include "lecalib/math/trigonometry.hpp"

namespace lecalib::host {

TrialErrors no_answer() {
  TrialErrors errors;
  errors.fill(std::numeric_limits<double>::infinity());
  return errors;
}

TrialErrors errors_of(const Camera& camera, const Pose& T_cam_world, const Trial& truth) {
  const Mat3 R = rotation_of(T_cam_world);
  const Mat3 R_true = rotation_of(truth.T_cam_world);
  const Vec3 t_true = translation_of(truth.T_cam_world);
  TrialErrors errors{};
  for (Eigen::Index i = 0; i < 3; ++i) {  // the cosine alone would lose half of the digits of a small angle
    const double angle = arc_tan2(R.col(i).cross(R_true.col(i)).norm(), R.col(i).dot(R_true.col(i)));
    errors[0] = std::max(errors[0], rad_to_deg(angle));
  }
  errors[1] = 100.0 * (translation_of(T_cam_world) - t_true).norm() / t_true.norm();
  for (std::size_t i = 0; i < 6; ++i) {
    const double expected = truth.camera.*kIntrinsics[i];
    const double scale = i < 4 ? 100.0 / expected : 1e3;
    errors[2 + i] = scale * std::abs(camera.*kIntrinsics[i] - expected);
  }
  const bool finite = std::all_of(errors.begin(), errors.end(), [](double e) { return std::isfinite(e); });
  return finite ? errors : no_answer();
}

Pose with_origin_ahead(const Pose& pose) {
  if (pose.t[2] > 0) return pose;
  Mat3 R = rotation_of(pose);
  R.leftCols<2>() *= -1.0;
  return make_pose(R, -translation_of(pose));
}

}  // namespace lecalib::host
