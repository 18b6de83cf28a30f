// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/window_length.hpp"

#include <cmath>

namespace lecalib {
namespace {

constexpr float kMaxShrink = 0.6F;
constexpr float kMaxGrowth = 1.3F;

float length_px(const Segment& s) {
  const float dx = s.x2 - s.x1;
  const float dy = s.y2 - s.y1;
  return std::sqrt(dx * dx + dy * dy);
}

/// How far the middle of the line moves across the line, px.
float travel_px(const EventLine& line) {
  const float length = length_px(line.begin);
  if (!(length > 0)) return 0;
  const float moved_x = 0.5F * (line.end.x1 + line.end.x2 - line.begin.x1 - line.begin.x2);
  const float moved_y = 0.5F * (line.end.y1 + line.end.y2 - line.begin.y1 - line.begin.y2);
  const float across = moved_y * (line.begin.x2 - line.begin.x1) - moved_x * (line.begin.y2 - line.begin.y1);
  return std::fabs(across) / length;
}

/// The travel that lines of three quarters of the total length stay below. Quadratic in the number of lines, which is
/// bounded; needs no sort.
float upper_quartile(Span<const EventLine> lines, Span<float> travel) {
  float total = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    travel[i] = travel_px(lines[i]);
    total += length_px(lines[i].begin);
  }
  float best = 0;
  bool found = false;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    float below = 0;
    for (std::size_t j = 0; j < lines.size(); ++j) {
      if (travel[j] <= travel[i]) below += length_px(lines[j].begin);
    }
    if (below >= 0.75F * total && (!found || travel[i] < best)) {
      best = travel[i];
      found = true;
    }
  }
  return best;
}

}  // namespace

std::int64_t next_window_length(const WindowLengthOptions& options, std::int64_t length_us, Span<const EventLine> lines,
                                Span<float> scratch) {
  if (!(options.travel_px > 0)) return length_us;
  float factor = kMaxGrowth;
  if (!lines.empty()) {
    const float travel = upper_quartile(lines, scratch);
    if (travel * kMaxGrowth > options.travel_px) factor = options.travel_px / travel;
    if (factor < kMaxShrink) factor = kMaxShrink;
  }
  const auto next = static_cast<std::int64_t>(static_cast<float>(length_us) * factor);
  return next < options.min_us ? options.min_us : next > options.max_us ? options.max_us : next;
}

}  // namespace lecalib
