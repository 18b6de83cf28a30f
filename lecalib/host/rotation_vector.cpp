// SPDX-License-Identifier: MIT
#include "lecalib/host/rotation_vector.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib::host {

std::array<double, 3> rotation_vector(const double* R) {
  const auto r = [R](int row, int column) { return R[3 * row + column]; };
  const double trace = r(0, 0) + r(1, 1) + r(2, 2);
  const std::array<double, 4> squares = {1 + trace, 1 + 2 * r(0, 0) - trace, 1 + 2 * r(1, 1) - trace,
                                         1 + 2 * r(2, 2) - trace};
  std::array<double, 4> q{};  // w x y z, not normalised
  switch (std::max_element(squares.begin(), squares.end()) - squares.begin()) {
    case 0: q = {squares[0], r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)}; break;
    case 1: q = {r(2, 1) - r(1, 2), squares[1], r(0, 1) + r(1, 0), r(0, 2) + r(2, 0)}; break;
    case 2: q = {r(0, 2) - r(2, 0), r(0, 1) + r(1, 0), squares[2], r(1, 2) + r(2, 1)}; break;
    default: q = {r(1, 0) - r(0, 1), r(0, 2) + r(2, 0), r(1, 2) + r(2, 1), squares[3]}; break;
  }
  const double sign = q[0] < 0 ? -1 : 1;
  const double sine = std::sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double angle = 2 * std::atan2(sine, sign * q[0]);
  const double scale = sine > 0 ? sign * angle / sine : 0;
  return {q[1] * scale, q[2] * scale, q[3] * scale};
}

}  // namespace lecalib::host
