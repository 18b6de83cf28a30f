// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_equations.hpp"

#include <algorithm>

#include "lecalib/segments/event_lanes.hpp"

namespace lecalib {
namespace {

constexpr int kCoefficients = kNumLineCoefficients;
/// Smallest pivot: below it the events say nothing about a coefficient, and neither do the priors.
constexpr float kMinPivot = 1e-6F;

struct Factor {
  float l[kCoefficients][kCoefficients];  // unit lower triangle
  float d[kCoefficients];

  bool factorise(const float (&a)[kCoefficients][kCoefficients]) {
    for (int i = 0; i < kCoefficients; ++i) {
      float pivot = a[i][i];
      for (int k = 0; k < i; ++k) pivot -= l[i][k] * l[i][k] * d[k];
      if (!(pivot > kMinPivot)) return false;
      d[i] = pivot;
      for (int j = i + 1; j < kCoefficients; ++j) {
        float v = a[j][i];
        for (int k = 0; k < i; ++k) v -= l[j][k] * l[i][k] * d[k];
        l[j][i] = v / pivot;
      }
    }
    return true;
  }

  void solve_in_place(float* v) const {
    for (int i = 0; i < kCoefficients; ++i) {
      for (int k = 0; k < i; ++k) v[i] -= l[i][k] * v[k];
    }
    for (int i = 0; i < kCoefficients; ++i) v[i] /= d[i];
    for (int i = kCoefficients - 1; i >= 0; --i) {
      for (int k = i + 1; k < kCoefficients; ++k) v[i] -= l[k][i] * v[k];
    }
  }
};

/// Events are summed in four lanes, for vector units. Which event meets which lane does not depend on the target, so
/// neither do the sums.
constexpr int kLanes = 4;

/// The events [first, first + kLanes); behind the last one stands the first of the list, as not present.
struct Block {
  float s_px[kLanes], d[kLanes], t[kLanes], present[kLanes];

  Block(const ListedEvents& events, std::size_t first) {
    if (first + kLanes <= events.count) {
      if (events.stride == 1) {
        take(events, first, 1);
      } else {
        take(events, first * events.stride, events.stride);
      }
      return;
    }
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::size_t k = first + static_cast<std::size_t>(lane);
      const std::size_t i = k < events.count ? k * events.stride : 0;
      s_px[lane] = events.along[i];
      d[lane] = events.across[i];
      t[lane] = events.tau[i];
      present[lane] = k < events.count ? 1.0F : 0.0F;
    }
  }

 private:
  void take(const ListedEvents& events, std::size_t from, std::size_t stride) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      s_px[lane] = events.along[from + lane * stride];
      d[lane] = events.across[from + lane * stride];
      t[lane] = events.tau[from + lane * stride];
      present[lane] = 1;
    }
  }
};

}  // namespace

/// The sums of the normal equations, and two more of a weighted fit.
struct LineEquations::Lanes {
  enum { kSquare = kNumSums, kCount, kNumColumns };
  float sums[kNumColumns][kLanes] = {};

  /// One lane's column of the sums.
  struct Column {
    float (*sums)[kLanes];
    int lane;
    float& operator[](int sum) const { return sums[sum][lane]; }
  };

  /// Calls add(s_px, t, d, present, sums of the event's lane) for the events, and for some that are not present (0).
  template <class Add>
  void visit(const ListedEvents& events, Add add) {
    if constexpr (detail::kSideBySide) {
      for (std::size_t first = 0; first < events.count; first += kLanes) {
        const Block block(events, first);
        for (int lane = 0; lane < kLanes; ++lane) {
          add(block.s_px[lane], block.t[lane], block.d[lane], block.present[lane], Column{sums, lane});
        }
      }
    } else {
      for (int lane = 0; lane < kLanes; ++lane) {
        float column[kNumColumns] = {};
        for (auto k = static_cast<std::size_t>(lane); k < events.count; k += kLanes) {
          const std::size_t i = k * events.stride;
          add(events.along[i], events.tau[i], events.across[i], 1.0F, column);
        }
        for (int i = 0; i < kNumColumns; ++i) sums[i][lane] = column[i];
      }
    }
  }

  [[nodiscard]] float total(int i) const { return (sums[i][0] + sums[i][1]) + (sums[i][2] + sums[i][3]); }
  void add_to(float (&totals)[kNumSums]) const {
    for (int i = 0; i < kNumSums; ++i) totals[i] += total(i);
  }
};

void LineEquations::add(const ListedEvents& events) noexcept {
  Lanes lanes;
  lanes.visit(events, [](float s_px, float t, float d, float present, auto&& sums) {
    add_monomials(s_px, t, d, present, sums);
  });
  lanes.add_to(sums_);
}

WeightedSupport LineEquations::add_near(const ListedEvents& events, const MovingLine& line, float band_px) noexcept {
  const float per_band = 1 / band_px;
  Lanes lanes;
  lanes.visit(events, [&](float s_px, float t, float d, [[maybe_unused]] float present, auto&& sums) {
    const float r = (d - line.offset(s_px, t)) * per_band;
    const float r2 = r * r;
    if constexpr (detail::kSideBySide) {
      const float weight = std::max(1 - r2, 0.0F) * present;
      add_monomials(s_px, t, d, weight, sums);
      sums[Lanes::kSquare] += weight * r2;
      sums[Lanes::kCount] += weight > 0 ? 1.0F : 0.0F;
    } else if (r2 < 1) {
      add_monomials(s_px, t, d, 1 - r2, sums);
      sums[Lanes::kSquare] += (1 - r2) * r2;
      sums[Lanes::kCount] += 1;
    }
  });
  lanes.add_to(sums_);
  WeightedSupport support;
  support.events = static_cast<std::uint32_t>(lanes.total(Lanes::kCount));
  support.weight = lanes.total(k1);
  support.square = lanes.total(Lanes::kSquare);
  return support;
}

bool LineEquations::solve(const LinePriors& priors, float variance, float* m, float* covariance) const {
  constexpr Sum kMatrix[kCoefficients][kCoefficients] = {{k1, kS, kT, kST, kSS},
                                                         {kS, kSS, kST, kSST, kSSS},
                                                         {kT, kST, kTT, kSTT, kSST},
                                                         {kST, kSST, kSTT, kSSTT, kSSST},
                                                         {kSS, kSSS, kSST, kSSST, kSSSS}};
  constexpr Sum kRight[kCoefficients] = {kD, kDS, kDT, kDST, kDSS};
  float a[kCoefficients][kCoefficients];
  for (int i = 0; i < kCoefficients; ++i) {
    for (int j = 0; j < kCoefficients; ++j) a[i][j] = sums_[kMatrix[i][j]];
  }
  a[1][1] += variance / (priors.motion_px * priors.motion_px);
  a[2][2] += variance / (priors.motion_px * priors.motion_px);
  a[3][3] += variance / (priors.turn_px * priors.turn_px);
  const float bend_weight = variance / (priors.bend_px * priors.bend_px);
  a[4][4] += bend_weight;

  Factor factor{};
  if (!factor.factorise(a)) return false;
  float x[kCoefficients];
  for (int i = 0; i < kCoefficients; ++i) x[i] = sums_[kRight[i]];
  x[4] += bend_weight * priors.bend_mean_px;
  factor.solve_in_place(x);
  for (int i = 0; i < kCoefficients; ++i) m[i] = x[i];
  if (covariance == nullptr) return true;
  for (int i = 0; i < kCoefficients; ++i) {
    float column[kCoefficients] = {};
    column[i] = 1;
    factor.solve_in_place(column);
    for (int j = i; j < kCoefficients; ++j) *covariance++ = column[j];
  }
  return true;
}

}  // namespace lecalib
