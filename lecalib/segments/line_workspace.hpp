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

struct LineCapacities {
  std::size_t events = 0;
  std::uint16_t width = 0, height = 0;  ///< of the sensor, px
};

/// Memory that growing, fitting and merging share.
struct LineWorkspace {
  Span<std::uint8_t> owner;       ///< [events] 0: free, else 1 + index of the line that holds the event
  Span<std::uint32_t> index;      ///< [events] events near the line at hand
  Span<float> along;              ///< [events] their s, px
  Span<std::uint16_t> histogram;  ///< [kHistogramRows * bins] counts along the line at hand
  Span<std::uint16_t> patches;    ///< [bins]
};

template <class Carver>
constexpr bool carve(Carver& carver, const LineCapacities& capacities, LineWorkspace* out) {
  // No straight line in the image is longer than width + height, and a little is read beyond its ends.
  const auto bins =
      static_cast<std::size_t>(capacities.width + capacities.height) / static_cast<std::size_t>(kHistogramBinPx) + 16;
  return carver.carve(capacities.events, &out->owner) && carver.carve(capacities.events, &out->index) &&
         carver.carve(capacities.events, &out->along) && carver.carve(kHistogramRows * bins, &out->histogram) &&
         carver.carve(bins, &out->patches);
}

}  // namespace lecalib
