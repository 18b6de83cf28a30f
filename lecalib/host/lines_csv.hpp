// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>

#include "lecalib/core/records.hpp"

namespace lecalib::host {

/// Collects the lines of windows as CSV: one row per line and window end,
/// `t_us,end,line,x1,y1,x2,y2,sigma_px,events,polarity`. `line` counts through all windows and pairs the two ends;
/// (x1, y1) of both ends belong to the same end of the line; pixels, integer at pixel centres.
class LinesCsv {
 public:
  LinesCsv();
  void add(const LineWindow& window);
  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] std::size_t num_lines() const { return num_lines_; }

 private:
  std::string text_;
  std::size_t num_lines_ = 0;
};

}  // namespace lecalib::host
