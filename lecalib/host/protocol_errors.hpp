// SPDX-License-Identifier: MIT
/// How far a calibration of one trial is from the truth, as [Liu24] section 4.2 measures it.
#pragma once

#include <array>
#include <cstddef>

#include "lecalib/core/records.hpp"
#include "lecalib/host/protocol.hpp"

namespace lecalib::host {

inline constexpr std::size_t kNumErrors = 8;

/// In this order: R, the largest angle between a column of the rotation and the true one ([Liu24] eq. 14), degrees;
/// T, relative ([Liu24] eq. 15), percent; fx fy cx cy, relative, percent; k1 k2, absolute, 1e-3.
using TrialErrors = std::array<double, kNumErrors>;

inline constexpr const char* kErrorNames[kNumErrors] = {"R", "T", "fx", "fy", "cx", "cy", "k1", "k2"};
inline constexpr const char* kErrorUnits[kNumErrors] = {"deg", "%", "%", "%", "%", "%", "1e-3", "1e-3"};

/// Larger than any other: what a trial without a camera counts.
TrialErrors no_answer();

TrialErrors errors_of(const Camera& camera, const Pose& T_cam_world, const Trial& truth);

/// [Liu24] section 4.2: "correct" below 5 degrees and 5 percent.
inline bool is_good(const TrialErrors& errors) { return errors[0] < 5 && errors[1] < 5; }

/// Lines of a plane have the same image under (R, t) and under (R diag(-1, -1, 1), -t), which sees the plane's other
/// part before the camera. In every trial the world's origin is ahead, which tells them apart: t_z > 0.
Pose with_origin_ahead(const Pose& pose);

}  // namespace lecalib::host
