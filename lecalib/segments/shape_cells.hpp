// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include "lecalib/segments/shape_equations.hpp"

namespace lecalib {

/// Weighted sums over what fell into a stretch of a line and a part of its window.
struct ShapeCell {
  float events, weight, u, tau, residual;
};

/// Sums up residuals from a shape in cells along the line and in time, so that all of them count in a fit at the cost
/// of one visit.
class ShapeCells {
 public:
  static constexpr int kMaxColumns = 24;
  static constexpr int kSlots = 4;  ///< of the window
  static constexpr int kMaxCells = kMaxColumns * kSlots;

  /// @param columns along the line, 1 to kMaxColumns
  explicit ShapeCells(int columns) : columns_(columns), half_columns_(0.5F * static_cast<float>(columns)) { clear(); }

  void clear() noexcept;
  /// @param u    from -1 to 1, or a little beside
  /// @param tau  from -1 to 1
  void add(float u, float tau, float weight, float residual) noexcept {
    const int column = std::clamp(static_cast<int>((u + 1) * half_columns_), 0, columns_ - 1);
    const int slot = std::min(static_cast<int>((tau + 1) * (0.5F * kSlots)), kSlots - 1);
    ShapeCell& cell = cells_[column * kSlots + slot];
    cell.events += 1;
    cell.weight += weight;
    cell.u += weight * u;
    cell.tau += weight * tau;
    cell.residual += weight * residual;
  }
  /// Adds the cells' mean residuals to the equations. @param variance  of one residual, px^2, see variance()
  void add_to(ShapeEquations* equations, float variance, float misfit2) const noexcept;
  /// How much the cells' means scatter beyond what the number of residuals in them explains, px^2: what the shape does
  /// not follow, and what neighbours have in common.
  [[nodiscard]] float misfit2(float variance) const noexcept;
  /// Of a cell's mean residual, px^2.
  static float variance(const ShapeCell& cell, float variance, float misfit2) noexcept;
  /// Variance over mean of the cells' counts along the line; slow changes are left aside by second differences.
  [[nodiscard]] float dispersion() const noexcept;
  /// The sum of some cells side by side.
  [[nodiscard]] ShapeCell joined(int first_column, int last_column, int first_slot, int last_slot) const noexcept;
  [[nodiscard]] int columns() const noexcept { return columns_; }

 private:
  int columns_;
  float half_columns_;
  ShapeCell cells_[kMaxCells];  // in use: those of the columns
};

}  // namespace lecalib
