// SPDX-License-Identifier: MIT
#include "lecalib/host/plot_svg.hpp"

#include <cmath>

#include "lecalib/host/plot_axis.hpp"
#include "lecalib/host/svg_text.hpp"
#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

// Lengths in px.
constexpr double kPlotWidth = 270;
constexpr double kPlotHeight = 170;
constexpr double kLeft = 58;     // of a plot, for its labels
constexpr double kAbove = 34;    // of a plot, for its title
constexpr double kBelow = 26;    // of a plot, for its labels
constexpr double kMargin = 16;   // around the figure
constexpr double kHeader = 84;   // title, subtitle, legend
constexpr double kFooter = 24;   // label of the horizontal axis
constexpr double kInset = 0.04;  // of the horizontal range, free at both of its ends
constexpr double kMark = 3.6;    // half the size of a mark
constexpr double kBandWidth = 6;
constexpr double kPlotLineWidth = 1.4;
constexpr double kTick = 5;
constexpr double kMinorTick = 3;
constexpr double kSample = 32;   // of a line in the legend
constexpr double kLetter = 6.6;  // width of one in the legend, roughly

constexpr const char* kInk = "#404040";
constexpr const char* kGrid = "#e3e3e3";

std::string number(double value) { return fixed(value, 2); }

std::string attribute(const char* name, double value) { return " " + std::string(name) + "=\"" + number(value) + "\""; }

std::string text(double x, double y, const char* anchor, const std::string& words, const std::string& more = {}) {
  return "<text" + attribute("x", x) + attribute("y", y) + " text-anchor=\"" + anchor + "\"" + more + ">" +
         svg_text(words) + "</text>\n";
}

std::string straight(double x1, double y1, double x2, double y2, const char* colour) {
  return "<path d=\"M" + number(x1) + " " + number(y1) + "L" + number(x2) + " " + number(y2) + "\" stroke=\"" + colour +
         "\"/>\n";
}

/// Minus signs as long as plus signs.
std::string typeset(std::string label) {
  if (!label.empty() && label[0] == '-') label.replace(0, 1, "\xE2\x88\x92");
  return label;
}

struct PlottedPoint {
  double x, y;
  bool drawn;  ///< false: a gap
};

std::string line_style(const PlotKey& key) {
  const bool band = key.style == PlotStyle::band;
  return " fill=\"none\" stroke=\"" + key.colour + "\" stroke-linejoin=\"round\" stroke-linecap=\"round\"" +
         attribute("stroke-width", band ? kBandWidth : kPlotLineWidth) + (band ? " stroke-opacity=\"0.3\"" : "");
}

std::string mark(const PlotKey& key, double x, double y) {
  const std::string fill =
      " fill=\"#ffffff\" stroke=\"" + key.colour + "\"" + attribute("stroke-width", kPlotLineWidth);
  if (key.style == PlotStyle::circles) {
    return "<circle" + attribute("cx", x) + attribute("cy", y) + attribute("r", kMark) + fill + "/>\n";
  }
  return "<rect" + attribute("x", x - kMark) + attribute("y", y - kMark) + attribute("width", 2 * kMark) +
         attribute("height", 2 * kMark) + fill + "/>\n";
}

std::string curve(const PlotKey& key, const std::vector<PlottedPoint>& points) {
  std::string data;
  std::string marks;
  bool joined = false;
  for (const PlottedPoint& point : points) {
    if (point.drawn) {
      data += std::string(joined ? "L" : "M") + number(point.x) + " " + number(point.y);
      if (!joined) data += "h0";  // a point between two gaps shows as a dot
      if (key.style != PlotStyle::band) marks += mark(key, point.x, point.y);
    }
    joined = point.drawn;
  }
  return data.empty() ? "" : "<path d=\"" + data + "\"" + line_style(key) + "/>\n" + marks;
}

/// The corner of a plot and its axes.
struct Frame {
  double left, top;
  PlotAxis x, y;

  [[nodiscard]] double place_x(double value) const {
    return left + kPlotWidth * (kInset + (1 - 2 * kInset) * x.place(value));
  }
  [[nodiscard]] double place_y(double value) const { return top + kPlotHeight * (1 - y.place(value)); }
};

std::string draw_axes(const Frame& frame, const std::string& title) {
  std::string svg;
  const double right = frame.left + kPlotWidth;
  const double bottom = frame.top + kPlotHeight;
  for (const double tick : frame.y.ticks) {
    const double y = frame.place_y(tick);
    svg += straight(frame.left, y, right, y, kGrid);
    svg += text(frame.left - 6, y + 4, "end", typeset(frame.y.label(tick)));
  }
  for (const double tick : frame.y.minor_ticks) {
    const double y = frame.place_y(tick);
    svg += straight(frame.left, y, frame.left + kMinorTick, y, kInk);
  }
  for (const double tick : frame.x.ticks) {
    const double x = frame.place_x(tick);
    svg += straight(x, bottom, x, bottom - kTick, kInk);
    svg += text(x, bottom + 16, "middle", typeset(frame.x.label(tick)));
  }
  for (const double tick : frame.x.minor_ticks) {
    const double x = frame.place_x(tick);
    svg += straight(x, bottom, x, bottom - kMinorTick, kInk);
  }
  svg += "<rect" + attribute("x", frame.left) + attribute("y", frame.top) + attribute("width", kPlotWidth) +
         attribute("height", kPlotHeight) + " fill=\"none\" stroke=\"" + kInk + "\"/>\n";
  return svg + text(frame.left, frame.top - 8, "start", title, " font-size=\"13.5\" font-weight=\"600\"");
}

std::string draw_panel(const PlotFigure& figure, const PlotPanel& panel, double left, double top) {
  std::vector<double> all;
  for (const std::vector<double>& values : panel.curves) all.insert(all.end(), values.begin(), values.end());
  const Frame frame{left, top, value_axis(figure.x), panel.logarithmic ? logarithmic_axis(all) : linear_axis(all)};
  std::string svg = draw_axes(frame, panel.title);
  for (const bool bands : {true, false}) {
    for (std::size_t k = 0; k < panel.curves.size(); ++k) {
      if ((figure.keys[k].style == PlotStyle::band) != bands) continue;
      std::vector<PlottedPoint> points;
      for (std::size_t i = 0; i < figure.x.size(); ++i) {
        const double value = panel.curves[k][i];
        const bool drawn = std::isfinite(value) && (!panel.logarithmic || value > 0);
        points.push_back({frame.place_x(figure.x[i]), drawn ? frame.place_y(value) : 0, drawn});
      }
      svg += curve(figure.keys[k], points);
    }
  }
  return svg;
}

std::string draw_legend(const PlotFigure& figure, double left, double y) {
  std::string svg;
  double x = left;
  for (const PlotKey& key : figure.keys) {
    svg += "<path d=\"M" + number(x) + " " + number(y - 4) + "h" + number(kSample) + "\"" + line_style(key) + "/>\n";
    if (key.style != PlotStyle::band) svg += mark(key, x + 0.5 * kSample, y - 4);
    svg += text(x + kSample + 10, y, "start", key.name);
    x += kSample + 10 + kLetter * static_cast<double>(key.name.size()) + 26;
  }
  return svg;
}

}  // namespace

std::string draw_figure(const PlotFigure& figure) {
  const std::size_t rows = (figure.panels.size() + figure.columns - 1) / figure.columns;
  const double cell_width = kLeft + kPlotWidth;
  const double cell_height = kAbove + kPlotHeight + kBelow;
  const double width = 2 * kMargin + cell_width * static_cast<double>(figure.columns);
  const double height = 2 * kMargin + kHeader + cell_height * static_cast<double>(rows) + kFooter;
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\"" + attribute("width", width) +
                    attribute("height", height) + " viewBox=\"0 0 " + number(width) + " " + number(height) + "\">\n" +
                    "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n" +
                    "<g font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#202020\">\n";
  svg += text(kMargin, kMargin + 18, "start", figure.title, " font-size=\"18\" font-weight=\"600\"");
  svg += text(kMargin, kMargin + 42, "start", figure.subtitle, " font-size=\"13\"");
  svg += draw_legend(figure, kMargin + 0.5 * kBandWidth, kMargin + 72);
  for (std::size_t i = 0; i < figure.panels.size(); ++i) {
    const double left = kMargin + cell_width * static_cast<double>(i % figure.columns) + kLeft;
    const std::size_t row = i / figure.columns;
    const double top = kMargin + kHeader + cell_height * static_cast<double>(row) + kAbove;
    svg += draw_panel(figure, figure.panels[i], left, top);
    if (i + figure.columns < figure.panels.size()) continue;
    svg += text(left + 0.5 * kPlotWidth, top + kPlotHeight + 38, "middle", figure.x_label, " font-size=\"13\"");
  }
  return svg + "</g>\n</svg>\n";
}

}  // namespace lecalib::host
