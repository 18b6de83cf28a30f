// SPDX-License-Identifier: MIT
#include "lecalib/segments/shared_stretches.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/segments/event_weight.hpp"

namespace lecalib {
namespace {

constexpr float kScatterSigmas = 2.5F;
constexpr float kBendChangePx = 0.1F;  // of m4, between lines that cross at a small angle
constexpr int kMaxHalvings = 3;
constexpr int kPlaces = 16;  // along a line, that tell how much of it is shared

/// Distance of s from the line's extent, px.
float beyond(const MovingLine& line, float s) {
  return std::max(0.0F, std::max(line.lowest() - s, s - line.highest()));
}

}  // namespace

bool may_hide(const MovingLine& a, const MovingLine& b, const SharingOptions& options) {
  if ((a.polarities & b.polarities) == 0) return false;
  const float sine = a.ux * b.uy - a.uy * b.ux;
  if (std::fabs(sine) < options.min_sine || std::fabs(sine) > options.max_sine) return false;
  const float of_a = ((b.cx - a.cx) * b.uy - (b.cy - a.cy) * b.ux) / sine;
  const float of_b = ((b.cx - a.cx) * a.uy - (b.cy - a.cy) * a.ux) / sine;
  return beyond(a, of_a) <= options.reach_px && beyond(b, of_b) <= options.reach_px;
}

SharedStretches::SharedStretches(const SharingOptions& options, Span<const MovingLine> lines, const MovingLine& line,
                                 const OwnerFilter& own) {
  for (const MovingLine& other : lines) {
    if (other.events == 0 || own(other.id) || count_ == kMaxOthers) continue;
    if (!may_hide(line, other, options)) continue;
    others_[count_] = &other;
    reach_px_[count_++] = claimed_band(other.thickness_px) + kScatterSigmas * line.thickness_px;
  }
  for (int i = 0; i < kMaxHalvings && share_of(line) > options.max_shared_share; ++i) {
    for (int k = 0; k < count_; ++k) reach_px_[k] *= 0.5F;
  }
}

float SharedStretches::share_of(const MovingLine& line) const noexcept {
  if (empty()) return 0;
  int shared = 0;
  for (int i = 0; i < kPlaces; ++i) {
    const float s = line.lowest() + (line.highest() - line.lowest()) * (static_cast<float>(i) + 0.5F) / kPlaces;
    for (const float tau : {-1.0F, 0.0F, 1.0F}) shared += hold(line, s, tau) ? 1 : 0;
  }
  return static_cast<float>(shared) / (3 * kPlaces);
}

bool SharedStretches::is_other(std::uint8_t owner) const noexcept {
  for (int i = 0; i < count_; ++i) {
    if (others_[i]->id == owner) return true;
  }
  return false;
}

LinePriors SharedStretches::priors(const LinePriors& of_any, const MovingLine& line) const noexcept {
  LinePriors out = of_any;
  for (int i = 0; i < count_; ++i) {
    const MovingLine& other = *others_[i];
    const float sigma = std::sqrt(kBendChangePx * kBendChangePx + other.covariance[14]);
    if (sigma >= out.bend_px) continue;
    out.bend_px = sigma;
    out.bend_mean_px = other.ux * line.ux + other.uy * line.uy > 0 ? other.m[4] : -other.m[4];
  }
  return out;
}

bool SharedStretches::any_holds(const MovingLine& line, float s_px, float tau) const noexcept {
  const float d = line.offset(s_px, tau);
  const float x = line.x(s_px, d);
  const float y = line.y(s_px, d);
  for (int i = 0; i < count_; ++i) {
    const MovingLine& other = *others_[i];
    const float s = other.along(x, y);
    if (std::fabs(other.across(x, y) - other.offset(s, tau)) < reach_px_[i] && beyond(other, s) < kBeyondEndsPx) {
      return true;
    }
  }
  return false;
}

std::uint32_t SharedStretches::hold_each(const MovingLine& line, const float* s_px, const float* tau,
                                         std::size_t count) const noexcept {
  float x[kBlock] = {};
  float y[kBlock] = {};
  float at[2][kBlock] = {};
  for (std::size_t k = 0; k < count; ++k) {
    at[0][k] = s_px[k];
    at[1][k] = tau[k];
  }
  for (std::size_t k = 0; k < kBlock; ++k) {
    const float d = line.offset(at[0][k], at[1][k]);
    x[k] = line.x(at[0][k], d);
    y[k] = line.y(at[0][k], d);
  }
  std::uint32_t held = 0;
  for (int i = 0; i < count_; ++i) {
    const MovingLine& other = *others_[i];
    const float low = other.lowest();
    const float high = other.highest();
    const float reach = reach_px_[i];
    for (std::size_t k = 0; k < kBlock; ++k) {
      const float s = other.along(x[k], y[k]);
      const float distance = std::fabs(other.across(x[k], y[k]) - other.offset(s, at[1][k]));
      const bool is_held = static_cast<unsigned>(distance < reach) & static_cast<unsigned>(low - s < kBeyondEndsPx) &
                           static_cast<unsigned>(s - high < kBeyondEndsPx);
      held |= is_held ? detail::kEventBits[k] : 0;
    }
  }
  return held & ((1U << count) - 1);
}

}  // namespace lecalib
