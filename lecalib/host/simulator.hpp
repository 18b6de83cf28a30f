// SPDX-License-Identifier: MIT
/// Recordings with exact truth: a scene, a moving camera with a true lens, the pixels of an event camera.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "lecalib/core/records.hpp"
#include "lecalib/host/error.hpp"
#include "lecalib/host/model_file.hpp"
#include "lecalib/host/simulator_sensor.hpp"
#include "lecalib/host/simulator_trajectory.hpp"

namespace lecalib::host {

struct SimulatorOptions {
  Camera camera;  ///< the true one: size, fx, fy > 0, centre, distortion
  /// Cameras that are fixed to each other: where each of them is, T_camera_rig. What moves is the rig; it keeps so far
  /// away that each of them, all taken to have the lens of `camera`, sees the whole target.
  std::vector<Pose> rig = {Pose()};
  std::size_t rig_camera = 0;  ///< the one that records, < rig.size(); it has noise of its own
  Motion motion = Motion::shake;
  double speed = 1.0;       ///< factor on the motion's frequencies, (0, 100]
  double duration_s = 1.0;  ///< (0, 600]
  std::uint64_t seed = 1;
  std::int64_t start_us = 1'000'000;  ///< time of the first frame, 0 to 1e15
  SensorOptions sensor;
  double pose_rate_hz = 1000;  ///< of the truth's poses, [10, 10000]
  std::size_t views = 21;      ///< instants at which the truth lists the lines' images, [2, 1000]
};

struct TimedPose {
  std::int64_t t_us;
  Pose T_cam_world;
};

/// Points on the image of each model line, from its p to its q, even steps in space.
inline constexpr std::size_t kTruthPoints = 33;

struct TrueLine {
  Vec2 uv[kTruthPoints];         ///< px; zero where the lens model is not defined
  bool visible[kTruthPoints]{};  ///< before the camera, inside of the image and not hidden
};

struct TrueView {
  std::int64_t t_us = 0;
  std::vector<TrueLine> lines;  ///< of the model
};

struct Recording {
  std::string target;
  SimulatorOptions options;
  Model model;                ///< the target's lines that are visible in some view
  std::vector<Event> events;  ///< in order of time
  std::vector<TimedPose> poses;
  std::vector<TrueView> views;
  SensorStats stats;
};

/// Simulates a target as make_target() describes it. The same input gives the same events.
/// @param progress is told the part done, 0 to 1; may be empty
Result<Recording> simulate(std::string_view target, const SimulatorOptions& options,
                           const std::function<void(double)>& progress = {});

/// Writes events.raw (EVT3), model.txt and truth.json into `folder`, which is made when missing.
MaybeError write_recording(const Recording& recording, const std::string& folder);

/// Truth of a pair: R_right_left, t_right_left (metres) and baseline_m.
std::string stereo_truth_json(const Pose& T_right_left);

}  // namespace lecalib::host
