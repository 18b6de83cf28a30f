// SPDX-License-Identifier: MIT
#include "lecalib/segments/plane_lines.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

/// Rims flatter than this run along v_x (cosine of 26 degrees); the others are traces of end points.
constexpr float kMinAlongCosine = 0.9F;
/// Share of the shorter rim that faces its counterpart.
constexpr float kMinFacing = 0.5F;

enum class RimSide : std::uint8_t { trace, early, late };

RimSide side_of(const PlaneFrame& frame, const PlaneSegment& rim) {
  const float dx = rim.b.x - rim.a.x;
  const float dy = rim.b.y - rim.a.y;
  if (dx * dx < kMinAlongCosine * kMinAlongCosine * (dx * dx + dy * dy)) return RimSide::trace;
  return rim.normal_y * frame.v_y.z > 0 ? RimSide::early : RimSide::late;
}

struct Extent {
  float low, high;
};

Extent extent_of(const PlaneSegment& rim) { return {std::min(rim.a.x, rim.b.x), std::max(rim.a.x, rim.b.x)}; }

float overlap(const Extent& a, const Extent& b) { return std::min(a.high, b.high) - std::max(a.low, b.low); }

bool face_each_other(const Extent& a, const Extent& b) {
  return overlap(a, b) >= kMinFacing * std::min(a.high - a.low, b.high - b.low);
}

/// The plane's ruling at depth z over an extent.
Segment ruling(const PlaneFrame& frame, const Extent& extent, float z) {
  const float y = (z - frame.origin.z) / frame.v_y.z;
  const Point3 p = from_plane(frame, {extent.low, y});
  const Point3 q = from_plane(frame, {extent.high, y});
  return {p.x, p.y, q.x, q.y};
}

}  // namespace

std::size_t lines_of_plane(const EventPlane& plane, const PlaneFrame& frame, float depth_px,
                           Span<const PlaneSegment> rims, Span<PlaneLine> out, std::uint32_t* dropped) {
  Extent whole{1e9F, -1e9F};
  for (const PlaneSegment& rim : rims) {
    const Extent e = extent_of(rim);
    whole = {std::min(whole.low, e.low), std::max(whole.high, e.high)};
  }
  std::size_t count = 0;
  const auto emit = [&](const Extent& extent) {
    if (count == out.size()) {
      ++*dropped;
      return;
    }
    const float share = (extent.high - extent.low) / std::max(whole.high - whole.low, 1.0F);
    out[count++] = {ruling(frame, extent, 0), ruling(frame, extent, depth_px), share * static_cast<float>(plane.count),
                    plane.polarity};
  };

  for (const PlaneSegment& rim : rims) {
    const RimSide side = side_of(frame, rim);
    if (side == RimSide::trace) continue;
    Extent extent = extent_of(rim);
    bool has_counterpart = false;
    for (const PlaneSegment& other : rims) {
      const RimSide other_side = side_of(frame, other);
      if (other_side == RimSide::trace || other_side == side || !face_each_other(extent_of(rim), extent_of(other)))
        continue;
      has_counterpart = true;
      extent = {std::min(extent.low, extent_of(other).low), std::max(extent.high, extent_of(other).high)};
    }
    // Each pair is written once, with its early rim.
    if (side == RimSide::early || !has_counterpart) emit(extent);
  }
  return count;
}

}  // namespace lecalib
