// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "lecalib/core/records.hpp"

namespace lecalib::command {

/// How a pose is written as an option: rotation vector (rad) and translation (m).
inline constexpr const char* kPoseWords = "RX,RY,RZ,TX,TY,TZ";

/// Reads one. Ends by fail() where it cannot be read. @param option its name, as in --hint-pose
Pose pose_of(const std::string& option, const std::string& text);

}  // namespace lecalib::command
