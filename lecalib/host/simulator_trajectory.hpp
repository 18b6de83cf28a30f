// SPDX-License-Identifier: MIT
/// How the simulated camera moves before its target.
#pragma once

#include <array>
#include <cstdint>

#include "lecalib/core/records.hpp"
#include "lecalib/host/error.hpp"
#include "lecalib/host/simulator_scene.hpp"

namespace lecalib::host {

enum class Motion : std::uint8_t {
  shake,   ///< held in the hand and shaken: turns and shifts of a few degrees at 1 to 3 Hz, with tremor
  sweep,   ///< carried slowly around the target, about 20 degrees to either side, with a little tremor
  rotate,  ///< turned about the line of sight by about 28 degrees to either side
};

/// Smooth motion for all times: the camera looks at the target from a point on a sphere around it; six coordinates of
/// that (where on the sphere, how far, and three angles beside the line of sight) are sums of two sines each.
class Trajectory {
 public:
  /// Chooses the motion by the seed, and the distance as the shortest from which the whole model stays inside of the
  /// image for the whole duration.
  /// @param rig   T_camera_rig of the cameras that move together, each of which sees the whole model
  /// @param speed factor on all frequencies, > 0
  static Result<Trajectory> make(const Scene& scene, const Model& model, const Camera& camera, Span<const Pose> rig,
                                 Motion motion, double speed, double duration_s, std::uint64_t seed);

  /// The same motion as seen from one of the rig's cameras.
  [[nodiscard]] Trajectory seen_from(const Pose& T_camera_rig) const;

  /// T_camera_world.
  [[nodiscard]] Pose at(double t_s) const;

 private:
  enum Coordinate : std::uint8_t { pan, tilt, roll, azimuth, elevation, range, kCoordinates };
  struct Sine {
    double amplitude;  ///< rad; of the range: part of the distance
    double frequency_hz;
    double phase;
  };

  [[nodiscard]] double coordinate(Coordinate which, double t_s) const;
  void choose_sines(Motion motion, double speed, std::uint64_t seed);
  [[nodiscard]] bool sees_all(const Model& model, const Camera& camera, double duration_s) const;

  Pose T_camera_rig_;
  Vec3 center_, view_from_, up_;
  double distance_ = 0;
  std::array<std::array<Sine, 2>, kCoordinates> sines_{};
};

}  // namespace lecalib::host
