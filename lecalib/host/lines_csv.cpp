// SPDX-License-Identifier: MIT
#include "lecalib/host/lines_csv.hpp"

#include <cmath>

#include "lecalib/host/text.hpp"
#include "lecalib/pipeline/view_points.hpp"

namespace lecalib::host {
namespace {

/// Piece `index` of `count` of a bent segment, as its chord.
Segment piece_of(const Segment& segment, float bend_px, int index, int count) {
  double x[2];
  double y[2];
  for (int end = 0; end < 2; ++end) {
    point_on_bent_segment(segment, bend_px, static_cast<double>(index + end) / count, &x[end], &y[end]);
  }
  return {static_cast<float>(x[0]), static_cast<float>(y[0]), static_cast<float>(x[1]), static_cast<float>(y[1])};
}

/// The bend of a piece falls with the square of the number of pieces.
int pieces_of(const EventLine& line) {
  const float bend = std::fabs(line.bend_px);
  return bend > kMaxRowBendPx ? static_cast<int>(std::ceil(std::sqrt(bend / kMaxRowBendPx))) : 1;
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

LinesCsv::LinesCsv() : text_("t_us,end,line,x1,y1,x2,y2,sigma_px,events,polarity\n") {}

void LinesCsv::add(const LineWindow& window) {
  for (const EventLine& line : window.lines) {
    const int pieces = pieces_of(line);
    const std::uint32_t events = line.events / static_cast<std::uint32_t>(pieces);
    for (int i = 0; i < pieces; ++i, ++num_rows_) {
      const Segment begin = piece_of(line.begin, line.bend_px, i, pieces);
      const Segment end = piece_of(line.end, line.bend_px, i, pieces);
      add_row(&text_, window.begin_us, "begin", num_rows_, begin, line.sigma_begin_px, events, line.polarity);
      add_row(&text_, window.end_us, "end", num_rows_, end, line.sigma_end_px, events, line.polarity);
    }
    ++num_lines_;
  }
}

}  // namespace lecalib::host
