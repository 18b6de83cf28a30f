// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "lecalib/core/arena.hpp"
#include "lecalib/core/records.hpp"

namespace lecalib {

/// Keeps the lines of a bounded number of windows. When the bank is full, each further window displaces the one that is
/// missed least: a window stands for the stretch between its neighbours, in windows offered (each of which saw about as
/// much motion), and by how much it tells of its lines, the information of its edges.
class LineBank {
 public:
  template <class Carver>
  constexpr bool carve(Carver& carver, std::uint32_t windows, std::uint32_t lines_per_window) {
    lines_per_window_ = lines_per_window;
    return carver.carve(windows, &windows_) && carver.carve(windows, &kept_) &&
           carver.carve(std::size_t{windows} * lines_per_window, &lines_);
  }

  void clear();

  /// Takes a copy of the window's lines; lines beyond the capacity per window are left out and counted, the last first.
  /// @param information what the window tells, as information_of() has it: banks of several cameras that are told the
  ///                    same keep the same windows
  void add(const LineWindow& window, float information);

  /// Of where a window's edges are, 1/px^2.
  static float information_of(Span<const EventLine> lines);

  /// The kept windows in order of time; valid until the next add().
  [[nodiscard]] Span<const LineWindow> windows() const { return {windows_.data(), count_}; }
  [[nodiscard]] std::uint32_t offered() const { return offered_; }
  [[nodiscard]] std::uint32_t lines_dropped() const { return lines_dropped_; }

 private:
  struct Kept {
    std::uint32_t offer;  ///< how many windows were offered before
    std::uint32_t place;  ///< of its lines, in windows
    float information;    ///< 1/px^2
  };

  [[nodiscard]] std::size_t least_missed() const;
  void take_out(std::size_t index);

  Span<LineWindow> windows_;
  Span<Kept> kept_;        ///< [windows]
  Span<EventLine> lines_;  ///< [windows x lines_per_window]
  std::uint32_t lines_per_window_ = 0;
  std::uint32_t count_ = 0;
  std::uint32_t offered_ = 0;
  std::uint32_t lines_dropped_ = 0;
};

}  // namespace lecalib
