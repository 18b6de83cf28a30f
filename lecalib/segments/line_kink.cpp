// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_kink.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

constexpr float kKinkColumnPx = 12;
constexpr int kMinKinkColumns = 8;
constexpr int kSmoothTerms = 5;  // 1, u, ..., u^4
constexpr int kEndColumns = 2;   // columns at either end where a hinge could follow a single column

/// Product of a hinge max(0, u - c) with a vector over the columns, from sums over the columns behind c.
struct HingeProduct {
  float sum = 0, moment = 0;

  void add(float weight, float u, float value) noexcept {
    sum += weight * value;
    moment += weight * value * u;
  }
  [[nodiscard]] float with(float hinge) const noexcept { return moment - hinge * sum; }
};

/// With the vectors that a search for a kink needs: 1, u, the means and the smooth terms.
struct HingeSums {
  HingeProduct one, unit, mean, smooth[kSmoothTerms];
};

}  // namespace

KinkFinder::KinkFinder(float low_px, float high_px) noexcept : low_px_(low_px) {
  const float length = high_px - low_px;
  count_ = std::clamp(static_cast<int>(length / kKinkColumnPx), 0, kMaxColumns);
  if (count_ < kMinKinkColumns) count_ = 0;
  end_ = static_cast<float>(count_);
  columns_per_px_ = count_ > 0 ? static_cast<float>(count_) / length : 0;
}

/// From -1 to 1.
float KinkFinder::unit_position(int column) const noexcept {
  return (static_cast<float>(2 * column + 1) - static_cast<float>(count_)) / static_cast<float>(count_);
}

float KinkFinder::dot(const float* a, const float* b) const noexcept {
  float sum = 0;
  for (int i = 0; i < count_; ++i) sum += weight_[i] * a[i] * b[i];
  return sum;
}

/// Takes the part along the unit vector out of `v`.
void KinkFinder::remove(const float* unit, float* v) const noexcept {
  const float part = dot(unit, v);
  for (int i = 0; i < count_; ++i) v[i] -= part * unit[i];
}

/// Makes the smooth terms orthonormal under the columns' weights and takes them out of the means.
bool KinkFinder::remove_smooth_part(float (*smooth)[kMaxColumns], int terms) noexcept {
  for (int term = 0; term < terms; ++term) {
    float* const v = smooth[term];
    for (int i = 0; i < count_; ++i) v[i] = term == 0 ? 1 : smooth[term - 1][i] * unit_position(i);
    for (int earlier = 0; earlier < term; ++earlier) remove(smooth[earlier], v);
    const float square = dot(v, v);
    if (!(square > 0)) return false;
    const float scale = 1 / std::sqrt(square);
    for (int i = 0; i < count_; ++i) v[i] *= scale;
    remove(v, mean_);
  }
  return true;
}

bool KinkFinder::find(const KinkOptions& options, float variance, float* at_px) noexcept {
  if (count_ == 0) return false;
  for (int i = 0; i < count_; ++i) {
    if (weight_[i] > 0) mean_[i] /= weight_[i];
  }
  float smooth[kSmoothTerms][kMaxColumns];
  if (!remove_smooth_part(smooth, kSmoothTerms)) return false;
  const float unexplained = dot(mean_, mean_);

  // Products of each hinge with the rest, from the sums over the columns behind it, hinge by hinge from the end on.
  float best = 0;
  float best_slope = 0;
  int best_column = 0;
  HingeSums sums;
  for (int at = count_ - 2; at >= kEndColumns; --at) {
    const float u = unit_position(at + 1);
    sums.one.add(weight_[at + 1], u, 1);
    sums.unit.add(weight_[at + 1], u, u);
    sums.mean.add(weight_[at + 1], u, mean_[at + 1]);
    const float hinge = unit_position(at);
    float square = sums.unit.with(hinge) - hinge * sums.one.with(hinge);
    for (int term = 0; term < kSmoothTerms; ++term) {
      sums.smooth[term].add(weight_[at + 1], u, smooth[term][at + 1]);
      const float part = sums.smooth[term].with(hinge);
      square -= part * part;
    }
    if (at >= count_ - kEndColumns || !(square > 0)) continue;
    const float slope = sums.mean.with(hinge) / square;
    if (slope * slope * square < best) continue;
    best = slope * slope * square;
    best_slope = slope;
    best_column = at;
  }
  const float angle = std::fabs(best_slope) * 2 * columns_per_px_ / static_cast<float>(count_);
  if (best < options.min_share * unexplained || angle < options.min_angle || best < options.min_evidence * variance) {
    return false;
  }
  *at_px = low_px_ + (static_cast<float>(best_column) + 0.5F) / columns_per_px_;
  return true;
}

}  // namespace lecalib
