// SPDX-License-Identifier: MIT
/// Lists the events along a line, for fits that visit them more than once.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/segments/corridor.hpp"
#include "lecalib/segments/line_workspace.hpp"

namespace lecalib {

/// The surroundings of a line that are listed.
struct ListedArea {
  float from_px, to_px;  ///< s
  float band_px;         ///< distance from the line on both sides
};

/// Lists one in `*stride` of the events near a line that are accepted, or a smaller share, as even, where these find no
/// room.
/// @param accept  of a LineEvent
/// @param[in,out] stride  above 0
/// @return how many stand in workspace.along, across and tau
template <class Accept>
std::size_t list_near_line(const EventCloud& cloud, const MovingLine& line, const ListedArea& area,
                           const LineWorkspace& workspace, std::uint32_t* stride, Accept accept) {
  const std::size_t room = workspace.along.size();
  for (;; *stride *= 2) {
    std::size_t found = 0;
    for_each_near_line(cloud, line, area.from_px, area.to_px, area.band_px, line.polarities, *stride,
                       [&](const LineEvent& event) {
                         if (!accept(event) || ++found > room) return;
                         workspace.along[found - 1] = event.along_px;
                         workspace.across[found - 1] = event.across_px;
                         workspace.tau[found - 1] = event.tau;
                       });
    if (found <= room || room == 0) return std::min(found, room);
  }
}

}  // namespace lecalib
