// SPDX-License-Identifier: MIT
#include "pose_option.hpp"

#include <vector>

#include "commands.hpp"
#include "lecalib/host/text.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib::command {

Pose pose_of(const std::string& option, const std::string& text) {
  std::vector<double> values;
  for (const host::Field& field : host::split(text, ',')) {
    if (const auto number = host::parse_number(field.text)) values.push_back(*number);
  }
  if (values.size() != 6 || host::split(text, ',').size() != 6) {
    fail({option + ": expected " + kPoseWords + ", found " + host::quoted(text)});
  }
  return make_pose(so3_exp(Vec3(values[0], values[1], values[2])), Vec3(values[3], values[4], values[5]));
}

}  // namespace lecalib::command
