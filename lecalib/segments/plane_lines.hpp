// SPDX-License-Identifier: MIT
/// From the rims of a plane's area to lines at the window's begin and end: back-projection of [Liu24] section 3.1.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/core/records.hpp"
#include "lecalib/segments/segment_detector.hpp"

namespace lecalib {

/// A straight edge that a plane shows, where it stands at the window's begin and end.
struct PlaneLine {
  Segment begin, end;
  float support;          ///< points of the plane in its extent, estimated
  std::uint8_t polarity;  ///< 1 ON, 0 OFF
};

/// The area that an edge sweeps in its plane has four rims: where the edge is at the begin and at the end of its time,
/// and the traces of its two end points. The first two run along v_x. Each pair of them that faces each other, or one
/// that has no counterpart, gives one line; several edges in one row, with gaps between, give several. The plane's
/// rulings at the window's begin and end, cut to the rims' extent, are the line at these times.
/// @param depth_px  of the window
/// @return how many lines were written, at most out.size(); *dropped counts those without room
std::size_t lines_of_plane(const EventPlane& plane, const PlaneFrame& frame, float depth_px,
                           Span<const PlaneSegment> rims, Span<PlaneLine> out, std::uint32_t* dropped);

}  // namespace lecalib
