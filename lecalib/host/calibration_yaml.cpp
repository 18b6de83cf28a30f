// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "lecalib/host/calibration_report.hpp"
#include "lecalib/host/text.hpp"
#include "lecalib/math/distortion_fit.hpp"
#include "lecalib/math/so3.hpp"

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

std::string camera_text(const CameraReport& entry, const char* matrix_name, const char* distortion_name) {
  const double radius = image_radius(entry.camera);
  const Camera c = in_model(entry.camera, DistortionModel::brown, radius, 3);
  std::string text = matrix(matrix_name, 3, 3, {c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1});
  if (entry.camera.model != DistortionModel::brown) {
    text += std::string("# the camera's model is '") +
            kDistortionModelNames[static_cast<std::size_t>(entry.camera.model)] +
            "', which OpenCV does not have: Brown's coefficients nearest to it, off by " +
            fixed(largest_difference_px(entry.camera, c, radius), 3) + " px at most within the image\n";
  }
  return text + matrix(distortion_name, 5, 1, {c.k1, c.k2, c.p1, c.p2, c.k3});
}

/// What the files of OpenCV's stereo sample hold: x2 = R x1 + T, camera 1 being the left one.
std::string pair_text(const CalibrationReport& report) {
  const Pose& pose = report.stereo->T_right_left;
  return camera_text(report.cameras[0], "M1", "D1") + camera_text(report.cameras[1], "M2", "D2") +
         matrix("R", 3, 3, {pose.R, pose.R + 9}) + matrix("T", 3, 1, {pose.t, pose.t + 3});
}

}  // namespace

std::string calibration_opencv_yaml(const CalibrationReport& report) {
  const CameraReport entry = report.cameras.empty() ? CameraReport() : report.cameras.front();
  std::vector<double> view_rms;
  std::vector<double> extrinsics;
  for (const ViewReport& view : report.views) {
    if (view.camera != entry.name) continue;
    const Vec3 w = so3_log(rotation_of(view.T_cam_world));
    extrinsics.insert(extrinsics.end(), w.data(), w.data() + 3);
    extrinsics.insert(extrinsics.end(), view.T_cam_world.t, view.T_cam_world.t + 3);
    view_rms.push_back(view.rms_px);
  }
  std::string text = "%YAML:1.0\n---\n";
  text += "nframes: " + std::to_string(view_rms.size()) + "\n";
  text += "image_width: " + std::to_string(entry.camera.width) + "\n";
  text += "image_height: " + std::to_string(entry.camera.height) + "\n";
  text += camera_text(entry, "camera_matrix", "distortion_coefficients");
  text += "avg_reprojection_error: " + real(entry.rms_px) + "\n";
  if (!view_rms.empty()) {
    text += matrix("per_view_reprojection_errors", view_rms.size(), 1, view_rms);
    text += "# one row per view: rotation vector and translation (metres), world to camera\n";
    text += matrix("extrinsic_parameters", view_rms.size(), 6, extrinsics);
  }
  if (report.stereo && report.cameras.size() == 2) text += pair_text(report);
  return text;
}

}  // namespace lecalib::host
