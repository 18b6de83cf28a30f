// SPDX-License-Identifier: MIT
#include "lecalib/host/window_svg.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "lecalib/host/line_events.hpp"
#include "lecalib/host/svg_text.hpp"
#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

constexpr double kPictureWidth = 1280;  // px on the screen
constexpr const char* kBackground = "#15171a";
constexpr const char* kBeginColour = "#3d9bff";
constexpr const char* kEndColour = "#ffd23c";
constexpr const char* kOnColour = "#8d949b";
constexpr const char* kOffColour = "#7d403d";
/// Of a line's events, in turn; far from each other and from the colours above. OFF is darker.
constexpr const char* kLineOn[] = {"#63d471", "#ff6fb5", "#ff9147", "#a98bff", "#43cfc4", "#e8c9b4", "#dd84f2"};
constexpr const char* kLineOff[] = {"#3a9147", "#b8447c", "#b9632a", "#7359bd", "#2a918a", "#a08574", "#9a54aa"};
constexpr std::size_t kNumLineColours = 7;
static_assert(sizeof(kLineOn) == kNumLineColours * sizeof(kLineOn[0]) && sizeof(kLineOff) == sizeof(kLineOn));

/// What a pixel shows: OFF and ON events of no line, then OFF and ON of each line's.
using PixelClass = std::size_t;

const char* colour_of(PixelClass c) {
  if (c < 2) return c == 0 ? kOffColour : kOnColour;
  const std::size_t line = (c / 2 - 1) % kNumLineColours;
  return c % 2 == 0 ? kLineOff[line] : kLineOn[line];
}

struct ShownPixel {
  std::uint32_t place;  ///< y * 2^16 + x
  PixelClass shows;
};

/// Each pixel with an event once, row by row: it shows its last event, but one of a line before one of none.
std::vector<ShownPixel> shown_pixels(const EventWindow& events, Span<const EventLine> lines, const SensorSize& sensor) {
  const std::vector<int> owners = line_of_events(events, lines);
  std::vector<ShownPixel> pixels;
  for (std::size_t i = 0; i < owners.size(); ++i) {
    const Event& event = events.events[i];
    if (event.x >= sensor.width || event.y >= sensor.height) continue;
    pixels.push_back({static_cast<std::uint32_t>(event.y) << 16U | event.x,
                      2 * static_cast<PixelClass>(owners[i] + 1) + (event.polarity != 0 ? 1 : 0)});
  }
  std::reverse(pixels.begin(), pixels.end());  // the last event first
  std::stable_sort(pixels.begin(), pixels.end(), [](const ShownPixel& a, const ShownPixel& b) {
    return a.place != b.place ? a.place < b.place : (a.shows >= 2) > (b.shows >= 2);
  });
  const auto is_same = [](const ShownPixel& a, const ShownPixel& b) { return a.place == b.place; };
  pixels.erase(std::unique(pixels.begin(), pixels.end(), is_same), pixels.end());
  return pixels;
}

/// A path for each class, of horizontal runs of pixels: the size of the picture is bounded by the sensor, not by the
/// number of events.
std::vector<std::string> event_paths(const std::vector<ShownPixel>& pixels, std::size_t num_lines) {
  std::vector<std::string> paths(2 * (num_lines + 1));
  for (std::size_t i = 0; i < pixels.size();) {
    const ShownPixel& first = pixels[i];
    std::size_t run = 1;
    while (i + run < pixels.size() && pixels[i + run].place == first.place + run &&
           pixels[i + run].shows == first.shows) {
      ++run;
    }
    paths[first.shows] += "M" + std::to_string(first.place & 0xFFFFU) + " " + std::to_string(first.place >> 16U) + "h" +
                          std::to_string(run);
    i += run;
  }
  return paths;
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
  const double line_width = std::min(2.5 * unit, 0.8);  // the events between a line's begin and end are to be seen
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
  svg += std::string("<rect x=\"-0.5\" y=\"-0.5\" width=\"100%\" height=\"100%\" fill=\"") + kBackground + "\"/>\n";
  const auto paths = event_paths(shown_pixels(events, lines.lines, sensor), lines.lines.size());
  svg += "<g transform=\"translate(-0.5 0)\">\n";
  for (PixelClass c = 0; c < paths.size(); ++c) {
    if (!paths[c].empty()) svg += path(paths[c], colour_of(c), 1, "");
  }
  svg += "</g>\n";
  svg += path(lines_path(lines.lines, &EventLine::begin), kBeginColour, line_width, " stroke-linecap=\"round\"");
  svg += path(lines_path(lines.lines, &EventLine::end), kEndColour, line_width, " stroke-linecap=\"round\"");
  svg += "<g font-family=\"sans-serif\" font-size=\"" + number(18 * unit) + "\" fill=\"#e8e8e8\">\n";
  svg += text(22, svg_text(caption));
  svg += text(46, word(kOnColour, "ON events") + " " + word(kOffColour, "OFF events") + " " +
                      word(kLineOn[0], "events of") + " " + word(kLineOn[1], "one line") + " " +
                      word(kLineOn[2], "each") + " (OFF darker) " + word(kBeginColour, "lines at the window's begin") +
                      " " + word(kEndColour, "at its end"));
  return svg + "</g>\n</svg>\n";
}

}  // namespace lecalib::host
