// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "lecalib/core/arena.hpp"
#include "lecalib/core/records.hpp"

namespace lecalib {

/// Keeps the lines of a bounded number of windows, spread evenly over the time seen so far: when the bank is full,
/// every other window is given up and from then on only every 2^k-th window is taken.
class LineBank {
 public:
  template <class Carver>
  constexpr bool carve(Carver& carver, std::uint32_t windows, std::uint32_t lines_per_window) {
    lines_per_window_ = lines_per_window;
    return carver.carve(windows, &windows_) && carver.carve(std::size_t{windows} * lines_per_window, &lines_);
  }

  void clear();

  /// Takes a copy of the window's lines; lines beyond the capacity per window are left out and counted, the last first.
  void add(const LineWindow& window);

  /// The kept windows in order of time; valid until the next add().
  [[nodiscard]] Span<const LineWindow> windows() const { return {windows_.data(), count_}; }
  [[nodiscard]] std::uint32_t offered() const { return offered_; }
  [[nodiscard]] std::uint32_t lines_dropped() const { return lines_dropped_; }

 private:
  void keep_every_other();
  void store(std::uint32_t slot, const LineWindow& window);

  Span<LineWindow> windows_;
  Span<EventLine> lines_;  ///< [windows x lines_per_window]
  std::uint32_t lines_per_window_ = 0;
  std::uint32_t count_ = 0;
  std::uint32_t stride_ = 1;  ///< one window of `stride_` offered is kept
  std::uint32_t offered_ = 0;
  std::uint32_t lines_dropped_ = 0;
};

}  // namespace lecalib
