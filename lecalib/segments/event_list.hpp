// SPDX-License-Identifier: MIT
/// Lists the events along a line, for fits that visit them more than once.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/segments/corridor.hpp"
#include "lecalib/segments/line_workspace.hpp"
#include "lecalib/segments/shared_stretches.hpp"

namespace lecalib {

/// The surroundings of a line that are listed.
struct ListedArea {
  float from_px, to_px;  ///< s
  float band_px;         ///< distance from the line on both sides
};

/// The workspace's lists by their addresses, which writing to them cannot change.
struct EventList {
  float *along, *across, *tau;
  const std::uint8_t* owner;
  std::size_t room;

  explicit EventList(const LineWorkspace& workspace) noexcept
      : along(workspace.along.data()),
        across(workspace.across.data()),
        tau(workspace.tau.data()),
        owner(workspace.owner.data()),
        room(workspace.along.size()) {}
  void put(std::size_t at, const LineEvent& event) const noexcept {
    along[at] = event.along_px;
    across[at] = event.across_px;
    tau[at] = event.tau;
  }
};

/// Lists one in `*stride` of the events near a line that are accepted, or a smaller share, as even, where these find no
/// room.
/// @param accept  of a LineEvent&, which it may change
/// @param[in,out] stride  above 0
/// @return how many stand in workspace.along, across and tau
template <class Accept>
std::size_t list_near_line(const EventCloud& cloud, const MovingLine& line, const ListedArea& area,
                           const LineWorkspace& workspace, std::uint32_t* stride, Accept accept) {
  const EventList list(workspace);
  for (;; *stride *= 2) {
    std::size_t found = 0;
    for_each_near_line(cloud, line, area.from_px, area.to_px, area.band_px, line.polarities, *stride,
                       [&](LineEvent event) {
                         if (!accept(event) || ++found > list.room) return;
                         list.put(found - 1, event);
                       });
    if (found <= list.room || list.room == 0) return std::min(found, list.room);
  }
}

/// Calls visit(k) for the listed events [first, end) that do not lie in a shared stretch, in their order. It may change
/// the events up to k.
template <class Visit>
void for_each_clear(const SharedStretches& shared, const MovingLine& line, const EventList& list, std::size_t first,
                    std::size_t end, Visit visit) {
  for (; first < end; first += SharedStretches::kBlock) {
    const std::size_t count = std::min(end - first, SharedStretches::kBlock);
    const std::uint32_t held = shared.hold_each(line, list.along + first, list.tau + first, count);
    for (std::size_t k = 0; k < count; ++k) {
      if ((held >> k & 1U) == 0) visit(first + k);
    }
  }
}

}  // namespace lecalib
