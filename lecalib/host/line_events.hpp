// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "lecalib/core/records.hpp"

namespace lecalib::host {

/// Events of a line lie so near to it at their own time, px: two sigma of a sharp edge's.
inline constexpr double kLineEventsPx = 2;

/// Which of `lines` each event of the window belongs to, -1 for none: the nearest within kLineEventsPx, of the event's
/// polarity, where the line stands at the event's time. Between the window's ends a line moves evenly; its bend stays.
/// Complexity O(events * lines).
std::vector<int> line_of_events(const EventWindow& events, Span<const EventLine> lines);

}  // namespace lecalib::host
