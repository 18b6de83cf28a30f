// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_equations.hpp"

#include <algorithm>

namespace lecalib {
namespace {

constexpr int kN = kNumLineCoefficients;
/// Smallest pivot: below it the events say nothing about a coefficient, and neither do the priors.
constexpr float kMinPivot = 1e-6F;

struct Factor {
  float l[kN][kN];  // unit lower triangle
  float d[kN];

  bool factorise(const float (&a)[kN][kN]) {
    for (int i = 0; i < kN; ++i) {
      float pivot = a[i][i];
      for (int k = 0; k < i; ++k) pivot -= l[i][k] * l[i][k] * d[k];
      if (!(pivot > kMinPivot)) return false;
      d[i] = pivot;
      for (int j = i + 1; j < kN; ++j) {
        float v = a[j][i];
        for (int k = 0; k < i; ++k) v -= l[j][k] * l[i][k] * d[k];
        l[j][i] = v / pivot;
      }
    }
    return true;
  }

  void solve_in_place(float* v) const {
    for (int i = 0; i < kN; ++i) {
      for (int k = 0; k < i; ++k) v[i] -= l[i][k] * v[k];
    }
    for (int i = 0; i < kN; ++i) v[i] /= d[i];
    for (int i = kN - 1; i >= 0; --i) {
      for (int k = i + 1; k < kN; ++k) v[i] -= l[k][i] * v[k];
    }
  }
};

/// Events are summed four at a time, for vector units: of a block, lane i takes event i. Which event meets which lane
/// does not depend on the target, so neither do the sums.
constexpr int kLanes = 4;

/// The events [first, first + kLanes); behind the last one stands the first of the list, as not present.
struct Block {
  float s_px[kLanes], d[kLanes], t[kLanes], present[kLanes];

  Block(const ListedEvents& events, std::size_t first) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::size_t k = first + static_cast<std::size_t>(lane);
      const std::size_t i = k < events.count ? k : 0;
      s_px[lane] = events.along[i];
      d[lane] = events.across[i];
      t[lane] = events.tau[i];
      present[lane] = k < events.count ? 1.0F : 0.0F;
    }
  }
};

}  // namespace

struct LineEquations::Lanes {
  float sums[kNumSums][kLanes] = {};

  /// One lane's column of the sums.
  struct Column {
    float (*sums)[kLanes];
    int lane;
    float& operator[](int sum) const { return sums[sum][lane]; }
  };
  Column column(int lane) { return {sums, lane}; }

  static float sum(const float (&lanes)[kLanes]) { return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]); }
  void add_to(float (&total)[kNumSums]) const {
    for (int i = 0; i < kNumSums; ++i) total[i] += sum(sums[i]);
  }
};

void LineEquations::add(const ListedEvents& events) noexcept {
  Lanes lanes;
  for (std::size_t first = 0; first < events.count; first += kLanes) {
    const Block block(events, first);
    for (int lane = 0; lane < kLanes; ++lane) {
      add_monomials(block.s_px[lane], block.t[lane], block.d[lane], block.present[lane], lanes.column(lane));
    }
  }
  lanes.add_to(sums_);
}

WeightedSupport LineEquations::add_near(const ListedEvents& events, const MovingLine& line, float band_px) noexcept {
  const float per_band = 1 / band_px;
  Lanes lanes;
  float squares[kLanes] = {};
  float counts[kLanes] = {};
  for (std::size_t first = 0; first < events.count; first += kLanes) {
    const Block block(events, first);
    for (int lane = 0; lane < kLanes; ++lane) {
      const float r = (block.d[lane] - line.offset(block.s_px[lane], block.t[lane])) * per_band;
      const float r2 = r * r;
      const float weight = std::max(1 - r2, 0.0F) * block.present[lane];
      add_monomials(block.s_px[lane], block.t[lane], block.d[lane], weight, lanes.column(lane));
      squares[lane] += weight * r2;
      counts[lane] += weight > 0 ? 1.0F : 0.0F;
    }
  }
  lanes.add_to(sums_);
  WeightedSupport support;
  support.events = static_cast<std::uint32_t>(Lanes::sum(counts));
  support.weight = Lanes::sum(lanes.sums[k1]);
  support.square = Lanes::sum(squares);
  return support;
}

bool LineEquations::solve(const LinePriors& priors, float variance, float* m, float* covariance) const {
  constexpr Sum kMatrix[kN][kN] = {{k1, kS, kT, kST, kSS},
                                   {kS, kSS, kST, kSST, kSSS},
                                   {kT, kST, kTT, kSTT, kSST},
                                   {kST, kSST, kSTT, kSSTT, kSSST},
                                   {kSS, kSSS, kSST, kSSST, kSSSS}};
  constexpr Sum kRight[kN] = {kD, kDS, kDT, kDST, kDSS};
  float a[kN][kN];
  for (int i = 0; i < kN; ++i) {
    for (int j = 0; j < kN; ++j) a[i][j] = sums_[kMatrix[i][j]];
  }
  a[1][1] += variance / (priors.motion_px * priors.motion_px);
  a[2][2] += variance / (priors.motion_px * priors.motion_px);
  a[3][3] += variance / (priors.turn_px * priors.turn_px);
  const float bend_weight = variance / (priors.bend_px * priors.bend_px);
  a[4][4] += bend_weight;

  Factor factor{};
  if (!factor.factorise(a)) return false;
  float x[kN];
  for (int i = 0; i < kN; ++i) x[i] = sums_[kRight[i]];
  x[4] += bend_weight * priors.bend_mean_px;
  factor.solve_in_place(x);
  for (int i = 0; i < kN; ++i) m[i] = x[i];
  if (covariance == nullptr) return true;
  for (int i = 0; i < kN; ++i) {
    float column[kN] = {};
    column[i] = 1;
    factor.solve_in_place(column);
    for (int j = i; j < kN; ++j) *covariance++ = column[j];
  }
  return true;
}

}  // namespace lecalib
