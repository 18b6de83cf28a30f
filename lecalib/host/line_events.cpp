// SPDX-License-Identifier: MIT
#include "lecalib/host/line_events.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib::host {
namespace {

struct Point {
  double x, y;
};

Point mix(float x1, float y1, float x2, float y2, double share) {
  return {static_cast<double>(x1) + share * (static_cast<double>(x2) - static_cast<double>(x1)),
          static_cast<double>(y1) + share * (static_cast<double>(y2) - static_cast<double>(y1))};
}

/// Distance of (x, y) from the line as it stands when `share` of the window has passed; kLineEventsPx or more when it
/// lies beyond its ends.
double distance_to(const EventLine& line, double share, double x, double y) {
  const Point p = mix(line.begin.x1, line.begin.y1, line.end.x1, line.end.y1, share);
  const Point q = mix(line.begin.x2, line.begin.y2, line.end.x2, line.end.y2, share);
  const double dx = q.x - p.x;
  const double dy = q.y - p.y;
  const double length = std::sqrt(dx * dx + dy * dy);
  if (!(length > 0)) return kLineEventsPx;
  const double along = ((x - p.x) * dx + (y - p.y) * dy) / (length * length);
  const double beyond_px = length * std::max(-along, along - 1);
  if (beyond_px > 1) return kLineEventsPx;  // half a pixel at either end would do without noise
  const double bend = 4 * along * (1 - along) * static_cast<double>(line.bend_px);
  return std::fabs(((y - p.y) * dx - (x - p.x) * dy) / length - bend);
}

}  // namespace

std::vector<int> line_of_events(const EventWindow& events, Span<const EventLine> lines) {
  const auto begin_us = static_cast<double>(events.begin_us);
  const double length_us = std::max(1.0, static_cast<double>(events.end_us) - begin_us);
  std::vector<int> owners;
  owners.reserve(events.events.size());
  for (const Event& event : events.events) {
    const double share = std::clamp((static_cast<double>(event.t_us) - begin_us) / length_us, 0.0, 1.0);
    int owner = -1;
    double nearest = kLineEventsPx;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (lines[i].polarity == (event.polarity != 0 ? -1 : 1)) continue;
      const double distance = distance_to(lines[i], share, event.x, event.y);
      if (distance >= nearest) continue;
      nearest = distance;
      owner = static_cast<int>(i);
    }
    owners.push_back(owner);
  }
  return owners;
}

}  // namespace lecalib::host
