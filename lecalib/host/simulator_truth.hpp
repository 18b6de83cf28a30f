// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "lecalib/host/simulator.hpp"

namespace lecalib::host {

/// The images of the lines of a model at one pose, and what of them is visible.
TrueView true_view(const Scene& scene, const Model& model, const Camera& camera, const Pose& pose, std::int64_t t_us);

/// Fills poses and views of the recording from its options, and takes lines out of its model that no view shows.
void add_truth(const Scene& scene, const Trajectory& trajectory, Recording* recording);

/// JSON with "camera", "poses" (quaternion w x y z and t: x_cam = R x_world + t), "lines_3d", "lines_2d" and how the
/// recording was made.
std::string truth_json(const Recording& recording);

/// A model file, as read_model() reads it.
std::string model_text(const Model& model);

}  // namespace lecalib::host
