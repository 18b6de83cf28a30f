// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "lecalib/core/records.hpp"
#include "lecalib/core/rng.hpp"

namespace lecalib::test {

/// `count` events in order of time, from begin_us on, up to `max_step_us` apart; runs of neighbours in a row are
/// common.
inline std::vector<Event> random_events(Rng* rng, std::size_t count, std::int64_t begin_us, std::uint32_t max_step_us,
                                        std::uint16_t width, std::uint16_t height) {
  std::vector<Event> events;
  Event event{begin_us, 0, 0, 0};
  while (events.size() < count) {
    const bool is_neighbour = rng->below(2) == 0 && event.x + 4 < width;
    if (is_neighbour) {
      event.x = static_cast<std::uint16_t>(event.x + 1 + rng->below(3));
    } else {
      event.t_us += rng->below(max_step_us + 1);
      event.x = static_cast<std::uint16_t>(rng->below(width));
      event.y = static_cast<std::uint16_t>(rng->below(height));
      event.polarity = static_cast<std::uint8_t>(rng->below(2));
    }
    events.push_back(event);
  }
  return events;
}

}  // namespace lecalib::test
