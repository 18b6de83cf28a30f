// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace lecalib {

/// How much a calibrator can hold. Memory follows by required_bytes(); beyond a capacity the best or an even share is
/// kept and the rest counted. What is out of its range MonoCalibrator::init() refuses.
struct Capacities {
  /// Further events of a window are thinned evenly over its time; it then gives lines, but no edges. >= 2
  std::uint32_t events_per_window = 60000;
  /// Further lines of a window are given up, the weakest first; 1 to kMaxLines (254).
  std::uint32_t lines_per_window = 64;
  /// Windows kept; when full, the one that tells least is given up. 1 to 65535
  std::uint32_t windows = 96;
  std::uint32_t model_lines = 64;     ///< 4 to 65535
  std::uint32_t points_per_line = 3;  ///< room for ViewPointOptions::points_per_line
  bool edges = true;  ///< room to calibrate by edges, MonoOptions::use_edges; without it the lines alone are used
  bool reference_detector = false;    ///< room for reference_detector(), beside the fast one: 1.3 MB
  std::uint16_t sensor_width = 1280;  ///< px, 2 to kMaxSensorSide (4096); tables per cell of the sensor are sized by it
  std::uint16_t sensor_height = 720;
};

}  // namespace lecalib
