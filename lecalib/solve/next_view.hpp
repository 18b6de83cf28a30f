// SPDX-License-Identifier: MIT
/// What a further view would bring, before anybody takes it: the information that the images of the model's lines hold
/// about the camera depends on where the object stands, and not on what is measured.
#pragma once

#include "lecalib/core/records.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/math/eigen.hpp"

namespace lecalib {

/// Adds what one view of the whole model tells about the intrinsics, its pose eliminated. Three points stand for each
/// line; those behind the camera or outside of the image tell nothing.
/// @param sigma_px of a point across its line, > 0
/// @return how many lines the view shows; with less than 4, or lines that leave the pose open, nothing is added
std::size_t add_view_information(const Camera& camera, Span<const ModelLine> model, const Pose& T_cam_world,
                                 double sigma_px, Mat9* information);

/// Ways to see the object from elsewhere.
enum class ViewMove : std::uint8_t {
  stay,    ///< the same view again, to compare with
  tilt,    ///< the object's slant changes by 25 degrees, the best way of four
  roll,    ///< a quarter turn about the camera's axis
  closer,  ///< at 2/3 of the distance
  away,    ///< at 3/2 of it
  left,
  right,
  top,
  bottom,  ///< its centre stands near that edge of the image
};
inline constexpr std::size_t kNumViewMoves = 9;

/// What a few further views by each move would make of an intrinsic's sigma.
struct MoveForecast {
  double sigma[kNumViewMoves];  ///< by ViewMove; a move that shows too little of the object leaves it as it is
};

/// @param information about the intrinsics so far, positive definite; rows and columns of held ones as identity
/// @param held        per intrinsic
/// @param from        the pose that is moved
/// @param parameter   index of the intrinsic looked at
/// @return false, *out unchanged, where the information is not positive definite
bool forecast_moves(const Camera& camera, Span<const ModelLine> model, const Mat9& information, const bool (&held)[9],
                    const Pose& from, std::size_t parameter, MoveForecast* out);

}  // namespace lecalib
