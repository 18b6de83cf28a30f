// SPDX-License-Identifier: MIT
#include "lecalib/host/calibration_report.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "lecalib/host/text.hpp"
#include "support/json_file.hpp"

using namespace lecalib;
using namespace lecalib::host;

namespace {

/// Rotation by `angle` about a unit axis, row-major (Rodrigues).
Pose rotated(const double* axis, double angle) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  const double x = axis[0];
  const double y = axis[1];
  const double z = axis[2];
  return {{c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s,  //
           y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s,  //
           z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)},
          {0.5, -1.5, 2.0}};
}

CalibrationReport example() {
  CalibrationReport report;
  CameraReport camera;
  camera.camera = {640, 480, 400.5, 401, 319.5, 240.25, -0.1, 0.02, 0.001, -0.002, 0};
  camera.sigma = {1, 1.5, 2, 2.5, 0.01, 0.02, 0.001, 0.002, std::numeric_limits<double>::quiet_NaN()};
  camera.covariance.assign(81, 0.25);
  camera.rms_px = 0.3;
  camera.assumed = {"k3"};
  report.cameras.push_back(camera);
  const double axis[] = {0.6, 0, 0.8};
  report.views.push_back({"camera", "001", 123456789012, rotated(axis, 0.5), 9, 0.25, {}, {}});
  report.diagnostics.reason = "converged";
  report.diagnostics.counts = {{"events", 1000000}};
  report.diagnostics.numbers = {{"condition", 1e5}};
  return report;
}

/// The numbers in the brackets behind `name: !!opencv-matrix`.
std::vector<double> matrix(const std::string& yaml, const std::string& name) {
  const std::size_t at = yaml.find("\n" + name + ": !!opencv-matrix");
  REQUIRE(at != std::string::npos);
  const std::size_t open = yaml.find('[', at);
  std::string list = yaml.substr(open + 1, yaml.find(']', at) - open - 1);
  for (char& c : list) c = c == '\n' ? ' ' : c;
  std::vector<double> values;
  for (const Field& field : split(list, ',')) {
    const auto value = parse_number(field.text);
    REQUIRE(value);
    values.push_back(*value);
  }
  return values;
}

}  // namespace

TEST_CASE("calibration.json holds every field of its contract") {
  const auto json = test::json_in(calibration_json(example()));
  CHECK(json["version"] == 1);
  CHECK(json["status"] == "ok");
  CHECK(json["stereo"].is_null());
  const auto& camera = json["cameras"].at(0);
  CHECK(camera["width"] == 640);
  CHECK(camera["height"] == 480);
  CHECK(camera["model"] == "brown");
  CHECK(camera["fx"] == 400.5);
  CHECK(camera["k1"] == -0.1);
  CHECK(camera["p2"] == -0.002);
  CHECK(camera["sigma"]["fy"] == 1.5);
  CHECK(camera["sigma"]["k3"].is_null());
  CHECK(camera["assumed"] == nlohmann::json{"k3"});
  CHECK(camera["covariance"].size() == 9);
  const auto& view = json["views"].at(0);
  CHECK(view["t_us"] == 123456789012);
  CHECK(view["R_cam_world"].size() == 9);
  CHECK(view["t_cam_world_m"] == nlohmann::json{0.5, -1.5, 2.0});
  CHECK(view["lines"] == 9);
  CHECK(json["diagnostics"]["counts"]["events"] == 1000000);
  CHECK(json["diagnostics"]["condition"] == 1e5);
}

TEST_CASE("a pair of cameras: both, what is between them, and whose view is whose") {
  CalibrationReport report = example();
  report.cameras[0].name = report.views[0].camera = "left";
  report.cameras.push_back(report.cameras[0]);
  report.cameras[1].name = "right";
  report.cameras[1].camera.fx = 500.25;
  report.views.push_back(report.views[0]);
  report.views[1].camera = "right";
  const double axis[] = {0, 1, 0};
  StereoReport stereo;
  stereo.T_right_left = rotated(axis, 0.25);
  stereo.sigma = {0.001, 0.002, 0.003, 0.004, 0.005, 0.006};
  stereo.covariance.assign(36, 0.5);
  stereo.baseline_m = 2.5;
  stereo.baseline_sigma_m = 0.125;
  report.stereo = stereo;

  const auto json = test::json_in(calibration_json(report));
  CHECK(json["cameras"].size() == 2);
  CHECK(json["cameras"][1]["fx"] == 500.25);
  CHECK(json["stereo"]["R_right_left"].size() == 9);
  CHECK(json["stereo"]["T_right_left_m"] == nlohmann::json{0.5, -1.5, 2.0});
  CHECK(json["stereo"]["sigma"]["rotation_rad"] == nlohmann::json{0.001, 0.002, 0.003});
  CHECK(json["stereo"]["sigma"]["T_right_left_m"] == nlohmann::json{0.004, 0.005, 0.006});
  CHECK(json["stereo"]["baseline_m"] == 2.5);
  CHECK(json["stereo"]["covariance"].size() == 6);
  CHECK(json["views"][0]["camera"] == "left");
  CHECK(json["views"][1]["camera"] == "right");

  const std::string yaml = calibration_opencv_yaml(report);
  CHECK(matrix(yaml, "camera_matrix") == matrix(yaml, "M1"));
  CHECK(matrix(yaml, "M2")[0] == 500.25);
  CHECK(matrix(yaml, "D2") == matrix(yaml, "D1"));
  CHECK(matrix(yaml, "R")[2] == doctest::Approx(std::sin(0.25)).epsilon(1e-12));
  CHECK(matrix(yaml, "T") == std::vector<double>{0.5, -1.5, 2.0});
  CHECK(matrix(yaml, "extrinsic_parameters").size() == 6);  // of the left camera's one view

  const std::string text = calibration_text(report);
  CHECK(text.find("left, 640x480") != std::string::npos);
  CHECK(text.find("baseline 2500 +- 125 mm") != std::string::npos);
}

TEST_CASE("a failure has a status, a reason and no camera") {
  CalibrationReport report;
  report.status = Status::degenerate_geometry;
  report.diagnostics.reason = "all lines are parallel";
  const auto json = test::json_in(calibration_json(report));
  CHECK(json["status"] == "degenerate_geometry");
  CHECK(json["cameras"].is_array());
  CHECK(json["cameras"].empty());
  CHECK(json["views"].empty());
  CHECK(json["diagnostics"]["reason"] == "all lines are parallel");
}

TEST_CASE("the OpenCV file holds camera, distortion and poses in OpenCV's order") {
  const std::string yaml = calibration_opencv_yaml(example());
  CHECK(yaml.rfind("%YAML:1.0\n---\n", 0) == 0);
  CHECK(yaml.find("\nimage_width: 640\nimage_height: 480\n") != std::string::npos);
  CHECK(matrix(yaml, "camera_matrix") == std::vector<double>{400.5, 0, 319.5, 0, 401, 240.25, 0, 0, 1});
  CHECK(matrix(yaml, "distortion_coefficients") == std::vector<double>{-0.1, 0.02, 0.001, -0.002, 0});
  const auto pose = matrix(yaml, "extrinsic_parameters");
  const double expected[] = {0.3, 0, 0.4, 0.5, -1.5, 2.0};
  for (std::size_t i = 0; i < 6; ++i) CHECK(pose[i] == doctest::Approx(expected[i]).epsilon(1e-12));
}

TEST_CASE("OpenCV's file has the Brown coefficients nearest to another model, and says how far they are off") {
  CHECK(calibration_opencv_yaml(example()).find("nearest") == std::string::npos);
  for (const DistortionModel model : {DistortionModel::polynomial, DistortionModel::division}) {
    CalibrationReport report = example();
    Camera& camera = report.cameras[0].camera;
    camera.model = model;
    camera.k1 = model == DistortionModel::division ? -0.2 : 0.2;
    camera.k2 = camera.p1 = camera.p2 = camera.k3 = 0.0;
    const std::string yaml = calibration_opencv_yaml(report);
    const std::string name = kDistortionModelNames[static_cast<std::size_t>(model)];
    CHECK(yaml.find("'" + name + "', which OpenCV does not have") != std::string::npos);
    const std::size_t said = yaml.find("off by ");
    REQUIRE(said != std::string::npos);
    const double off_px = std::stod(yaml.substr(said + 7));
    CHECK(off_px < 0.5);
    const auto k = matrix(yaml, "distortion_coefficients");
    double largest_px = 0.0;
    for (double r_d = 0.0; r_d < 0.99; r_d += 0.01) {  // the corner lies at 0.999
      const double q = r_d * r_d;
      const double r = model == DistortionModel::division ? r_d / (1.0 - 0.2 * q) : r_d * (1.0 + 0.2 * q);
      const double s = r * r;
      const double brown = r * (1.0 + s * (k[0] + s * (k[1] + s * k[4])));
      largest_px = std::max(largest_px, 401.0 * std::abs(brown - r_d));
    }
    CHECK(largest_px <= off_px + 0.02);
    CHECK(k[2] == 0.0);
    CHECK(k[3] == 0.0);
    CHECK(calibration_json(report).find("\"model\": \"" + name + "\"") != std::string::npos);
    const std::string text = calibration_text(report);
    CHECK(text.find("distortion: " + name) != std::string::npos);
    CHECK(text.find("p1") == std::string::npos);
  }
}

TEST_CASE("rotation vectors are right for all axes, for tiny angles and near pi") {
  const double axes[][3] = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0.6, 0.8, 0}, {-0.48, 0.6, 0.64}};
  for (const auto& axis : axes) {
    for (const double angle : {1e-9, 1e-3, 1.0, 2.5, 3.14159}) {
      CAPTURE(axis[0]);
      CAPTURE(angle);
      CalibrationReport report = example();
      report.views[0].T_cam_world = rotated(axis, angle);
      const auto pose = matrix(calibration_opencv_yaml(report), "extrinsic_parameters");
      for (std::size_t i = 0; i < 3; ++i) CHECK(std::abs(pose[i] - axis[i] * angle) < 1e-9 * angle + 1e-15);
    }
  }
}

TEST_CASE("every status has one plain line, and names the parameter it is about") {
  for (const Status status :
       {Status::ok, Status::too_few_lines, Status::degenerate_geometry, Status::no_match, Status::not_converged,
        Status::implausible_result, Status::undetermined, Status::numerical_failure, Status::capacity_exceeded}) {
    for (const std::uint8_t parameter : {std::uint8_t{0}, kNoParameter}) {
      CalibrationResult result;
      result.status = status;
      result.parameter = parameter;
      const std::string text = explanation(result);
      CHECK(text.size() > 10);
      CHECK(text.find('\n') == std::string::npos);
    }
  }
  CalibrationResult refused;
  refused.status = Status::undetermined;
  refused.parameter = 2;
  refused.camera.cx = 321.25;
  refused.sigma[2] = 40.5;
  CHECK(explanation(refused).find("cx too uncertain (321 with one sigma of 40 px);") != std::string::npos);
  refused.sigma[2] = 0;  // not computed
  CHECK(explanation(refused).find("cx too uncertain;") != std::string::npos);
  refused.status = Status::implausible_result;
  refused.parameter = 4;
  CHECK(explanation(refused).find("(k1)") != std::string::npos);
}

TEST_CASE("a refused solution gives no camera, but its figures") {
  CalibrationResult result;
  result.status = Status::undetermined;
  result.parameter = 0;
  result.camera.fx = 1234;
  result.iterations = 7;
  CalibrationReport report;
  add_result(result, {}, {}, {}, &report);
  CHECK(report.status == Status::undetermined);
  CHECK(report.cameras.empty());
  CHECK(report.diagnostics.reason.find("fx") != std::string::npos);
  const auto json = test::json_in(calibration_json(report));
  CHECK(json["diagnostics"]["iterations"] == 7);
  CHECK(calibration_text(report).rfind("no camera (undetermined): ", 0) == 0);
}

TEST_CASE("a solution is taken over with the views that were used") {
  const ViewLineResult lines[] = {{3, -0.5F, 0.75F, 1, false}, {2, 9.0F, 9.5F, 0, true}};
  ViewResult view_results[] = {{{}, 0.5, 4, 8, true, {}, {}}, {}, {{}, 0.25, 5, 10, true, {}, lines}};
  view_results[2].covariance[7 * 4] = 0.25;
  const View views[] = {{100, 0, 8}, {200, 8, 2}, {300, 10, 10}};
  CalibrationResult result;
  result.status = Status::ok;
  result.camera.fx = 400;
  result.sigma[0] = 0.0123;
  result.assumed[8] = true;
  result.views = view_results;
  CalibrationReport report;
  add_result(result, views, {"a", "b", "c"}, {"rim", "edge"}, &report);
  REQUIRE(report.views.size() == 2);
  CHECK(report.views[1].label == "c");
  CHECK(report.views[1].t_us == 300);
  CHECK(report.views[1].lines == 5);
  CHECK(report.views[1].sigma[4] == 0.5);
  const auto json = test::json_in(calibration_json(report));
  const auto& view = json["views"][1];
  CHECK(view["sigma"]["rotation_rad"] == std::vector<double>{0, 0, 0});
  CHECK(view["sigma"]["t_cam_world_m"] == std::vector<double>{0, 0.5, 0});
  CHECK(view["line_residuals"][0] ==
        nlohmann::json{{"line", "edge"}, {"points", 3}, {"mean_px", -0.5}, {"rms_px", 0.75}});
  CHECK(view["line_residuals"][1]["line"] == "rim");
  CHECK(view["line_residuals"][1]["left_out"] == true);
  CHECK(json["views"][0]["line_residuals"].empty());
  REQUIRE(report.cameras.size() == 1);
  CHECK(report.cameras[0].assumed == std::vector<std::string>{"k3"});
  const std::string text = calibration_text(report);
  CHECK(text.find("400.000 +- 0.012 px\n") != std::string::npos);
  CHECK(text.find("(held)") != std::string::npos);
}
