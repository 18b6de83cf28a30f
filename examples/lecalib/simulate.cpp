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
#include "progress.hpp"

namespace lecalib::command {
namespace {

struct Arguments {
  std::string target, sensor = "346x260", out, motion = "shake";
  double fov_deg = 60;
  std::optional<double> fx, fy, cx, cy;
  host::SimulatorOptions options;
};

/// What the options leave out: one focal length follows from the field of view or from the other, the principal point
/// is the image's centre.
Camera true_camera(const Arguments& arguments) {
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

void run(const Arguments& arguments) {
  host::SimulatorOptions options = arguments.options;
  options.motion = motion_named(arguments.motion);
  options.camera = true_camera(arguments);
  Progress progress("simulating");
  const host::Recording recording =
      take(host::simulate(arguments.target, options, [&](double done) { progress.update(done); }));
  constexpr std::string_view kFile = "file:";
  const std::string model_out = arguments.out + "/model.txt";
  if (arguments.target.rfind(kFile, 0) == 0 && host::is_same_file(arguments.target.substr(kFile.size()), model_out)) {
    fail({"is the target's own file, expected another folder for the recording", model_out});
  }
  check(host::write_recording(recording, arguments.out));
  const host::SensorStats& stats = recording.stats;
  std::printf("%zu events in %.3f s (%" PRIu64 " noise, %" PRIu64 " from hot pixels), %zu model lines\n",
              recording.events.size(), options.duration_s, stats.noise_events, stats.hot_events,
              recording.model.lines.size());
  for (const char* file : {"events.raw", "model.txt", "truth.json"}) {
    std::printf("%s/%s\n", arguments.out.c_str(), file);
  }
}

void add_camera_options(CLI::App* command, Arguments* arguments) {
  Camera& camera = arguments->options.camera;
  command->add_option("--sensor", arguments->sensor, "size of the sensor, WxH pixels")->capture_default_str();
  CLI::Option* fov =
      command->add_option("--fov", arguments->fov_deg, "field of view across the width, degrees, before distortion");
  fov->capture_default_str()->check(CLI::Range(1.0, 170.0));
  command->add_option("--fx", arguments->fx, "focal length, px; replaces --fov")->excludes(fov);
  command->add_option("--fy", arguments->fy, "focal length, px; as --fx when left out")->excludes(fov);
  command->add_option("--cx", arguments->cx, "principal point, px; the image's centre when left out");
  command->add_option("--cy", arguments->cy, "principal point, px; the image's centre when left out");
  command->add_option("--k1", camera.k1, "radial distortion, as in OpenCV")->capture_default_str();
  command->add_option("--k2", camera.k2, "radial distortion")->capture_default_str();
  command->add_option("--p1", camera.p1, "tangential distortion")->capture_default_str();
  command->add_option("--p2", camera.p2, "tangential distortion")->capture_default_str();
  command->add_option("--k3", camera.k3, "radial distortion")->capture_default_str();
}

void add_sensor_options(CLI::App* command, host::SensorOptions* sensor) {
  command->add_option("--threshold", sensor->threshold, "change of ln(brightness) that makes an event")
      ->capture_default_str();
  command->add_option("--noise", sensor->noise_hz, "events without cause per pixel, Hz")->capture_default_str();
  command->add_option("--hot-fraction", sensor->hot_fraction, "part of the pixels that fire without end")
      ->capture_default_str();
  command->add_option("--bandwidth", sensor->bandwidth_hz, "of the pixels in mid brightness, Hz")
      ->capture_default_str();
  command->add_option("--refractory-us", sensor->refractory_us, "blind time after an event, us")->capture_default_str();
  command->add_option("--jitter-us", sensor->jitter_us, "one sigma of the time stamps, us")->capture_default_str();
}

}  // namespace

void add_simulate(CLI::App& app) {
  const auto arguments = std::make_shared<Arguments>();
  host::SimulatorOptions& options = arguments->options;
  CLI::App* command = app.add_subcommand("simulate", "make a recording with exact truth");
  command->footer(
      "Writes events.raw (EVT3), model.txt and truth.json. The model holds the target's lines that the camera sees: of "
      "a box\n"
      "the edges of its visible faces. A file's lines are drawn as dark strips on a board, or, when they do not lie in "
      "one\n"
      "plane, as dark rods: such lines make events at both of their flanks.");
  command
      ->add_option("--target", arguments->target,
                   "rectangle:WxH, box:WxHxD, checkerboard:CxR:S (inner corners, square) in metres, or file:PATH")
      ->required();
  command->add_option("--out", arguments->out, "folder for the recording, made when missing")->required();
  command->add_option("--motion", arguments->motion, "shake, sweep around the target, or rotate about the axis")
      ->capture_default_str()
      ->check(CLI::IsMember({"shake", "sweep", "rotate"}));
  command->add_option("--speed", options.speed, "factor on the motion's frequencies")->capture_default_str();
  command->add_option("--duration-s", options.duration_s, "length of the recording, s")->capture_default_str();
  command->add_option("--seed", options.seed, "of motion, pixels and noise")->capture_default_str();
  command->add_option("--start-us", options.start_us, "time of the first frame, us")->capture_default_str();
  add_camera_options(command, arguments.get());
  add_sensor_options(command, &options.sensor);
  command->add_option("--truth-hz", options.pose_rate_hz, "poses per second in truth.json")->capture_default_str();
  command->add_option("--truth-views", options.views, "instants at which truth.json lists the lines' images")
      ->capture_default_str();
  command->callback([arguments] { run(*arguments); });
}

}  // namespace lecalib::command
