// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/math/so3.hpp"

namespace lecalib {

/// What somebody knows beforehand of camera and scene. It decides which guesses are tried first and which of two good
/// explanations is believed. It is no measurement: where the lines contradict a hint clearly, they win.
struct MatchHints {
  double focal_px = 0;       ///< horizontal focal length; 0: not known
  double focal_share = 0.2;  ///< how far off it may be, as a share of it, (0, 1)
  bool has_pose = false;
  Pose T_cam_world;           ///< in the first window that shows the object
  double turn_rad = 0.35;     ///< how far the pose may be off: its turn, (0, pi] ...
  double shift_share = 0.35;  ///< ... and where the model's centre is, as a share of its distance, (0, 1)

  /// @return whether the values given can be hints at all
  [[nodiscard]] bool valid() const;
  /// Also true where nothing is known.
  [[nodiscard]] bool agrees_with_focal(double f_px) const;
  /// @param centre_m the model's centre, metres, in the world
  [[nodiscard]] bool agrees_with_pose(const Pose& pose, const double (&centre_m)[3]) const;
};

}  // namespace lecalib
