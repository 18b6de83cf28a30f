// SPDX-License-Identifier: MIT
#include "lecalib/host/simulator_truth.hpp"

#include <cmath>
#include <cstdio>

#include "lecalib/host/json_writer.hpp"
#include "lecalib/math/camera_model.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib::host {
namespace {

constexpr double kSameDepth = 1e-6;  ///< part of the depth: a line hides nothing of itself

/// Whether a face of the target stands between the camera and the point. The room hides nothing of what is in it.
bool hidden(const Scene& scene, const Vec3& camera_center, const Vec3& point) {
  const Vec3 ray = point - camera_center;
  for (std::size_t i = 0; i < scene.target_faces; ++i) {
    const Face& face = scene.faces[i];
    const double height = face.normal().dot(camera_center - face.origin);
    if (height <= 0.0) continue;  // seen from behind
    const double descent = -face.normal().dot(ray);
    if (descent <= 0.0) continue;
    const double depth = height / descent;
    if (depth >= 1.0 - kSameDepth) continue;
    const Vec3 at = camera_center + depth * ray - face.origin;
    const double u = at.dot(face.u), v = at.dot(face.v);
    if (u >= 0.0 && u <= face.width && v >= 0.0 && v <= face.height) return true;
  }
  return false;
}

bool inside(const Camera& camera, const Vec2& uv) {
  return uv.minCoeff() >= 0.0 && uv(0) <= camera.width - 1 && uv(1) <= camera.height - 1;
}

std::int64_t to_us(double t_s) { return static_cast<std::int64_t>(std::floor(1e6 * t_s + 0.5)); }

bool ever_visible(const std::vector<TrueView>& views, std::size_t line) {
  for (const TrueView& view : views) {
    int points = 0;
    for (const bool visible : view.lines[line].visible) points += visible ? 1 : 0;
    if (points >= 2) return true;  // the end of a hidden edge may touch a visible corner
  }
  return false;
}

void drop_hidden_lines(Recording* recording) {
  Model model;
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < recording->model.lines.size(); ++i) {
    if (!ever_visible(recording->views, i)) continue;
    kept.push_back(i);
    model.lines.push_back(recording->model.lines[i]);
    model.names.push_back(recording->model.names[i]);
  }
  for (TrueView& view : recording->views) {
    std::vector<TrueLine> lines;
    lines.reserve(kept.size());
    for (const std::size_t i : kept) lines.push_back(view.lines[i]);
    view.lines = std::move(lines);
  }
  recording->model = std::move(model);
}

/// To 1 / per_unit: decimals beyond that only make the file longer.
double rounded(double value, double per_unit) { return std::floor(value * per_unit + 0.5) / per_unit; }

template <std::size_t N>
void write_rounded(const double (&values)[N], double per_unit, JsonWriter* json) {
  double shortened[N];
  for (std::size_t i = 0; i < N; ++i) shortened[i] = rounded(values[i], per_unit);
  json->numbers(shortened);
}

constexpr double kPerPixel = 1e3;
constexpr double kPerPoseUnit = 1e9;  // of a quaternion's entries, and metres

void write_camera(const Camera& camera, JsonWriter* json) {
  json->key("camera");
  json->begin_object();
  json->member("width", camera.width);
  json->member("height", camera.height);
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) json->member(kIntrinsicNames[i], camera.*kIntrinsics[i]);
  json->end();
}

void write_sensor(const SensorOptions& options, const SensorStats& stats, JsonWriter* json) {
  json->key("sensor");
  json->begin_object();
  json->member("threshold", options.threshold);
  json->member("threshold_spread", options.threshold_spread);
  json->member("threshold_noise", options.threshold_noise);
  json->member("bandwidth_hz", options.bandwidth_hz);
  json->member("refractory_us", options.refractory_us);
  json->member("noise_hz", options.noise_hz);
  json->member("hot_fraction", options.hot_fraction);
  json->member("jitter_us", options.jitter_us);
  json->end();
  json->key("events");
  json->begin_object();
  json->member("scene", stats.scene_events);
  json->member("noise", stats.noise_events);
  json->member("hot_pixels", stats.hot_events);
  json->end();
}

void write_poses(const std::vector<TimedPose>& poses, JsonWriter* json) {
  json->key("poses");
  json->begin_object();
  json->key("t_us");
  json->begin_array(JsonWriter::Layout::one_line);
  for (const TimedPose& pose : poses) json->value(pose.t_us);
  json->end();
  json->key("q_wxyz");
  json->begin_array();
  Eigen::Quaterniond last = Eigen::Quaterniond::Identity();
  for (const TimedPose& pose : poses) {
    Eigen::Quaterniond q(rotation_of(pose.T_cam_world));
    if (q.dot(last) < 0) q.coeffs() = -q.coeffs();  // readers interpolate between neighbours
    last = q;
    write_rounded({q.w(), q.x(), q.y(), q.z()}, kPerPoseUnit, json);
  }
  json->end();
  json->key("t");
  json->begin_array();
  for (const TimedPose& pose : poses) write_rounded(pose.T_cam_world.t, kPerPoseUnit, json);
  json->end();
  json->end();
}

void write_lines_3d(const Model& model, JsonWriter* json) {
  json->key("lines_3d");
  json->begin_array();
  for (std::size_t i = 0; i < model.lines.size(); ++i) {
    json->begin_object(JsonWriter::Layout::one_line);
    json->member("name", model.names[i]);
    json->key("p");
    json->numbers(model.lines[i].p);
    json->key("q");
    json->numbers(model.lines[i].q);
    json->end();
  }
  json->end();
}

void write_line_2d(const std::string& name, const TrueLine& line, JsonWriter* json) {
  json->begin_object(JsonWriter::Layout::one_line);
  json->member("name", name);
  json->key("uv");
  json->begin_array(JsonWriter::Layout::one_line);
  for (const Vec2& uv : line.uv) write_rounded({uv(0), uv(1)}, kPerPixel, json);
  json->end();
  json->key("visible");
  json->begin_array(JsonWriter::Layout::one_line);
  for (const bool visible : line.visible) json->value(visible ? 1 : 0);
  json->end();
  json->end();
}

void write_lines_2d(const Recording& recording, JsonWriter* json) {
  json->key("lines_2d");
  json->begin_array();
  for (const TrueView& view : recording.views) {
    json->begin_object();
    json->member("t_us", view.t_us);
    json->key("lines");
    json->begin_array();
    for (std::size_t i = 0; i < view.lines.size(); ++i) write_line_2d(recording.model.names[i], view.lines[i], json);
    json->end();
    json->end();
  }
  json->end();
}

}  // namespace

TrueView true_view(const Scene& scene, const Model& model, const Camera& camera, const Pose& pose, std::int64_t t_us) {
  const Mat3 R = rotation_of(pose);
  const Vec3 t = translation_of(pose);
  const Vec3 center = -R.transpose() * t;
  TrueView view;
  view.t_us = t_us;
  for (const ModelLine& line : model.lines) {
    TrueLine image;
    for (std::size_t i = 0; i < kTruthPoints; ++i) {
      const double s = static_cast<double>(i) / (kTruthPoints - 1);
      const Vec3 point = (1.0 - s) * Vec3(line.p) + s * Vec3(line.q);
      const Vec3 x_cam = R * point + t;
      Vec2 uv = Vec2::Zero();
      const bool seen = x_cam(2) > 0.0 && project(camera, x_cam, &uv);
      image.uv[i] = uv;
      image.visible[i] = seen && inside(camera, uv) && !hidden(scene, center, point);
    }
    view.lines.push_back(image);
  }
  return view;
}

void add_truth(const Scene& scene, const Trajectory& trajectory, Recording* recording) {
  const SimulatorOptions& options = recording->options;
  const auto steps = static_cast<std::size_t>(std::ceil(options.duration_s * options.pose_rate_hz));
  for (std::size_t i = 0; i <= steps; ++i) {
    // Each pose belongs to the whole microsecond that is written beside it.
    const std::int64_t since_us = to_us(options.duration_s * static_cast<double>(i) / static_cast<double>(steps));
    recording->poses.push_back({options.start_us + since_us, trajectory.at(1e-6 * static_cast<double>(since_us))});
  }
  for (std::size_t i = 0; i < options.views; ++i) {
    const std::int64_t since_us =
        to_us(options.duration_s * static_cast<double>(i) / static_cast<double>(options.views - 1));
    recording->views.push_back(true_view(scene, recording->model, options.camera,
                                         trajectory.at(1e-6 * static_cast<double>(since_us)),
                                         options.start_us + since_us));
  }
  drop_hidden_lines(recording);
}

std::string truth_json(const Recording& recording) {
  constexpr const char* kMotions[] = {"shake", "sweep", "rotate"};
  const SimulatorOptions& options = recording.options;
  JsonWriter json;
  json.begin_object();
  json.member("target", recording.target);
  json.member("motion", kMotions[static_cast<std::size_t>(options.motion)]);
  json.member("speed", options.speed);
  json.member("duration_s", options.duration_s);
  json.member("t0_us", options.start_us);
  json.member("seed", options.seed);
  json.member("conventions",
              "pixel centres at integers; x_cam = R(q_wxyz) x_world + t; OpenCV's camera axes and Brown model; metres; "
              "t_us as in events.raw");
  write_camera(options.camera, &json);
  write_sensor(options.sensor, recording.stats, &json);
  write_poses(recording.poses, &json);
  write_lines_3d(recording.model, &json);
  write_lines_2d(recording, &json);
  json.end();
  return json.text();
}

std::string model_text(const Model& model) {
  std::string out = "# x1 y1 z1 x2 y2 z2 name   (metres)\n";
  for (std::size_t i = 0; i < model.lines.size(); ++i) {
    for (const double* end : {model.lines[i].p, model.lines[i].q}) {
      char text[96];
      std::snprintf(text, sizeof text, "%.9g %.9g %.9g ", end[0], end[1], end[2]);
      out += text;
    }
    out += model.names[i] + "\n";
  }
  return out;
}

std::string stereo_truth_json(const Pose& T_right_left) {
  JsonWriter json;
  json.begin_object();
  json.member("note", "x_right = R x_left + t");
  json.key("R_right_left");
  json.begin_array();
  for (std::size_t row = 0; row < 3; ++row) json.numbers(Span<const double>(T_right_left.R + 3 * row, 3));
  json.end();
  json.key("t_right_left");
  json.numbers(T_right_left.t);
  json.member("baseline_m", translation_of(T_right_left).norm());
  json.end();
  return json.text();
}

}  // namespace lecalib::host
