// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "lecalib/host/calibration_report.hpp"
#include "lecalib/host/text.hpp"
#include "lecalib/math/distortion_fit.hpp"

namespace lecalib::host {
namespace {

/// OpenCV's parser takes a number for real only when it has a point or an exponent.
std::string real(double value) {
  if (!std::isfinite(value)) return ".Nan";
  const std::string text = shortest(value);
  return text.find_first_of(".e") == std::string::npos ? text + "." : text;
}

std::string matrix(const char* name, std::size_t rows, std::size_t columns, const std::vector<double>& data) {
  std::string text = std::string(name) + ": !!opencv-matrix\n   rows: " + std::to_string(rows) +
                     "\n   cols: " + std::to_string(columns) + "\n   dt: d\n   data: [";
  for (std::size_t i = 0; i < data.size(); ++i) {
    if (i > 0) text += i % columns == 0 ? ",\n       " : ",";
    text += " " + real(data[i]);
  }
  return text + " ]\n";
}

/// Rotation vector of a rotation matrix, |w| <= pi: through the quaternion whose largest part comes first, so that
/// neither small angles nor angles near pi lose digits.
std::array<double, 3> rotation_vector(const double* R) {
  const auto r = [R](int row, int column) { return R[3 * row + column]; };
  const double trace = r(0, 0) + r(1, 1) + r(2, 2);
  const std::array<double, 4> squares = {1 + trace, 1 + 2 * r(0, 0) - trace, 1 + 2 * r(1, 1) - trace,
                                         1 + 2 * r(2, 2) - trace};
  std::array<double, 4> q{};  // w x y z, not normalised
  switch (std::max_element(squares.begin(), squares.end()) - squares.begin()) {
    case 0: q = {squares[0], r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)}; break;
    case 1: q = {r(2, 1) - r(1, 2), squares[1], r(0, 1) + r(1, 0), r(0, 2) + r(2, 0)}; break;
    case 2: q = {r(0, 2) - r(2, 0), r(0, 1) + r(1, 0), squares[2], r(1, 2) + r(2, 1)}; break;
    default: q = {r(1, 0) - r(0, 1), r(0, 2) + r(2, 0), r(1, 2) + r(2, 1), squares[3]}; break;
  }
  const double sign = q[0] < 0 ? -1 : 1;
  const double sine = std::sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double angle = 2 * std::atan2(sine, sign * q[0]);
  const double scale = sine > 0 ? sign * angle / sine : 0;
  return {q[1] * scale, q[2] * scale, q[3] * scale};
}

}  // namespace

std::string calibration_opencv_yaml(const CalibrationReport& report) {
  const CameraReport entry = report.cameras.empty() ? CameraReport() : report.cameras.front();
  const double radius = image_radius(entry.camera);
  const Camera c = in_model(entry.camera, DistortionModel::brown, radius, 3);
  std::vector<double> view_rms;
  std::vector<double> extrinsics;
  for (const ViewReport& view : report.views) {
    const std::array<double, 3> w = rotation_vector(view.T_cam_world.R);
    extrinsics.insert(extrinsics.end(), w.begin(), w.end());
    extrinsics.insert(extrinsics.end(), view.T_cam_world.t, view.T_cam_world.t + 3);
    view_rms.push_back(view.rms_px);
  }
  std::string text = "%YAML:1.0\n---\n";
  text += "nframes: " + std::to_string(report.views.size()) + "\n";
  text += "image_width: " + std::to_string(c.width) + "\n";
  text += "image_height: " + std::to_string(c.height) + "\n";
  text += matrix("camera_matrix", 3, 3, {c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1});
  if (entry.camera.model != DistortionModel::brown) {
    text += std::string("# the camera's model is '") +
            kDistortionModelNames[static_cast<std::size_t>(entry.camera.model)] +
            "', which OpenCV does not have: Brown's coefficients nearest to it, off by " +
            fixed(largest_difference_px(entry.camera, c, radius), 3) + " px at most within the image\n";
  }
  text += matrix("distortion_coefficients", 5, 1, {c.k1, c.k2, c.p1, c.p2, c.k3});
  text += "avg_reprojection_error: " + real(entry.rms_px) + "\n";
  if (!report.views.empty()) {
    text += matrix("per_view_reprojection_errors", view_rms.size(), 1, view_rms);
    text += "# one row per view: rotation vector and translation (metres), world to camera\n";
    text += matrix("extrinsic_parameters", report.views.size(), 6, extrinsics);
  }
  return text;
}

}  // namespace lecalib::host
