// SPDX-License-Identifier: MIT
/// The same lens in another distortion model, as nearly as that can say it.
#pragma once

#include "lecalib/core/records.hpp"

namespace lecalib {

/// Distorted radius, normalised coordinates, of the image corner farthest from the principal point.
double image_radius(const Camera& camera);

/// The camera of `model` whose radial curve is nearest to that of `camera`, in the least squares of distorted radii
/// over the image's area out to `radius` (distorted) or as far as the curve goes. Pinhole part unchanged, p1 = p2 = 0
/// unless the model stays the same.
/// @param terms radial coefficients to fit, 1 to 3, in the order k1, k2, k3; the division model has one
Camera in_model(const Camera& camera, DistortionModel model, double radius, int terms);

/// Largest distance, px, between the images of one ideal point by two cameras that differ in their radial curves,
/// out to the distorted radius `radius` of the first.
double largest_difference_px(const Camera& camera, const Camera& other, double radius);

}  // namespace lecalib
