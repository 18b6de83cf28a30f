// SPDX-License-Identifier: MIT
#include "lecalib/segments/failed_lines.hpp"

#include <cmath>

namespace lecalib {
namespace {

// As far as a guess from a few tens of events may be from the line that it grows to.
constexpr float kMaxDistancePx = 1;
constexpr float kMaxSine = 0.1F;
constexpr float kMaxFailedMotionPx = 1;  // of half a window

}  // namespace

bool FailedLines::lies_on(const MovingLine& line, const MovingLine& guess) {
  if (line.polarities != guess.polarities) return false;
  const float s = line.along(guess.cx, guess.cy);
  if (s < line.lowest() || s > line.highest()) return false;
  if (std::fabs(line.across(guess.cx, guess.cy) - line.offset(s, 0)) > kMaxDistancePx) return false;
  const float slope = (line.m[1] + 2 * line.m[4] * s * kAlongUnit) * kAlongUnit;
  const float cosine = line.ux * guess.ux + line.uy * guess.uy;
  const float sine = line.ux * guess.uy - line.uy * guess.ux;
  const float way = cosine < 0 ? -1.0F : 1.0F;  // the guess may run the other way
  if (std::fabs(way * sine - slope) > kMaxSine) return false;
  const float motion = line.m[2] + line.m[3] * s * kAlongUnit;
  return std::fabs(motion - way * guess.m[2]) <= kMaxFailedMotionPx;
}

}  // namespace lecalib
