// SPDX-License-Identifier: MIT
#include "lecalib/host/plot_svg.hpp"

#include <doctest/doctest.h>

#include <limits>

#include "lecalib/host/plot_axis.hpp"
#include "lecalib/host/svg_text.hpp"

using namespace lecalib::host;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::size_t count(const std::string& text, const std::string& piece) {
  std::size_t found = 0;
  for (std::size_t at = text.find(piece); at != std::string::npos; at = text.find(piece, at + 1)) ++found;
  return found;
}

std::vector<std::string> labels(const PlotAxis& axis) {
  std::vector<std::string> all;
  for (const double tick : axis.ticks) all.push_back(axis.label(tick));
  return all;
}

using Labels = std::vector<std::string>;

PlotFigure example() {
  PlotFigure figure;
  figure.title = "a < b & c";
  figure.x_label = "x, px";
  figure.x = {0, 1, 2, 3};
  figure.keys = {{"ours", "#112233", PlotStyle::circles}, {"limit", "#112233", PlotStyle::band}};
  figure.panels = {{"error, %", false, {{1, 2, 3, 4}, {1, 1, 1, 1}}}};
  return figure;
}

}  // namespace

TEST_CASE("plot axis: a linear one goes from 0 to a round number above all values that can be drawn") {
  const PlotAxis axis = linear_axis({0.3, 4.2, kInfinity, kNaN, -3});
  CHECK(axis.first == 0);
  CHECK(axis.last == 5);
  CHECK(labels(axis) == Labels{"0", "1", "2", "3", "4", "5"});
  CHECK(axis.place(2.5) == doctest::Approx(0.5));
  CHECK(labels(linear_axis({0.021})) == Labels{"0.000", "0.005", "0.010", "0.015", "0.020", "0.025"});
  CHECK(labels(linear_axis({100, 80})) == Labels{"0", "20", "40", "60", "80", "100"});
  CHECK(linear_axis({}).last == 1);
  CHECK(linear_axis({0, 0}).last == 1);
}

TEST_CASE("plot axis: a logarithmic one lies between 1, 2 or 5 times powers of ten") {
  const PlotAxis axis = logarithmic_axis({0.3, 4.2, 0, -1, kInfinity});
  CHECK(axis.first == doctest::Approx(0.2));
  CHECK(axis.last == doctest::Approx(5));
  CHECK(labels(axis) == Labels{"0.2", "0.5", "1", "2", "5"});
  CHECK(axis.minor_ticks.size() == 8);  // 0.3 0.4 0.6 0.7 0.8 0.9 and 3 4
  CHECK(axis.place(0.2) == doctest::Approx(0));
  CHECK(axis.place(1) == doctest::Approx(0.5));
  CHECK(axis.place(5) == doctest::Approx(1));
  CHECK(labels(logarithmic_axis({15, 14000})) == Labels{"10", "100", "1000", "10000"});
  CHECK(labels(logarithmic_axis({1})) == Labels{"1", "2"});
  CHECK(labels(logarithmic_axis({1000})) == Labels{"1000", "2000"});
  CHECK(labels(logarithmic_axis({0.001, 0.0011})) == Labels{"0.001", "0.002"});
  CHECK(labels(logarithmic_axis({})) == Labels{"1", "2", "5", "10"});
}

TEST_CASE("plot axis: given values are labelled where there is room, also when they fall") {
  const PlotAxis lines = value_axis({6, 8, 10, 12, 15, 20, 25, 30});
  CHECK(labels(lines) == Labels{"6", "10", "15", "20", "25", "30"});
  CHECK(lines.minor_ticks == std::vector<double>{8, 12});
  const PlotAxis falling = value_axis({-0.1, -0.2, -0.3, -0.4, -0.5});
  CHECK(labels(falling) == Labels{"-0.1", "-0.2", "-0.3", "-0.4", "-0.5"});
  CHECK(falling.place(-0.2) == doctest::Approx(0.25));
  CHECK(labels(value_axis({0, 0.5, 1})) == Labels{"0.0", "0.5", "1.0"});
}

TEST_CASE("plot: curves, marks and legend are drawn once each, and texts are escaped") {
  const std::string svg = draw_figure(example());
  CHECK(svg.rfind("<svg xmlns=\"http://www.w3.org/2000/svg\"", 0) == 0);
  CHECK(count(svg, "<svg") == count(svg, "</svg>"));
  CHECK(count(svg, "<g ") == count(svg, "</g>"));
  CHECK(count(svg, "<text") == count(svg, "</text>"));
  CHECK(count(svg, "<circle") == 4 + 1);                 // and one in the legend
  CHECK(count(svg, "stroke-opacity=\"0.3\"") == 1 + 1);  // the band
  CHECK(count(svg, ">a &lt; b &amp; c<") == 1);
  CHECK(count(svg, ">x, px<") == 1);
  CHECK(svg_text("<&>\"") == "&lt;&amp;&gt;\"");
}

TEST_CASE("plot: a value that cannot be drawn leaves a gap") {
  PlotFigure figure = example();
  figure.panels[0].curves[0] = {1, kInfinity, kNaN, 4};
  CHECK(count(draw_figure(figure), "<circle") == 2 + 1);
  CHECK(count(draw_figure(figure), "nan") == 0);
  CHECK(count(draw_figure(figure), "inf") == 0);
  figure.panels[0].logarithmic = true;
  figure.panels[0].curves[0] = {0, 1, 2, -1};
  CHECK(count(draw_figure(figure), "<circle") == 2 + 1);
  figure.panels[0].curves[0] = {0, 0, 0, 0};
  CHECK(count(draw_figure(figure), "<circle") == 0 + 1);
}

TEST_CASE("plot: panels stand in rows, the lowest of each column has the label below") {
  PlotFigure figure = example();
  figure.panels.assign(5, figure.panels[0]);
  const std::string svg = draw_figure(figure);
  CHECK(count(svg, ">error, %<") == 5);
  CHECK(count(svg, ">x, px<") == 3);
}
