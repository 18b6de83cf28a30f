// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace lecalib::host {

/// One axis of a plot: its range and where its labels stand.
struct PlotAxis {
  bool logarithmic = false;
  double first = 0;  ///< at the axis' origin; above `last` where the axis runs backwards
  double last = 1;
  std::vector<double> ticks;        ///< inside the range, with a label
  std::vector<double> minor_ticks;  ///< without
  int decimals = 0;                 ///< of the labels

  /// 0 at the origin, 1 at the other end. A logarithmic axis takes values above 0.
  [[nodiscard]] double place(double value) const;
  [[nodiscard]] std::string label(double tick) const;
};

/// From the first of the values to the last, which rise or fall; labels at as many of them as there is room for.
/// @param values two or more, finite, no two the same
PlotAxis value_axis(const std::vector<double>& values);

/// From 0 to a round number at or above every value; those that are not finite don't count.
PlotAxis linear_axis(const std::vector<double>& values);

/// Between 1, 2 or 5 times powers of ten that enclose all values; those that are not finite or not above 0 don't count.
PlotAxis logarithmic_axis(const std::vector<double>& values);

}  // namespace lecalib::host
