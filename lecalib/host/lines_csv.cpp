// SPDX-License-Identifier: MIT
#include "lecalib/host/lines_csv.hpp"

#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

void add_end(std::string* text, std::int64_t t_us, const char* end, std::size_t id, const Segment& segment,
             float sigma_px, const EventLine& line) {
  *text += std::to_string(t_us) + "," + end + "," + std::to_string(id);
  for (const float value : {segment.x1, segment.y1, segment.x2, segment.y2, sigma_px}) {
    *text += "," + fixed(static_cast<double>(value), 4);
  }
  *text += "," + std::to_string(line.events) + "," + std::to_string(line.polarity) + "\n";
}

}  // namespace

LinesCsv::LinesCsv() : text_("t_us,end,line,x1,y1,x2,y2,sigma_px,events,polarity\n") {}

void LinesCsv::add(const LineWindow& window) {
  for (const EventLine& line : window.lines) {
    add_end(&text_, window.begin_us, "begin", num_lines_, line.begin, line.sigma_begin_px, line);
    add_end(&text_, window.end_us, "end", num_lines_, line.end, line.sigma_end_px, line);
    ++num_lines_;
  }
}

}  // namespace lecalib::host
