// SPDX-License-Identifier: MIT
/// Focal length and pose from one quadrilateral: the homography from the face's plane to the flat image, and the focal
/// length for which its first two columns are orthonormal (Zhang 2000). Equal focal lengths, principal point known.
#pragma once

#include <cstddef>

#include "lecalib/match/image_quads.hpp"
#include "lecalib/match/model_graph.hpp"
#include "lecalib/math/eigen.hpp"

namespace lecalib {

/// Ways to lay four sides upon four sides: four starts, two directions.
inline constexpr int kNumQuadLabelings = 8;

struct FocalRange {
  double min_px;
  double max_px;
};

/// Focal lengths are tried in this ratio, at most so many: enough for 5 to 160 degrees of view.
inline constexpr double kFocalRatio = 1.13;
inline constexpr int kMaxFocalSteps = 41;

/// How many times the smallest one the largest of so many is.
constexpr double focal_span() {
  double span = 1.0;
  for (int step = 1; step < kMaxFocalSteps; ++step) span *= kFocalRatio;
  return span;
}

struct QuadPoseOptions {
  FocalRange focal{0, 0};
  /// Largest departure of the two columns from orthonormality, as the root of cosine^2 + log(ratio of lengths)^2.
  double max_departure = 0.15;
};

/// A guess at the camera and where the object is.
struct PoseGuess {
  double R[9];  ///< row-major, world to camera
  double t[3];
  double f_px;
};

inline constexpr std::size_t kMaxQuadGuesses = 3;

/// Guesses for one labeling: the focal length that fits best and, where the view says little about it (the face nearly
/// parallel to the image), the ends of the range that fits as well.
/// @param labeling 0 .. kNumQuadLabelings - 1
/// @return the number of guesses, 0 when no focal length of the range makes this quad an image of that face
std::size_t guess_poses(const ImageQuad& image, const ModelQuad& model, int labeling, const QuadPoseOptions& options,
                        PoseGuess out[kMaxQuadGuesses]);

}  // namespace lecalib
