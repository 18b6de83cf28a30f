// SPDX-License-Identifier: MIT
#include "lecalib/host/calibration_report.hpp"
#include "lecalib/host/json_writer.hpp"

namespace lecalib::host {
namespace {

using Layout = JsonWriter::Layout;

void write_strings(JsonWriter* json, const char* name, const std::vector<std::string>& strings) {
  json->key(name);
  json->begin_array(Layout::one_line);
  for (const std::string& text : strings) json->value(text);
  json->end();
}

template <class Named>
void write_named(JsonWriter* json, const char* name, const std::vector<Named>& values) {
  json->key(name);
  json->begin_object();
  for (const Named& value : values) json->member(value.name, value.value);
  json->end();
}

void write_covariance(JsonWriter* json, const std::vector<double>& values, std::size_t rows) {
  if (values.size() != rows * rows) return;
  json->key("covariance");
  json->begin_array();
  for (std::size_t row = 0; row < rows; ++row) json->numbers(Span<const double>(values).subspan(row * rows, rows));
  json->end();
}

void write_camera(JsonWriter* json, const CameraReport& report) {
  json->begin_object();
  json->member("name", report.name);
  json->member("width", report.camera.width);
  json->member("height", report.camera.height);
  json->member("model", kDistortionModelNames[static_cast<std::size_t>(report.camera.model)]);
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) json->member(kIntrinsicNames[i], report.camera.*kIntrinsics[i]);
  json->key("sigma");
  json->begin_object();
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) json->member(kIntrinsicNames[i], report.sigma[i]);
  json->end();
  json->member("rms_px", report.rms_px);
  write_strings(json, "assumed", report.assumed);
  write_covariance(json, report.covariance, kNumIntrinsics);
  json->end();
}

void write_pose_sigma(JsonWriter* json, const std::array<double, 6>& sigma, const char* translation) {
  json->key("sigma");
  json->begin_object(Layout::one_line);
  json->key("rotation_rad");
  json->numbers(Span<const double>(sigma.data(), 3));
  json->key(translation);
  json->numbers(Span<const double>(sigma.data() + 3, 3));
  json->end();
}

void write_stereo(JsonWriter* json, const StereoReport& stereo) {
  json->begin_object();
  json->key("R_right_left");
  json->numbers(stereo.T_right_left.R);
  json->key("T_right_left_m");
  json->numbers(stereo.T_right_left.t);
  write_pose_sigma(json, stereo.sigma, "T_right_left_m");
  json->member("baseline_m", stereo.baseline_m);
  json->member("baseline_sigma_m", stereo.baseline_sigma_m);
  write_covariance(json, stereo.covariance, stereo.sigma.size());
  json->end();
}

void write_line(JsonWriter* json, const LineReport& line) {
  json->begin_object(Layout::one_line);
  json->member("line", line.name);
  json->member("points", line.points);
  json->member("mean_px", line.mean_px);
  json->member("rms_px", line.rms_px);
  if (line.left_out) json->member("left_out", true);
  json->end();
}

/// @param of_pair says which camera has seen the view
void write_view(JsonWriter* json, const ViewReport& view, bool of_pair) {
  json->begin_object();
  if (of_pair) json->member("camera", view.camera);
  if (!view.label.empty()) json->member("name", view.label);
  json->member("t_us", view.t_us);
  json->key("R_cam_world");
  json->numbers(view.T_cam_world.R);
  json->key("t_cam_world_m");
  json->numbers(view.T_cam_world.t);
  json->member("lines", view.lines);
  json->member("rms_px", view.rms_px);
  write_pose_sigma(json, view.sigma, "t_cam_world_m");
  json->key("line_residuals");
  json->begin_array();
  for (const LineReport& line : view.line_residuals) write_line(json, line);
  json->end();
  json->end();
}

void write_coverage(JsonWriter* json, const Coverage& coverage) {
  json->begin_object();
  json->key("hints");
  json->begin_array(Layout::one_line);
  for (std::size_t i = 0; i < coverage.num_hints(); ++i) json->value(to_string(coverage.hints[i]));
  json->end();
  json->member("windows", coverage.windows);
  json->member("useful_windows", coverage.useful_windows);
  json->member("covered_share", static_cast<double>(coverage.covered_share));
  json->member("travel_px", static_cast<double>(coverage.travel_px));
  json->key("cells");
  json->begin_array();
  for (const auto& row : coverage.cells) {
    json->begin_array(Layout::one_line);
    for (const std::uint16_t cell : row) json->value(cell);
    json->end();
  }
  json->end();
  if (coverage.matched_windows > 0) {
    json->member("tilt_deg", static_cast<double>(coverage.tilt_deg));
    json->member("roll_deg", static_cast<double>(coverage.roll_deg));
    json->member("distance_min_m", static_cast<double>(coverage.distance_min_m));
    json->member("distance_max_m", static_cast<double>(coverage.distance_max_m));
  }
  if (coverage.worst < kNumIntrinsics) json->member("worst", kIntrinsicNames[coverage.worst]);
  json->end();
}

void write_diagnostics(JsonWriter* json, const Diagnostics& diagnostics) {
  json->begin_object();
  json->member("reason", diagnostics.reason);
  if (!diagnostics.stopped_by.empty()) json->member("stopped_by", diagnostics.stopped_by);
  write_strings(json, "inputs", diagnostics.inputs);
  write_named(json, "counts", diagnostics.counts);
  write_named(json, "dropped", diagnostics.dropped);
  for (const NamedNumber& number : diagnostics.numbers) json->member(number.name, number.value);
  write_named(json, "cpu_ms", diagnostics.cpu_ms);
  if (diagnostics.coverage) {
    json->key("coverage");
    write_coverage(json, *diagnostics.coverage);
  }
  json->end();
}

}  // namespace

std::string calibration_json(const CalibrationReport& report) {
  JsonWriter json;
  json.begin_object();
  json.member("version", 1);
  json.member("status", to_string(report.status));
  json.key("cameras");
  json.begin_array();
  for (const CameraReport& camera : report.cameras) write_camera(&json, camera);
  json.end();
  json.key("stereo");
  if (report.stereo) {
    write_stereo(&json, *report.stereo);
  } else {
    json.null();
  }
  json.key("views");
  json.begin_array();
  for (const ViewReport& view : report.views) write_view(&json, view, report.stereo.has_value());
  json.end();
  json.key("diagnostics");
  write_diagnostics(&json, report.diagnostics);
  json.end();
  return json.text();
}

}  // namespace lecalib::host
