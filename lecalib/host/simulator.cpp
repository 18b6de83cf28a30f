// SPDX-License-Identifier: MIT
#include "lecalib/host/simulator.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "lecalib/host/file_io.hpp"
#include "lecalib/host/raw_writer.hpp"
#include "lecalib/host/simulator_renderer.hpp"
#include "lecalib/host/simulator_scene.hpp"
#include "lecalib/host/simulator_truth.hpp"
#include "lecalib/math/camera_model.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib::host {
namespace {

constexpr double kMaxStep = 1e-3;    ///< s between frames: near turning points of the motion distance alone says little
constexpr double kMinStep = 5e-5;    ///< s
constexpr double kMaxMotion = 0.35;  ///< px between frames, of the model's end points
constexpr std::int64_t kMaxStartUs = 1'000'000'000'000'000;

MaybeError check(const SimulatorOptions& o) {
  const Camera& c = o.camera;
  const SensorOptions& s = o.sensor;
  if (c.width == 0 || c.height == 0 || c.width > kMaxEvt3Side || c.height > kMaxEvt3Side) {
    return Error{"the sensor must have 1x1 to 2048x2048 pixels"};
  }
  for (const auto parameter : kIntrinsics) {
    if (!std::isfinite(c.*parameter)) return Error{"the camera's parameters must be finite"};
  }
  if (!(c.fx > 0 && c.fy > 0)) return Error{"the focal lengths must be above 0"};
  if (!(o.duration_s > 0 && o.duration_s <= 600)) return Error{"the duration must be above 0 and at most 600 s"};
  if (!(o.speed > 0 && o.speed <= 100)) return Error{"the speed must be above 0 and at most 100"};
  if (o.start_us < 0 || o.start_us > kMaxStartUs) return Error{"the start time must be 0 to 1e15 us"};
  if (!(o.pose_rate_hz >= 10 && o.pose_rate_hz <= 1e4)) return Error{"the truth's pose rate must be 10 to 10000 Hz"};
  if (o.rig_camera >= o.rig.size()) return Error{"the camera that records must be one of the rig's"};
  if (o.views < 2 || o.views > 1000) return Error{"the truth must have 2 to 1000 views"};
  if (!(s.threshold >= 0.05 && s.threshold <= 2)) return Error{"the threshold must be 0.05 to 2"};
  if (!(s.bandwidth_hz >= 1 && s.bandwidth_hz <= 1e6)) return Error{"the bandwidth must be 1 to 1e6 Hz"};
  if (!(s.noise_hz >= 0 && s.noise_hz <= 1000)) return Error{"the noise must be 0 to 1000 Hz per pixel"};
  if (!(s.hot_fraction >= 0 && s.hot_fraction <= 0.1)) return Error{"hot pixels must be 0 to a tenth of all"};
  if (!(s.refractory_us >= 0 && s.refractory_us <= 1e6)) return Error{"the refractory time must be 0 to 1e6 us"};
  if (!(s.jitter_us >= 0 && s.jitter_us <= 1e4)) return Error{"the jitter must be 0 to 10000 us"};
  if (!(s.threshold_spread >= 0 && s.threshold_spread <= 1)) return Error{"the thresholds' spread must be 0 to 1"};
  if (!(s.threshold_noise >= 0 && s.threshold_noise <= 1)) return Error{"the thresholds' noise must be 0 to 1"};
  return {};
}

/// Largest motion of a model line's end between two poses, px.
double motion_px(const Model& model, const Camera& camera, const Pose& a, const Pose& b) {
  double largest = 0;
  for (const ModelLine& line : model.lines) {
    for (const Vec3& end : {Vec3(line.p), Vec3(line.q)}) {
      Vec2 at_a, at_b;
      if (!project(camera, rotation_of(a) * end + translation_of(a), &at_a)) continue;
      if (!project(camera, rotation_of(b) * end + translation_of(b), &at_b)) continue;
      largest = std::max(largest, (at_b - at_a).norm());
    }
  }
  return largest;
}

/// Time of the frame after the one at t_s.
double next_frame(double t_s, double end_s, const Trajectory& trajectory, const Model& model, const Camera& camera) {
  const double motion = motion_px(model, camera, trajectory.at(t_s), trajectory.at(t_s + kMaxStep));
  const double step_s = std::clamp(kMaxStep * kMaxMotion / std::max(motion, 1e-9), kMinStep, kMaxStep);
  return std::min(t_s + step_s, end_s);
}

void order(std::vector<Event>* events) {
  std::sort(events->begin(), events->end(), [](const Event& a, const Event& b) {
    return std::tie(a.t_us, a.y, a.x, a.polarity) < std::tie(b.t_us, b.y, b.x, b.polarity);
  });
}

}  // namespace

Result<Recording> simulate(std::string_view target, const SimulatorOptions& options,
                           const std::function<void(double)>& progress) {
  if (MaybeError error = check(options)) return *std::move(error);
  Result<Model> model = make_target(target);
  if (!model.ok()) return model.error();
  const Result<Scene> scene = make_scene(target, model.value());
  if (!scene.ok()) return scene.error();
  const Camera& camera = options.camera;
  const Result<Trajectory> made = Trajectory::make(scene.value(), model.value(), camera, options.rig, options.motion,
                                                   options.speed, options.duration_s, options.seed);
  if (!made.ok()) return made.error();
  const Trajectory trajectory = made.value().seen_from(options.rig[options.rig_camera]);

  Recording recording;
  recording.target = std::string(target);
  recording.options = options;
  Renderer renderer(scene.value(), camera);
  EventSensor sensor(camera.width, camera.height, options.sensor, options.seed + options.rig_camera);
  renderer.render(trajectory.at(0));
  sensor.start(renderer.radiance());
  for (double t_s = 0; t_s < options.duration_s;) {
    t_s = next_frame(t_s, options.duration_s, trajectory, model.value(), camera);
    const Span<const std::uint32_t> changed = renderer.render(trajectory.at(t_s));
    sensor.advance(t_s, renderer.radiance(), changed, &recording.events);
    if (progress) progress(t_s / options.duration_s);
  }
  order(&recording.events);
  for (Event& event : recording.events) event.t_us += options.start_us;
  recording.stats = sensor.stats();
  recording.model = std::move(model).value();
  add_truth(scene.value(), trajectory, &recording);
  return recording;
}

MaybeError write_recording(const Recording& recording, const std::string& folder) {
  const Camera& camera = recording.options.camera;
  const Result<std::string> events = encode_evt3(recording.events, camera.width, camera.height);
  if (!events.ok()) return events.error();
  if (MaybeError error = make_folder(folder)) return error;
  if (MaybeError error = write_file(folder + "/events.raw", events.value())) return error;
  if (MaybeError error = write_file(folder + "/model.txt", model_text(recording.model))) return error;
  return write_file(folder + "/truth.json", truth_json(recording));
}

}  // namespace lecalib::host
