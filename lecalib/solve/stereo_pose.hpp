// SPDX-License-Identifier: MIT
/// How two cameras stand to each other, from the poses of an object that each of them has found by itself.
#pragma once

#include <cstdint>

#include "lecalib/core/records.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/core/status.hpp"

namespace lecalib {

/// The rigid motions that map a model's lines onto its lines, the identity first: what cameras can't tell apart.
/// @param out room for them; a rectangle has 4, a box of three lengths 4, a cube 24
/// @return how many were found; where there are more than out.size() that many, and the others are left out
/// Complexity n^2 for a model of n lines, n^2 more for each motion that maps three of its points.
std::size_t find_symmetries(Span<const ModelLine> model, Span<Pose> out);

/// The object's pose in both cameras at one instant.
struct PosePair {
  Pose left, right;
  Pose symmetry;  ///< out: see StereoPair
  bool agrees;    ///< out: with T_right_left, by some symmetry
};

struct StereoPoseOptions {
  /// Poses agree within this much of turn (rad) and shift (share of the object's distance), taken together ...
  double agreement = 0.1;
  /// ... and within so many times their mean disagreement, or kLeastAgreement where that is more.
  double over_mean = 4;
};
inline constexpr double kLeastAgreement = 0.01;

/// The pose between two cameras on which most pairs agree. Of several that differ by a symmetry of the model and on
/// which as many do, as when nothing turns, the one that turns the cameras least against each other.
/// @param symmetries of the model, the identity among them
/// @return ok | no_match (no two thirds of the pairs agree on any); *T_right_left unchanged unless ok
/// Complexity: linear in pairs, times symmetries squared.
Status find_stereo_pose(Span<PosePair> pairs, Span<const Pose> symmetries, const StereoPoseOptions& options,
                        Pose* T_right_left);

}  // namespace lecalib
