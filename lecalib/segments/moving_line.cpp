// SPDX-License-Identifier: MIT
#include "lecalib/segments/moving_line.hpp"

#include <cmath>

namespace lecalib {

float offset_variance(const MovingLine& line, float s_px, float tau) {
  const float s = s_px * kAlongUnit;
  const float row[kNumLineCoefficients] = {1, s, tau, s * tau, s * s};
  float sum = 0;
  const float* entry = line.covariance;
  for (int i = 0; i < kNumLineCoefficients; ++i) {
    for (int j = i; j < kNumLineCoefficients; ++j) sum += (i == j ? 1.0F : 2.0F) * row[i] * row[j] * *entry++;
  }
  return sum > 0 ? sum : 0;
}

void recentre(MovingLine* line) {
  const float middle = 0.25F * (line->low[0] + line->low[1] + line->high[0] + line->high[1]);
  const float s = middle * kAlongUnit;
  const float d = line->offset(middle, 0);
  const float slope = (line->m[1] + 2 * s * line->m[4]) * kAlongUnit;
  const float speed = line->m[2] + s * line->m[3];
  const float cosine = 1.0F / std::sqrt(1.0F + slope * slope);
  const float cx = line->x(middle, d);
  const float cy = line->y(middle, d);
  const float ux = (line->ux - slope * line->uy) * cosine;
  const float uy = (line->uy + slope * line->ux) * cosine;
  line->cx = cx;
  line->cy = cy;
  line->ux = ux;
  line->uy = uy;
  line->m[0] = 0;
  line->m[1] = 0;
  line->m[2] = speed * cosine;
  for (int end = 0; end < 2; ++end) {
    line->low[end] -= middle;
    line->high[end] -= middle;
  }
}

bool line_between(const Segment& begin, const Segment& end, MovingLine* out) {
  const float bx = begin.x2 - begin.x1;
  const float by = begin.y2 - begin.y1;
  const float ex = end.x2 - end.x1;
  const float ey = end.y2 - end.y1;
  const float begin_length2 = bx * bx + by * by;
  const float end_length2 = ex * ex + ey * ey;
  const float product = bx * ex + by * ey;
  if (begin_length2 < 1 || end_length2 < 1 || product <= 0) return false;
  if (4 * product * product < begin_length2 * end_length2) return false;

  MovingLine line;
  const float length = std::sqrt((bx + ex) * (bx + ex) + (by + ey) * (by + ey));
  line.ux = (bx + ex) / length;
  line.uy = (by + ey) / length;
  line.cx = 0.25F * (begin.x1 + begin.x2 + end.x1 + end.x2);
  line.cy = 0.25F * (begin.y1 + begin.y2 + end.y1 + end.y2);
  const Segment* ends[2] = {&begin, &end};
  float offset[2];
  float slope[2];
  for (int i = 0; i < 2; ++i) {
    const Segment& e = *ends[i];
    line.low[i] = line.along(e.x1, e.y1);
    line.high[i] = line.along(e.x2, e.y2);
    const float d = line.across(e.x1, e.y1);
    slope[i] = (line.across(e.x2, e.y2) - d) / ((line.high[i] - line.low[i]) * kAlongUnit);
    offset[i] = d - slope[i] * line.low[i] * kAlongUnit;
  }
  line.m[0] = 0.5F * (offset[0] + offset[1]);
  line.m[1] = 0.5F * (slope[0] + slope[1]);
  line.m[2] = 0.5F * (offset[1] - offset[0]);
  line.m[3] = 0.5F * (slope[1] - slope[0]);
  *out = line;
  return true;
}

}  // namespace lecalib
