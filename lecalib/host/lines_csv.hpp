// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>

#include "lecalib/core/records.hpp"
#include "lecalib/events/decoder.hpp"

namespace lecalib::host {

/// Furthest that a line may bend from its chord to be written as one row, px.
inline constexpr float kMaxRowBendPx = 1.25F;

/// Collects the lines of windows as CSV: one row per line and window end,
/// `t_us,end,line,x1,y1,x2,y2,sigma_px,events,polarity`. `line` counts through all windows and pairs the two ends;
/// (x1, y1) of both ends belong to the same end of the line; pixels, integer at pixel centres. A line whose bend takes
/// it further than kMaxRowBendPx from its chord is written as several rows, each a line of its own; the first of two or
/// three takes more than half of the line, from its outer end in the image, even where it then bends further, up to 5
/// px.
class LinesCsv {
 public:
  explicit LinesCsv(SensorSize sensor);
  void add(const LineWindow& window);
  [[nodiscard]] const std::string& text() const { return text_; }
  /// Lines added, bent ones counted once.
  [[nodiscard]] std::size_t num_lines() const { return num_lines_; }

 private:
  SensorSize sensor_;
  std::string text_;
  std::size_t num_lines_ = 0;
  std::size_t num_rows_ = 0;  ///< pairs of rows
};

}  // namespace lecalib::host
