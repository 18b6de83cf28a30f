// SPDX-License-Identifier: MIT
/// lecalib simulate: a recording with exact truth.
#include <cinttypes>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "commands.hpp"
#include "lecalib/host/file_io.hpp"
#include "lecalib/host/sensor_size.hpp"
#include "lecalib/host/simulator.hpp"
#include "lecalib/math/trigonometry.hpp"
#include "pose_option.hpp"
#include "progress.hpp"

namespace lecalib::command {
namespace {

struct SimulateArguments {
  std::string target, sensor = "346x260", out, motion = "shake", right_at;
  double fov_deg = 60;
  std::optional<double> fx, fy, cx, cy;
  host::SimulatorOptions options;
};

/// What the options leave out: one focal length follows from the field of view or from the other, the principal point
/// is the image's centre.
Camera true_camera(const SimulateArguments& arguments) {
  const SensorSize size = take(host::parse_sensor(arguments.sensor));
  Camera camera = arguments.options.camera;
  camera.width = size.width;
  camera.height = size.height;
  const double focal = 0.5 * size.width / tangent(deg_to_rad(0.5 * arguments.fov_deg));
  camera.fx = arguments.fx.value_or(arguments.fy.value_or(focal));
  camera.fy = arguments.fy.value_or(camera.fx);
  camera.cx = arguments.cx.value_or(0.5 * (size.width - 1));
  camera.cy = arguments.cy.value_or(0.5 * (size.height - 1));
  return camera;
}

host::Motion motion_named(std::string_view name) {
  if (name == "sweep") return host::Motion::sweep;
  return name == "rotate" ? host::Motion::rotate : host::Motion::shake;
}

void simulate_into(const std::string& folder, const std::string& target, const host::SimulatorOptions& options) {
  Progress progress("simulating");
  const host::Recording recording = take(host::simulate(target, options, [&](double done) { progress.update(done); }));
  check(host::write_recording(recording, folder));
  const host::SensorStats& stats = recording.stats;
  std::printf("%zu events in %.3f s (%" PRIu64 " noise, %" PRIu64 " from hot pixels), %zu model lines\n",
              recording.events.size(), options.duration_s, stats.noise_events, stats.hot_events,
              recording.model.lines.size());
  for (const char* file : {"events.raw", "model.txt", "truth.json"}) {
    std::printf("%s/%s\n", folder.c_str(), file);
  }
}

void run_simulate(const SimulateArguments& arguments) {
  constexpr std::string_view kFile = "file:";
  const std::string model_out = arguments.out + "/model.txt";
  if (arguments.target.rfind(kFile, 0) == 0 && host::is_same_file(arguments.target.substr(kFile.size()), model_out)) {
    fail({"is the target's own file, expected another folder for the recording", model_out});
  }
  host::SimulatorOptions options = arguments.options;
  options.motion = motion_named(arguments.motion);
  options.camera = true_camera(arguments);
  if (arguments.right_at.empty()) {
    simulate_into(arguments.out, arguments.target, options);
    return;
  }
  options.rig.push_back(pose_of("--right-at", arguments.right_at));
  for (const char* side : {"left", "right"}) {
    simulate_into(arguments.out + "/" + side, arguments.target, options);
    ++options.rig_camera;
  }
  const std::string truth_out = arguments.out + "/stereo.json";
  check(host::write_file(truth_out, host::stereo_truth_json(options.rig.back())));
  std::printf("%s\n", truth_out.c_str());
}

/// One number with its default in --help.
void add_number(CLI::App* command, const char* name, double* value, const char* unit, const char* meaning) {
  command->add_option(name, *value, meaning)->type_name(unit)->capture_default_str();
}

void add_camera_options(CLI::App* command, SimulateArguments* arguments) {
  Camera& camera = arguments->options.camera;
  command->add_option("--sensor", arguments->sensor, "Size of the sensor, px")->type_name("WxH")->capture_default_str();
  CLI::Option* fov =
      command->add_option("--fov", arguments->fov_deg, "Field of view across the width, undistorted, 1 to 170");
  fov->type_name("DEG")->capture_default_str()->check(CLI::Range(1.0, 170.0).description(""));
  command->add_option("--fx", arguments->fx, "Focal length, replaces --fov")->type_name("PX")->excludes(fov);
  command->add_option("--fy", arguments->fy, "Focal length, default as --fx")->type_name("PX")->excludes(fov);
  command->add_option("--cx", arguments->cx, "Principal point, default the image's centre")->type_name("PX");
  command->add_option("--cy", arguments->cy, "Principal point, default the image's centre")->type_name("PX");
  add_number(command, "--k1", &camera.k1, "", "Radial distortion r^2, signs as in OpenCV");
  add_number(command, "--k2", &camera.k2, "", "Radial distortion r^4");
  add_number(command, "--k3", &camera.k3, "", "Radial distortion r^6");
  add_number(command, "--p1", &camera.p1, "", "Tangential distortion");
  add_number(command, "--p2", &camera.p2, "", "Tangential distortion");
}

void add_sensor_options(CLI::App* command, host::SensorOptions* sensor) {
  add_number(command, "--threshold", &sensor->threshold, "LN", "Change of ln(brightness) that makes an event");
  add_number(command, "--noise", &sensor->noise_hz, "HZ", "Events without cause, per pixel");
  add_number(command, "--hot-fraction", &sensor->hot_fraction, "", "Part of the pixels that fire without end");
  add_number(command, "--bandwidth", &sensor->bandwidth_hz, "HZ", "Of the pixels in mid brightness");
  add_number(command, "--refractory-us", &sensor->refractory_us, "US", "Blind time after an event");
  add_number(command, "--jitter-us", &sensor->jitter_us, "US", "One sigma of the time stamps");
}

void add_motion_options(CLI::App* command, SimulateArguments* arguments) {
  host::SimulatorOptions& options = arguments->options;
  command->add_option("--motion", arguments->motion, "shake by hand, sweep around the target or rotate about the axis")
      ->type_name("NAME")
      ->capture_default_str()
      ->check(CLI::IsMember({"shake", "sweep", "rotate"}).description(""));
  add_number(command, "--speed", &options.speed, "", "Factor on the motion's frequencies");
  add_number(command, "--duration-s", &options.duration_s, "S", "Length of the recording");
  command->add_option("--start-us", options.start_us, "Time of the first frame")
      ->type_name("US")
      ->capture_default_str();
  command->add_option("--seed", options.seed, "Of motion, pixels and noise")->type_name("N")->capture_default_str();
}

}  // namespace

void add_simulate(CLI::App& app) {
  const auto arguments = std::make_shared<SimulateArguments>();
  host::SimulatorOptions& options = arguments->options;
  CLI::App* command = app.add_subcommand("simulate", "Make a recording with exact truth");
  command->footer(
      "Writes events.raw (EVT3), model.txt and truth.json. The model holds the target's lines that the\n"
      "camera sees: of a box the edges of its visible faces. Lines of a file are drawn as dark strips on\n"
      "a board or, when they do not lie in one plane, as dark rods; such lines make events at both of\n"
      "their flanks.");
  command
      ->add_option("--target", arguments->target,
                   "What is seen, metres: rectangle:WxH, box:WxHxD, checkerboard:CxR:S (inner corners, square) or "
                   "file:PATH")
      ->type_name("SPEC")
      ->required();
  command->add_option("--out", arguments->out, "Folder to write to; made if missing")->type_name("DIR")->required();
  command
      ->add_option("--right-at", arguments->right_at,
                   "A second camera of the same kind, fixed to the first one: T_right_left, rotation vector (rad) and "
                   "translation (m); the two recordings go to DIR/left and DIR/right")
      ->type_name(kPoseWords);
  add_motion_options(command, arguments.get());
  add_camera_options(command, arguments.get());
  add_sensor_options(command, &options.sensor);
  add_number(command, "--truth-hz", &options.pose_rate_hz, "HZ", "Poses per second in truth.json");
  command->add_option("--truth-views", options.views, "Instants at which truth.json lists the lines' images")
      ->type_name("N")
      ->capture_default_str();
  command->callback([arguments] { run_simulate(*arguments); });
}

}  // namespace lecalib::command
