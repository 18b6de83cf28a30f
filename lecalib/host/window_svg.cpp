// SPDX-License-Identifier: MIT
#include "lecalib/host/window_svg.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

constexpr double kPictureWidth = 1280;  // px on the screen
constexpr const char* kBeginColour = "#4aa3ff";
constexpr const char* kEndColour = "#ffd23c";
constexpr const char* kOnColour = "#d8dce0";
constexpr const char* kOffColour = "#b0524e";

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else
      out += c;
  }
  return out;
}

/// Pixels with an event of `polarity`, each once, joined to horizontal runs: the size of the picture is bounded by the
/// sensor, not by the number of events.
std::string event_path(Span<const Event> events, std::uint8_t polarity, const SensorSize& sensor) {
  std::vector<std::uint32_t> pixels;
  for (const Event& event : events) {
    if (event.polarity != polarity || event.x >= sensor.width || event.y >= sensor.height) continue;
    pixels.push_back(static_cast<std::uint32_t>(event.y) << 16U | event.x);
  }
  std::sort(pixels.begin(), pixels.end());
  pixels.erase(std::unique(pixels.begin(), pixels.end()), pixels.end());
  std::string path;
  for (std::size_t i = 0; i < pixels.size();) {
    std::size_t run = 1;
    while (i + run < pixels.size() && pixels[i + run] == pixels[i] + run) ++run;
    path +=
        "M" + std::to_string(pixels[i] & 0xFFFFU) + " " + std::to_string(pixels[i] >> 16U) + "h" + std::to_string(run);
    i += run;
  }
  return path;
}

/// A parabola through the end points whose middle lies bend_px beside the chord's: a quadratic Bezier curve with its
/// control point twice as far out.
std::string curve(const Segment& segment, float bend_px) {
  const auto x1 = static_cast<double>(segment.x1);
  const auto y1 = static_cast<double>(segment.y1);
  const double dx = static_cast<double>(segment.x2) - x1;
  const double dy = static_cast<double>(segment.y2) - y1;
  const double length = std::sqrt(dx * dx + dy * dy);
  const double out = length > 0 ? 2 * static_cast<double>(bend_px) / length : 0;
  const auto point = [](double x, double y) { return fixed(x, 2) + " " + fixed(y, 2); };
  return "M" + point(x1, y1) + "Q" + point(x1 + dx / 2 - dy * out, y1 + dy / 2 + dx * out) + " " +
         point(x1 + dx, y1 + dy);
}

std::string lines_path(Span<const EventLine> lines, Segment EventLine::*end) {
  std::string path;
  for (const EventLine& line : lines) path += curve(line.*end, line.bend_px);
  return path;
}

}  // namespace

std::string draw_window(const EventWindow& events, const LineWindow& lines, const SensorSize& sensor,
                        const std::string& caption) {
  const double unit = sensor.width / kPictureWidth;  // one screen pixel, in sensor pixels
  const double strip = 56 * unit;
  const double height = sensor.height + strip;
  const auto number = [](double value) { return fixed(value, 3); };
  const auto path = [&](const std::string& data, const char* colour, double width, const char* more) {
    return "<path d=\"" + data + "\" fill=\"none\" stroke=\"" + colour + "\" stroke-width=\"" + number(width) + "\"" +
           more + "/>\n";
  };
  const auto text = [&](double row, const std::string& words) {
    return "<text x=\"" + number(8 * unit) + "\" y=\"" + number(sensor.height + row * unit) + "\">" + words +
           "</text>\n";
  };
  const auto word = [](const char* colour, const char* what) {
    return std::string("<tspan fill=\"") + colour + "\">" + what + "</tspan>";
  };
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + fixed(kPictureWidth, 0) + "\" height=\"" +
                    fixed(height / unit, 0) + "\" viewBox=\"-0.5 -0.5 " + std::to_string(sensor.width) + " " +
                    number(height) + "\">\n";
  svg += "<rect x=\"-0.5\" y=\"-0.5\" width=\"100%\" height=\"100%\" fill=\"#1d1f23\"/>\n";
  svg += path(event_path(events.events, 0, sensor), kOffColour, 1, " transform=\"translate(-0.5 0)\"");
  svg += path(event_path(events.events, 1, sensor), kOnColour, 1, " transform=\"translate(-0.5 0)\" opacity=\"0.7\"");
  svg += path(lines_path(lines.lines, &EventLine::begin), kBeginColour, 2.5 * unit, " stroke-linecap=\"round\"");
  svg += path(lines_path(lines.lines, &EventLine::end), kEndColour, 2.5 * unit, " stroke-linecap=\"round\"");
  svg += "<g font-family=\"sans-serif\" font-size=\"" + number(18 * unit) + "\" fill=\"#e8e8e8\">\n";
  svg += text(22, escaped(caption));
  svg += text(46, word(kOnColour, "ON events") + " " + word(kOffColour, "OFF events") + " " +
                      word(kBeginColour, "lines at the window's begin") + " " + word(kEndColour, "at its end"));
  return svg + "</g>\n</svg>\n";
}

}  // namespace lecalib::host
