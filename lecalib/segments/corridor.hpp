// SPDX-License-Identifier: MIT
/// Reads a cloud's events along a moving line. The cost is that of the cells which the line sweeps.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "lecalib/core/event_cloud.hpp"
#include "lecalib/segments/event_lanes.hpp"
#include "lecalib/segments/moving_line.hpp"

namespace lecalib {

/// An event near to a line.
struct LineEvent {
  std::uint32_t index;  ///< into the cloud
  float along_px;       ///< s
  float across_px;      ///< d
  float tau;
  float residual_px;  ///< d minus the line's d at (s, tau)
};

namespace detail {

/// A pixel covers this much on each side of its coordinates, px.
inline constexpr float kHalfPixel = 0.5F;

/// Where a block of events stands to a line.
class NearBlock {
 public:
  /// Looks for events with s in [s0, s1) and |residual| <= band_px.
  NearBlock(const MovingLine& line, float s0, float s1, float band_px) noexcept
      : ux_(line.ux),
        uy_(line.uy),
        along_origin_(line.cx * line.ux + line.cy * line.uy),
        across_origin_(line.cy * line.ux - line.cx * line.uy),
        offset_(line.m[0]),
        slope_(line.m[1] * kAlongUnit),
        motion_(line.m[2]),
        turn_(line.m[3] * kAlongUnit),
        bend_(line.m[4] * kAlongUnit * kAlongUnit),
        s0_(s0),
        s1_(s1),
        band_px_(band_px) {}

  /// Calls visit for those among the events first, first + stride, ... below `end` that are near.
  template <class Visit>
  void look(const EventCloud& cloud, std::uint32_t first, std::uint32_t end, std::uint32_t stride, Visit& visit) {
    if constexpr (kSideBySide) {
      while (first < end) {
        const std::size_t count = std::min<std::size_t>((end - first + stride - 1) / stride, kEventBlock);
        // Which of a cell's events are near is not to be guessed: no branch on it.
        for (std::uint32_t near = find(cloud, first, stride, count); near != 0; near &= near - 1) {
          const auto k = static_cast<std::uint32_t>(__builtin_ctz(near));
          visit(LineEvent{first + stride * k, along_[k], across_[k], tau_[k], residual_[k]});
        }
        first += stride * static_cast<std::uint32_t>(count);
      }
    } else {
      // What visit writes could be these, for all that the compiler knows.
      const std::uint16_t* const x = cloud.x.data();
      const std::uint16_t* const y = cloud.y.data();
      const std::uint16_t* const t = cloud.t.data();
      for (std::uint32_t i = first; i < end; i += stride) {
        const float s = along(x[i], y[i]);
        if (!(s >= s0_) || !(s < s1_)) continue;
        const float tau = EventCloud::tau_of(t[i]);
        const float d = across(x[i], y[i]);
        const float r = residual(s, d, tau);
        if (std::fabs(r) <= band_px_) visit(LineEvent{i, s, d, tau, r});
      }
    }
  }

 private:
  /// Places events, at most kEventBlock. @return a bit for each that is near
  std::uint32_t find(const EventCloud& cloud, std::uint32_t first, std::uint32_t stride, std::size_t count) noexcept;

  [[nodiscard]] float along(std::uint16_t x, std::uint16_t y) const noexcept {
    return static_cast<float>(x) * ux_ + static_cast<float>(y) * uy_ - along_origin_;
  }
  [[nodiscard]] float across(std::uint16_t x, std::uint16_t y) const noexcept {
    return static_cast<float>(y) * ux_ - static_cast<float>(x) * uy_ - across_origin_;
  }
  [[nodiscard]] float residual(float s, float d, float tau) const noexcept {
    return d - (offset_ + s * (slope_ + s * bend_) + tau * (motion_ + s * turn_));
  }

  float ux_, uy_, along_origin_, across_origin_;
  float offset_, slope_, motion_, turn_, bend_;  // the line's coefficients, by px along it
  float s0_, s1_, band_px_;
  std::uint16_t x_[kEventBlock] = {}, y_[kEventBlock] = {}, t_[kEventBlock] = {};
  float along_[kEventBlock], across_[kEventBlock], tau_[kEventBlock], residual_[kEventBlock];
};

/// The image area that a line's piece sweeps in the window: a quadrilateral.
class SweptArea {
 public:
  /// The area of the piece [s0, s1], `margin` wider on both sides.
  SweptArea(const MovingLine& line, float s0, float s1, float margin) noexcept {
    float d_low = 1e9F;
    float d_high = -1e9F;
    for (int i = 0; i < 3; ++i) {
      const float s = s0 + 0.5F * static_cast<float>(i) * (s1 - s0);
      const float a = line.offset(s, -1);
      const float b = line.offset(s, 1);
      d_low = std::min(d_low, std::min(a, b));
      d_high = std::max(d_high, std::max(a, b));
    }
    d_low -= margin;
    d_high += margin;
    const float x[4] = {line.x(s0, d_low), line.x(s1, d_low), line.x(s1, d_high), line.x(s0, d_high)};
    const float y[4] = {line.y(s0, d_low), line.y(s1, d_low), line.y(s1, d_high), line.y(s0, d_high)};
    for (int i = 0; i < 4; ++i) {
      const int k = (i + 1) & 3;
      const int upper = y[i] <= y[k] ? i : k;
      const int lower = i + k - upper;
      const float height = y[lower] - y[upper];
      sides_[i] = {x[upper], y[upper], x[lower], y[lower], height > 1e-6F ? (x[lower] - x[upper]) / height : 0.0F};
      top_ = std::min(top_, y[i]);
      bottom_ = std::max(bottom_, y[i]);
    }
  }

  [[nodiscard]] float top() const noexcept { return top_; }        ///< px
  [[nodiscard]] float bottom() const noexcept { return bottom_; }  ///< px

  /// Columns of cells that the area touches in one row of the grid. @return false when it touches none
  [[nodiscard]] bool columns(int row, int num_cols, int* first, int* last) const noexcept {
    const auto top = static_cast<float>(row * kCloudCellPx) - kHalfPixel;
    const float bottom = top + static_cast<float>(kCloudCellPx);
    float low = 1e9F;
    float high = -1e9F;
    for (const Side& side : sides_) {
      if (side.lower_y < top || side.upper_y > bottom) continue;
      const float x1 = side.upper_y < top ? side.upper_x + side.slope * (top - side.upper_y) : side.upper_x;
      const float x2 = side.lower_y > bottom ? side.upper_x + side.slope * (bottom - side.upper_y) : side.lower_x;
      low = std::min(low, std::min(x1, x2));
      high = std::max(high, std::max(x1, x2));
    }
    if (high < low || high < -kHalfPixel) return false;
    *first = std::max(0, static_cast<int>(low + kHalfPixel) >> kCloudCellShift);
    *last = std::min(num_cols - 1, static_cast<int>(high + kHalfPixel) >> kCloudCellShift);
    return *first <= *last;
  }

 private:
  struct Side {
    float upper_x, upper_y, lower_x, lower_y;
    float slope;  // dx / dy; 0 for level sides
  };
  Side sides_[4];
  float top_ = 1e9F;
  float bottom_ = -1e9F;
};

}  // namespace detail

/// Calls visit(const LineEvent&) for the events of the polarities (bit 0: OFF, bit 1: ON) with s in [s0, s1) and
/// |residual| <= band; with a stride above 1, for one in so many of the cloud's events, evenly spread in space and
/// time.
template <class Visit>
void for_each_near_line(const EventCloud& cloud, const MovingLine& line, float s0, float s1, float band_px,
                        unsigned polarities, std::uint32_t stride, Visit visit) {
  constexpr float kPiecePx = 64;  // short enough that turn and bend do not widen the swept area much
  const int pieces = s1 > s0 ? static_cast<int>((s1 - s0) / kPiecePx) + 1 : 0;
  for (int i_piece = 0; i_piece < pieces; ++i_piece) {
    const float piece = s0 + static_cast<float>(i_piece) * kPiecePx;
    const float piece_end = std::min(piece + kPiecePx, s1);
    const detail::SweptArea area(line, piece, piece_end, band_px);
    if (area.bottom() < 0 || area.top() > static_cast<float>(cloud.height)) continue;
    detail::NearBlock block(line, piece, piece_end, band_px);
    const int first_row = std::max(0, static_cast<int>(area.top() + detail::kHalfPixel) >> kCloudCellShift);
    const int last_row =
        std::min(cloud.rows - 1, static_cast<int>(area.bottom() + detail::kHalfPixel) >> kCloudCellShift);
    for (int row = first_row; row <= last_row; ++row) {
      int first_col = 0;
      int last_col = 0;
      if (!area.columns(row, cloud.cols, &first_col, &last_col)) continue;
      for (unsigned polarity = 0; polarity < 2; ++polarity) {
        if ((polarities >> polarity & 1U) == 0) continue;
        const std::uint32_t* const cells =
            &cloud.cell_start[(polarity != 0 ? cloud.cells() : 0) + static_cast<std::size_t>(row) * cloud.cols];
        const std::uint32_t end = cells[last_col + 1];
        std::uint32_t i = cells[first_col];
        if (stride > 1) i = (i + stride - 1) / stride * stride;
        block.look(cloud, i, end, stride, visit);
      }
    }
  }
}

}  // namespace lecalib
