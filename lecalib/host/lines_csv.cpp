// SPDX-License-Identifier: MIT
#include "lecalib/host/lines_csv.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/host/text.hpp"
#include "lecalib/pipeline/view_points.hpp"

namespace lecalib::host {
namespace {

/// The first row of a line that needs several takes more than half of it, so that one row stands for the line, but
/// leaves enough for the others to be of use. It begins at the end further from the image's centre: where a lens bends
/// much it also presses together, so this is the longer part of the object's straight line, too ...
constexpr double kUsualFirstPart = 0.56;
constexpr double kMostFirstPart = 0.65;
/// ... or, where it would stray further than this from its chord, less, down to kLeastFirstPart. Where that is still
/// too much, the line is written in short pieces alone. px
constexpr double kLeastFirstPart = 0.53;
constexpr double kMaxFirstBendPx = 5;

/// The part of a line between two fractions of its length, as its chord.
Segment part_of(const EventLine& line, bool at_end, double from, double to) {
  double x[2];
  double y[2];
  point_on_line(line, at_end, from, &x[0], &y[0]);
  point_on_line(line, at_end, to, &x[1], &y[1]);
  return {static_cast<float>(x[0]), static_cast<float>(y[0]), static_cast<float>(x[1]), static_cast<float>(y[1])};
}

/// The longest part of a line, from 0 to 1, that stays close enough to its chord: the bend of a part goes with the
/// square of its length.
double longest_part(const EventLine& line) {
  const double bend = std::fabs(static_cast<double>(line.bend_px));
  return bend > static_cast<double>(kMaxRowBendPx) ? std::sqrt(static_cast<double>(kMaxRowBendPx) / bend) : 1;
}

/// The part that the first row takes, from 0 to 1.
double first_part(const EventLine& line, double longest) {
  if (longest == 1) return 1;
  const double straight = std::sqrt(kMaxFirstBendPx / std::fabs(static_cast<double>(line.bend_px)));
  if (straight < kLeastFirstPart) return longest;
  return std::clamp(longest, std::min(straight, kUsualFirstPart), kMostFirstPart);
}

/// Whether a line's second end lies further from the image's centre than its first.
bool is_second_end_outer(const EventLine& line, const SensorSize& sensor) {
  const float cx = 0.5F * static_cast<float>(sensor.width - 1);
  const float cy = 0.5F * static_cast<float>(sensor.height - 1);
  const Segment& chord = line.begin;
  return std::hypot(chord.x2 - cx, chord.y2 - cy) > std::hypot(chord.x1 - cx, chord.y1 - cy);
}

void add_row(std::string* text, std::int64_t t_us, const char* end, std::size_t id, const Segment& segment,
             float sigma_px, std::uint32_t events, int polarity) {
  *text += std::to_string(t_us) + "," + end + "," + std::to_string(id);
  for (const float value : {segment.x1, segment.y1, segment.x2, segment.y2, sigma_px}) {
    *text += "," + fixed(static_cast<double>(value), 4);
  }
  *text += "," + std::to_string(events) + "," + std::to_string(polarity) + "\n";
}

}  // namespace

LinesCsv::LinesCsv(SensorSize sensor)
    : sensor_(sensor), text_("t_us,end,line,x1,y1,x2,y2,sigma_px,events,polarity\n") {}

void LinesCsv::add(const LineWindow& window) {
  for (const EventLine& line : window.lines) {
    const double longest = longest_part(line);
    const double first = first_part(line, longest);
    const bool backward = is_second_end_outer(line, sensor_);
    const int others = static_cast<int>(std::ceil((1 - first) / longest));
    for (int i = 0; i <= others; ++i, ++num_rows_) {
      const double near = i == 0 ? 0 : first + (1 - first) * (i - 1) / others;  // to the outer end
      const double far = i == others ? 1 : first + (1 - first) * i / others;
      const double from = backward ? 1 - far : near;
      const double to = backward ? 1 - near : far;
      const auto events = static_cast<std::uint32_t>(static_cast<double>(line.events) * (to - from));
      const Segment begin = part_of(line, false, from, to);
      const Segment end = part_of(line, true, from, to);
      add_row(&text_, window.begin_us, "begin", num_rows_, begin, line.sigma_begin_px, events, line.polarity);
      add_row(&text_, window.end_us, "end", num_rows_, end, line.sigma_end_px, events, line.polarity);
    }
    ++num_lines_;
  }
}

}  // namespace lecalib::host
