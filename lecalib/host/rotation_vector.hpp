// SPDX-License-Identifier: MIT
#pragma once

#include <array>

namespace lecalib::host {

/// Rotation vector of a rotation matrix (row-major), |w| <= pi: through the quaternion whose largest part comes first,
/// so that neither small angles nor angles near pi lose digits.
std::array<double, 3> rotation_vector(const double* R);

}  // namespace lecalib::host
