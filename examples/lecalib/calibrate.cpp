// SPDX-License-Identifier: MIT
/// lecalib calibrate: from a recording, or from lines measured elsewhere, to the camera.
#include "calibrate.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "commands.hpp"
#include "event_options.hpp"
#include "lecalib/host/file_io.hpp"
#include "lecalib/host/text.hpp"
#include "pose_option.hpp"

namespace lecalib::command {
namespace {

constexpr const char* kJsonName = "calibration.json";
constexpr const char* kYamlName = "calibration.yaml";

/// Cameras send what their inertial sensors read as it is: 0.1 rad/s at rest is common.
constexpr double kBiasOfRecording = 0.1;

DistortionModel distortion_model(const std::string& name) {
  const char* const* const end = kDistortionModelNames + kNumDistortionModels;
  return static_cast<DistortionModel>(std::find(kDistortionModelNames, end, name) - kDistortionModelNames);
}

void check_options(const CalibrateOptions& options) {
  if (options.gyro == kGyroOfRecording && options.events.size() != 1) {
    fail({"--gyro recording needs one recording as EVENTS"});
  }
  if (options.model.empty() == options.target.empty()) {
    fail({"expected either --model FILE or --target SPEC"});
  }
  if (!options.observations.empty() && (options.focal_px > 0 || !options.hint_pose.empty())) {
    fail({"--focal and --hint-pose help to find the object in EVENTS; with --observations that is known"});
  }
  const auto model = static_cast<std::size_t>(distortion_model(options.distortion));
  if (options.free_k3 && !kHasIntrinsic[model][kNumIntrinsics - 1]) {
    fail({"--free-k3 does not go with --distortion " + options.distortion + ", which has k1 alone"});
  }
}

/// The folder holds one answer: a failure takes the place of what an earlier run left there.
void write_results(const std::string& folder, const host::CalibrationReport& report) {
  const std::string yaml_path = folder + "/" + kYamlName;
  if (report.status == Status::ok) {
    check(host::write_file(yaml_path, calibration_opencv_yaml(report)));
  } else {
    std::error_code ignored;
    std::filesystem::remove(yaml_path, ignored);
  }
  check(host::write_file(folder + "/" + kJsonName, calibration_json(report)));
}

/// On stderr: what would make the answer better. What a refusal lacks stands in its reason.
void print_hints(const host::CalibrationReport& report) {
  if (!report.diagnostics.coverage) return;
  const Coverage& coverage = *report.diagnostics.coverage;
  for (std::size_t i = 0; i < coverage.num_hints() && coverage.hints[i] != CoverageHint::enough; ++i) {
    std::fprintf(stderr, "%s %s\n", i == 0 ? "for a smaller sigma:" : "or:", host::advice(coverage.hints[i]).c_str());
  }
}

void run_calibrate(const CalibrateOptions& options) {
  if (options.events.empty() == options.observations.empty()) {
    fail({"calibrate needs either EVENTS or --observations FILE"});
  }
  if (!options.right.empty()) {
    if (options.events.empty()) fail({"--right needs the left camera's EVENTS"});
    if (!options.gyro.empty()) fail({"--gyro goes with one camera, not with --right"});
  }
  const auto way = !options.observations.empty() ? &calibrate_observations
                   : !options.right.empty()      ? &calibrate_stereo
                                                 : &calibrate_events;
  run_calibration(options,
                  [&](const host::Model& model, host::CalibrationReport* report) { way(options, model, report); });
}

void add_inputs(CLI::App* command, CalibrateOptions* options) {
  command
      ->add_option("EVENTS", options->events,
                   "Recordings of one camera: RAW, DAT, AEDAT, Event Stream or text (t x y p)")
      ->type_name("");
  command
      ->add_option("--right", options->right,
                   "Recordings of a second camera, fixed to the one of EVENTS and on the same clock: both cameras and "
                   "the pose between them; EVENTS are of the left one")
      ->type_name("EVENTS...");
  command
      ->add_option("--observations", options->observations,
                   "Instead of EVENTS: points measured on model lines, CSV view,line,u_px,v_px[,sigma_px][,t_us]")
      ->type_name("FILE");
  add_sensor_option(command, &options->sensor);
}

void add_hints(CLI::App* command, CalibrateOptions* options) {
  command
      ->add_option(
          "--focal", options->focal_px,
          "Hint for EVENTS, no measurement: the focal length to about 20 %, tried first and believed where two "
          "explanations are as good; with --right, of both cameras")
      ->type_name("PX")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--hint-pose", options->hint_pose,
                   "Hint for EVENTS: from model to camera where the object is first seen, rotation vector (rad) and "
                   "translation (m), to about 20 degrees and a third of the distance; with --right, to the left camera")
      ->type_name(kPoseWords);
}

}  // namespace

void CalibrateOptions::apply(MonoSolverOptions* solver) const {
  solver->policy.model = distortion_model(distortion);
  solver->policy.free_k3 = free_k3;
  solver->policy.free_distortion = !hold_distortion;
  solver->policy.free_centre = !hold_centre;
  solver->reject_lines = !trust_lines;
  if (max_focal_sigma > 0) solver->plausibility.max_focal_sigma = max_focal_sigma;
}

GyroOptions CalibrateOptions::gyro_options() const {
  GyroOptions made;
  made.noise_density = gyro_noise;
  if (gyro == kGyroOfRecording) made.bias_sigma = kBiasOfRecording;
  if (gyro_bias) made.bias_sigma = *gyro_bias;
  return made;
}

MatchHints CalibrateOptions::hints() const {
  MatchHints hints;
  hints.focal_px = focal_px;
  if (!hint_pose.empty()) {
    hints.has_pose = true;
    hints.T_cam_world = pose_of("--hint-pose", hint_pose);
  }
  return hints;
}

void run_calibration(const CalibrateOptions& options,
                     const std::function<void(const host::Model&, host::CalibrationReport*)>& calibrate) {
  check_options(options);
  if (!options.out.empty()) check(host::make_folder(options.out));
  host::CalibrationReport report;
  try {
    const host::Model model =
        take(options.model.empty() ? host::make_target(options.target) : host::read_model(options.model));
    report.diagnostics.inputs.push_back(options.model.empty() ? options.target : options.model);
    calibrate(model, &report);
  } catch (const Failure& failure) {
    report.status = failure.error.status;
    report.diagnostics.reason = to_string(failure.error);
    if (!options.out.empty()) write_results(options.out, report);
    throw;
  }
  if (!options.out.empty()) write_results(options.out, report);
  if (report.status != Status::ok) {
    fail({"no camera (" + std::string(to_string(report.status)) + "): " + report.diagnostics.reason});
  }
  print_hints(report);
  std::fputs(calibration_text(report).c_str(), stdout);
  if (!options.out.empty()) {
    std::printf("written: %s/%s, %s/%s\n", options.out.c_str(), kJsonName, options.out.c_str(), kYamlName);
  }
}

void add_model_options(CLI::App* command, CalibrateOptions* options) {
  command->add_option("--model", options->model, "Lines of the object, metres, rows: x1 y1 z1 x2 y2 z2 name")
      ->type_name("FILE");
  command
      ->add_option(
          "--target", options->target,
          "Instead of --model, metres: rectangle:WxH, box:WxHxD, checkerboard:CxR:S (inner corners, square) or "
          "file:PATH")
      ->type_name("SPEC");
  command
      ->add_option("--out", options->out,
                   "Folder to write calibration.json and calibration.yaml (OpenCV) to; made if missing")
      ->type_name("DIR");
}

void add_solver_options(CLI::App* command, CalibrateOptions* options) {
  command
      ->add_option("--distortion", options->distortion,
                   "brown (OpenCV's), polynomial (distorted to ideal) or division (one coefficient)")
      ->type_name("MODEL")
      ->capture_default_str()
      ->check(
          CLI::IsMember(std::vector<std::string>(kDistortionModelNames, kDistortionModelNames + kNumDistortionModels)));
  command
      ->add_option("--gyro", options->gyro,
                   "Readings of a gyro fixed to the camera, CSV t_us,wx,wy,wz: rad/s about its axes x right, y down, z "
                   "forward; with --observations these need a column t_us. 'recording': the IMU in EVENTS")
      ->type_name("FILE");
  command->add_option("--gyro-noise", options->gyro_noise, "Its noise density, rad/s/sqrt(Hz)")
      ->type_name("X")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--gyro-bias", options->gyro_bias,
                   "One sigma of its bias, rad/s; default: 0.01, for 'recording' 0.1")
      ->type_name("X")
      ->check(CLI::NonNegativeNumber);
  add_hints(command, options);
  command->add_flag("--free-k3", options->free_k3, "Estimate k3 (r^6) too; for wide lenses seen to their rim");
  command->add_flag("--no-distortion", options->hold_distortion, "Hold all distortion coefficients at 0");
  command->add_flag("--centred", options->hold_centre, "Hold the principal point at the image's centre");
  command->add_flag("--lines-only", options->lines_only,
                    "With EVENTS: calibrate from fitted lines, not from the events of their edges one by one");
  command
      ->add_option("--max-focal-sigma", options->max_focal_sigma,
                   "Refuse a focal length whose sigma is above this share of it (0.3 from points, 0.02 from events)")
      ->type_name("SHARE")
      ->check(CLI::PositiveNumber);
}

void add_calibrate(CLI::App& app) {
  CLI::App* command = app.add_subcommand("calibrate", "Find a camera's focal lengths, principal point and distortion");
  const auto options = std::make_shared<CalibrateOptions>();
  add_inputs(command, options.get());
  add_model_options(command, options.get());
  add_solver_options(command, options.get());
  command->add_flag("--trust-lines", options->trust_lines,
                    "With --observations: use all lines, also those that do not fit the others");
  command->callback([options] { run_calibrate(*options); });
}

}  // namespace lecalib::command
