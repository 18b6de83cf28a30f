// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "lecalib/core/span.hpp"
#include "lecalib/segments/corridor.hpp"
#include "lecalib/segments/moving_line.hpp"

namespace lecalib {

/// What counts as a gap of a line: a stretch where nothing fires.
struct GapOptions {
  /// How much rarer than once per line a gap must be by chance, nats, (0, 1000]. Its probability comes from the line's
  /// own share of pixels without events.
  float min_surprise = 5;
  float min_gap_px = 5;  ///< px, 1 to 1e6: shorter gaps are the pixel grid's
};

constexpr bool valid(const GapOptions& o) {
  return o.min_surprise > 0 && o.min_surprise <= 1e3F && o.min_gap_px >= 1 && o.min_gap_px <= 1e6F;
}

/// Gaps move with the object along the line, which the line itself cannot show.
struct GapMotion {
  int least_px = 0;   ///< that a gap must have; 0: there is none
  int motion_px = 0;  ///< along the line, during the window
};

/// A line's pixels in a row, and in which eighths of the window each fired.
class EdgeRow {
 public:
  /// @param memory  of (length in px / 16 + 3) * 8 words, at least 24; what of the line finds no room there counts in
  ///                the last pixel that does
  EdgeRow(const MovingLine& line, Span<std::uint16_t> memory) noexcept;

  /// How far from the line the row's events are, px.
  [[nodiscard]] float band_px() const noexcept { return band_px_; }
  [[nodiscard]] float start_px() const noexcept { return start_px_; }  ///< of the first pixel, along the line
  [[nodiscard]] float end_px() const noexcept { return end_px_; }      ///< of the line
  [[nodiscard]] int size() const noexcept { return size_; }            ///< px

  /// Adds an event; those beyond the band or the line's ends are passed over.
  void add(const LineEvent& event) noexcept {
    const bool is_near =
        std::fabs(event.residual_px) <= band_px_ && event.along_px >= start_px_ && event.along_px < end_px_;
    if (!is_near) return;
    const auto i = static_cast<unsigned>(std::min(static_cast<int>(event.along_px - start_px_), size_ - 1));
    const int slice = std::min(static_cast<int>((event.tau + 1) * (0.5F * kSlices)), kSlices - 1);
    std::uint16_t& word = bits_[static_cast<std::size_t>(slice) * stride_ + 1 + i / kWordPx];
    word = static_cast<std::uint16_t>(word | 1U << i % kWordPx);
  }

  /// Looks for gaps. The motion is tried in steps, and the one with the clearest gap is taken.
  [[nodiscard]] GapMotion find_gaps(const GapOptions& options) const noexcept;

  /// Calls visit(first, end) for the stretches of pixels between gaps, at mid window.
  template <class Visit>
  void for_each_piece(const GapMotion& gaps, Visit visit) const {
    int first = 0;
    for_each_empty_run(kAllSlices, gaps.motion_px, [&](int from, int end) {
      if (end - from < gaps.least_px) return;
      visit(first, from);
      first = end;
    });
    visit(first, size_);
  }

 private:
  static constexpr int kSlices = 8;  // of the window
  static constexpr unsigned kAllSlices = (1U << kSlices) - 1;
  static constexpr unsigned kStillSlices = 3U << (kSlices / 2 - 1);  // the two in the middle
  static constexpr int kWordPx = 16;

  /// Some of the slices, displaced by a motion.
  class Slices {
   public:
    Slices(const EdgeRow& row, unsigned slices, int motion_px) noexcept;
    /// A word's pixels that fired in any of them.
    [[nodiscard]] unsigned fired_pixels(int word) const noexcept {
      unsigned fired = 0;
      for (int i = 0; i < count_; ++i) {
        const std::uint16_t* const at = first_[i] + word;
        fired |= (at[0] | static_cast<unsigned>(at[1]) << kWordPx) >> shift_[i];
      }
      return fired;
    }

   private:
    int count_ = 0;
    const std::uint16_t* first_[kSlices];  // the word of each that the row's first pixel falls into
    unsigned shift_[kSlices];              // by so many bits
  };

  /// Calls visit(first, end) for the runs of pixels without events, as the motion lets them appear at mid window.
  template <class Visit>
  void for_each_empty_run(unsigned slices, int motion_px, Visit visit) const {
    const Slices moved(*this, slices, motion_px);
    int first = -1;  // of the run at hand, if any
    for (int start = 0; start < size_; start += kWordPx) {
      const int pixels = std::min(size_ - start, kWordPx);
      const unsigned empty = ~moved.fired_pixels(start / kWordPx) & ((1U << pixels) - 1);
      for (int at = 0; at < pixels;) {
        if ((empty >> at & 1U) != 0) {
          if (first < 0) first = start + at;
          at += lowest_set_bit(~(empty >> at));
          continue;
        }
        if (first >= 0) visit(first, start + at);
        first = -1;
        if (empty >> at == 0) break;
        at += lowest_set_bit(empty >> at);
      }
    }
    if (first >= 0) visit(first, size_);
  }

  /// @param bits  above 0
  static int lowest_set_bit(unsigned bits) noexcept { return __builtin_ctz(bits); }

  struct Gaps {
    int least = 0;    // px that a gap must have
    int longest = 0;  // px
    float surprise = 0;
  };
  [[nodiscard]] Gaps measure(const GapOptions& options, int motion_px) const noexcept;
  [[nodiscard]] int longest_still_run() const noexcept;

  float start_px_;
  float end_px_;
  float band_px_;
  int size_;
  std::size_t stride_;        // words of a slice, an empty one before the line and one behind it
  Span<std::uint16_t> bits_;  // [kSlices * stride_] a bit for each pixel that fired in the slice
};

}  // namespace lecalib
