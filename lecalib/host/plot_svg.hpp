// SPDX-License-Identifier: MIT
/// Line plots as SVG: a figure of panels that share the horizontal axis and the legend.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace lecalib::host {

enum class PlotStyle : std::uint8_t {
  circles,  ///< a thin line with round marks
  squares,  ///< a thin line with square marks
  band,     ///< a broad, pale line without marks, below the others
};

/// One kind of line in the legend, the same in all panels.
struct PlotKey {
  std::string name;
  std::string colour;
  PlotStyle style;
};

struct PlotPanel {
  std::string title;  ///< what is drawn, with its unit
  bool logarithmic = false;
  std::vector<std::vector<double>> curves;  ///< by key, then by x; a value that cannot be drawn leaves a gap
};

struct PlotFigure {
  std::string title;
  std::string subtitle;
  std::string x_label;
  std::vector<double> x;  ///< two or more, from the left to the right; they may fall
  std::vector<PlotKey> keys;
  std::vector<PlotPanel> panels;
  std::size_t columns = 3;
};

/// All of the SVG file. Texts are escaped here.
std::string draw_figure(const PlotFigure& figure);

}  // namespace lecalib::host
