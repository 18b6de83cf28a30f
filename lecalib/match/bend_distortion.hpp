// SPDX-License-Identifier: MIT
/// Distortion from the bends of detected lines alone (Brown's plumb line): before anything is matched, the coefficient
/// of the division model for which the lines of all windows are straightest.
#pragma once

#include "lecalib/match/flat_lines.hpp"

namespace lecalib {

/// Votes over a grid of coefficients; lines are added window by window.
class BendVotes {
 public:
  /// Values tried: lambda times the squared half diagonal, from -0.9 (a fisheye-like wide angle) to +0.15.
  static constexpr int kNumValues = 43;

  /// @param unit_px about a thousandth of the image's diagonal: smallest sigma of a bend is half of it
  void init(std::uint16_t width, std::uint16_t height, double unit_px);
  void add(Span<const EventLine> lines);
  /// The best coefficient, 1 / px^2; 0 while there are no lines long enough to tell.
  [[nodiscard]] double lambda() const;

 private:
  [[nodiscard]] double lambda_of(int index) const;

  Lens centre_;
  double unit_px_ = 1.0;
  double half_diagonal_px_ = 1.0;
  double cost_[kNumValues] = {};
};

}  // namespace lecalib
