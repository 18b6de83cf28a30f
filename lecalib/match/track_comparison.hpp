// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/match/window_track.hpp"

namespace lecalib {

/// True when two hypotheses say the same about the detected lines, up to a symmetry of the model (a sheet turned by
/// half a turn): they give the same lines to the model, and any two of them keep their distance when one labeling is
/// replaced by the other.
bool is_same_matching(const MatchScene& scene, const LineTrack& a, const LineTrack& b);

/// True when two poses show the model alike, within a turn (rad) and a fifth of its distance, which trades with the
/// focal length.
/// @param up_to_symmetry of the model: each line may lie where another one of its length did
bool is_same_placement(const ModelGraph& model, const Pose& a, const Pose& b, double turn_rad, bool up_to_symmetry);

}  // namespace lecalib
