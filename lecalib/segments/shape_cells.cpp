// SPDX-License-Identifier: MIT
#include "lecalib/segments/shape_cells.hpp"

#include <algorithm>

#include "lecalib/segments/event_weight.hpp"

namespace lecalib {
namespace {

constexpr float kMinCellWeight = 3;  // of cells that tell whether the shape fits
constexpr float kFreeTerms = 5;      // of the shape, that the priors hardly hold

}  // namespace

void ShapeCells::clear() noexcept {
  for (int i = 0; i < columns_ * kSlots; ++i) cells_[i] = {};
}

float ShapeCells::variance(const ShapeCell& cell, float variance, float misfit2) noexcept {
  return variance * kVarianceInflation / cell.weight + misfit2;
}

void ShapeCells::add_to(ShapeEquations* equations, float variance, float misfit2) const noexcept {
  for (int i = 0; i < columns_ * kSlots; ++i) {
    const ShapeCell& cell = cells_[i];
    if (!(cell.weight > 0)) continue;
    equations->add(cell.u / cell.weight, cell.tau / cell.weight, 1 / ShapeCells::variance(cell, variance, misfit2),
                   cell.residual / cell.weight);
  }
}

float ShapeCells::misfit2(float variance) const noexcept {
  float chi2 = 0;
  float cells = 0;
  float weight = 0;
  for (int i = 0; i < columns_ * kSlots; ++i) {
    const ShapeCell& cell = cells_[i];
    weight += cell.weight;
    if (cell.weight < kMinCellWeight) continue;
    chi2 += cell.residual * cell.residual / cell.weight;
    cells += 1;
  }
  const float expected = std::max(cells - kFreeTerms, 1.0F) * variance * kVarianceInflation;
  return weight > 0 ? std::max(0.0F, (chi2 - expected) / weight) : 0;
}

float ShapeCells::dispersion() const noexcept {
  float square = 0;
  float sum = 0;
  for (int i = 1; i + 1 < columns_; ++i) {
    for (int slot = 0; slot < kSlots; ++slot) {
      const ShapeCell* const cell = &cells_[i * kSlots + slot];
      const float second = cell[-kSlots].events - 2 * cell->events + cell[kSlots].events;
      square += second * second / 6;
      sum += cell->events;
    }
  }
  return sum > 0 ? square / sum : 0;
}

ShapeCell ShapeCells::joined(int first_column, int last_column, int first_slot, int last_slot) const noexcept {
  ShapeCell sum{};
  for (int i = first_column; i < last_column; ++i) {
    for (int slot = first_slot; slot < last_slot; ++slot) {
      const ShapeCell& cell = cells_[i * kSlots + slot];
      sum.events += cell.events;
      sum.weight += cell.weight;
      sum.u += cell.u;
      sum.tau += cell.tau;
      sum.residual += cell.residual;
    }
  }
  return sum;
}

}  // namespace lecalib
