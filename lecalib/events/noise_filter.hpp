// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/records.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/events/flicker_filter.hpp"

namespace lecalib {

/// Times are compared in steps of 1/254 of the window's length; an option above 0 counts as one step at least.
struct NoiseFilterOptions {
  std::uint16_t width = 0;   ///< of the sensor, px, > 0
  std::uint16_t height = 0;  ///< px, > 0
  /// Lamps on the mains flicker where a region fires in the same part of so many of the last 8 periods; 0: off. Up
  /// to 8.
  std::uint8_t flicker_periods = 6;
  /// A pixel is hot if it fires so often in a window, whatever the polarity, and ...; 0: off. Up to 255.
  std::uint8_t hot_min_events = 8;
  /// ... more than so many times as often as the busiest of its 8 neighbours.
  std::uint8_t hot_ratio = 3;
  /// After an event its pixel's next ones are dropped for so long, >= 0; 0: off. Each window begins anew.
  std::int64_t refractory_us = 0;
  /// An event stays if so many of its pixel's 8 neighbours fire within support_us before it, or after it; 0: off.
  std::uint8_t min_neighbours = 1;
  /// 0: half of the window, so that an edge which moves by two pixels or more in a window keeps its events.
  std::int64_t support_us = 0;
};

/// Counts since they were set to 0.
struct NoiseFilterStats {
  std::uint64_t events = 0;      ///< seen
  std::uint64_t kept = 0;        ///< passed on
  std::uint64_t outside = 0;     ///< dropped: beside the sensor
  std::uint64_t flicker = 0;     ///< dropped: of lamps that flicker
  std::uint64_t hot = 0;         ///< dropped: of a hot pixel
  std::uint64_t refractory = 0;  ///< dropped: too soon after another of its pixel
  std::uint64_t isolated = 0;    ///< dropped: without neighbours
};

struct NoiseFilterCapacities {
  std::uint16_t width = 0;
  std::uint16_t height = 0;
  bool flicker = true;  ///< room for the flicker filter: 1.2 bytes per pixel beside the 1 of the others
};

struct NoiseFilterWorkspace {
  Span<std::uint8_t> pixels;  ///< (width + 2) * (height + 2): a count or a time for each, framed by one pixel of 0
  FlickerFilter flicker;      ///< the only one that remembers earlier windows
};

template <class Carver>
constexpr bool carve(Carver& carver, const NoiseFilterCapacities& capacities, NoiseFilterWorkspace* out) noexcept {
  const std::size_t columns = capacities.width + std::size_t{2};
  const std::size_t rows = capacities.height + std::size_t{2};
  if (!carver.carve(columns * rows, &out->pixels)) return false;
  out->flicker = {};
  return !capacities.flicker || out->flicker.carve(carver, capacities.width, capacities.height);
}

/// Drops what no edge made from a window: events beside the sensor, of flickering lamps, of hot pixels, within the
/// refractory time (off by default), and without neighbours in space and time. Neighbours may come later, so the
/// window's first events have theirs. Lamps are known from about 80 ms of earlier windows on.
/// @param out at least as long as window.events; may be the same memory
/// @param[out] filtered the window's times and out[0, kept), unchanged unless ok
/// @param[in,out] stats counted up when ok
/// @return ok | invalid_argument (an option out of range, a window that ends before it begins) |
///         buffer_too_small (`out` or the workspace)
/// Complexity O(events + pixels), and what FlickerFilter::drop() says.
Status filter_noise(const EventWindow& window, const NoiseFilterOptions& options, NoiseFilterWorkspace* workspace,
                    Span<Event> out, EventWindow* filtered, NoiseFilterStats* stats) noexcept;

}  // namespace lecalib
