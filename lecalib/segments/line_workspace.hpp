// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/span.hpp"

namespace lecalib {

/// Lines are told apart by one byte per event.
inline constexpr std::size_t kMaxLines = 254;
/// Bin of the histograms along a line, px.
inline constexpr float kHistogramBinPx = 2;
/// The window's quarters: extents and evenness are judged over them.
inline constexpr std::size_t kHistogramRows = 4;

/// Events of a line that are looked at at once; of lines that have more, an even share is.
inline constexpr std::size_t kMaxListedEvents = 8192;

struct LineCapacities {
  std::size_t events = 0;
  std::uint16_t width = 0, height = 0;  ///< of the sensor, px
  bool edges = true;                    ///< room for fit_crossings()
};

/// Which events a line may take.
struct OwnerFilter {
  /// [kMaxLines + 1] by owner; null: only free events.
  const bool* may_take = nullptr;

  [[nodiscard]] bool operator()(std::uint8_t owner) const noexcept {
    return owner == 0 || (may_take != nullptr && may_take[owner]);
  }
};

/// Lets a line take its own events and free ones; with two ids, those of both pieces of a line.
class OwnEvents {
 public:
  explicit OwnEvents(std::uint8_t id) noexcept : OwnEvents(id, id) {}
  OwnEvents(std::uint8_t id, std::uint8_t other) noexcept { may_take_[id] = may_take_[other] = true; }
  [[nodiscard]] OwnerFilter filter() const noexcept { return {may_take_}; }

 private:
  bool may_take_[kMaxLines + 1] = {};
};

/// Memory that growing, fitting and merging share.
struct LineWorkspace {
  Span<std::uint8_t> owner;            ///< [events] 0: free, else the id of the line that holds the event
  Span<float> along;                   ///< [kMaxListedEvents, or events] the events near the line at hand: s, px
  Span<float> across;                  ///< [as along] d, px
  Span<float> tau;                     ///< [as along]
  Span<std::uint16_t> histogram;       ///< [kHistogramRows * bins] counts along the line at hand
  Span<std::uint16_t> patches;         ///< [bins]
  Span<std::uint8_t> pixel;            ///< [as along] of the events of one cell near the line: their place in the cell
  Span<float> times;                   ///< [2 * as along] the same events' tau, by time and by pixel
  Span<std::uint8_t> crossing_events;  ///< [as along] of each crossing
};

template <class Carver>
constexpr bool carve(Carver& carver, const LineCapacities& capacities, LineWorkspace* out) {
  // No straight line in the image is longer than width + height, and a little is read beyond its ends.
  const auto bins =
      static_cast<std::size_t>(capacities.width + capacities.height) / static_cast<std::size_t>(kHistogramBinPx) + 16;
  const std::size_t listed = capacities.events < kMaxListedEvents ? capacities.events : kMaxListedEvents;
  return carver.carve(capacities.events, &out->owner) && carver.carve(listed, &out->along) &&
         carver.carve(listed, &out->across) && carver.carve(listed, &out->tau) &&
         carver.carve(kHistogramRows * bins, &out->histogram) && carver.carve(bins, &out->patches) &&
         carver.carve(capacities.edges ? listed : 0, &out->pixel) &&
         carver.carve(capacities.edges ? 2 * listed : 0, &out->times) &&
         carver.carve(capacities.edges ? listed : 0, &out->crossing_events);
}

}  // namespace lecalib
