// SPDX-License-Identifier: MIT
#include "lecalib/segments/edge_row.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/chance.hpp"

namespace lecalib {
namespace {

constexpr int kMotionStepPx = 2;
constexpr int kMaxMotionPx = 12;
constexpr int kLeastMotionPx = 4;  // less moves no slice by a pixel
constexpr int kNumMotions = 2 * ((kMaxMotionPx - kLeastMotionPx) / kMotionStepPx + 1) + 1;
constexpr int kLongRunPx = 4;  // longer runs of empty pixels are what is asked for: they do not count as usual
constexpr float kRowSigmas = 2.5F;
constexpr float kMinRowBandPx = 1.2F;

}  // namespace

EdgeRow::EdgeRow(const MovingLine& line, Span<std::uint16_t> memory) noexcept
    : start_px_(line.lowest()),
      end_px_(line.highest()),
      band_px_(std::max(kMinRowBandPx, kRowSigmas * line.thickness_px)) {
  const std::size_t room = memory.size() / kSlices;
  const int most = room > 2 ? static_cast<int>(room - 2) * kWordPx : 0;
  size_ = std::min(static_cast<int>(end_px_ - start_px_) + 1, most);
  stride_ = static_cast<std::size_t>((size_ + kWordPx - 1) / kWordPx) + 2;
  bits_ = memory.first(std::min(kSlices * stride_, memory.size()));
  std::fill(bits_.begin(), bits_.end(), std::uint16_t{0});
}

GapMotion EdgeRow::find_gaps(const GapOptions& options) const noexcept {
  GapMotion found;
  if (static_cast<float>(longest_still_run()) < options.min_gap_px) return found;
  float best = 0;
  for (int motion = -kMaxMotionPx; motion <= kMaxMotionPx; motion += kMotionStepPx) {
    if (motion != 0 && motion > -kLeastMotionPx && motion < kLeastMotionPx) continue;
    const Gaps gaps = measure(options, motion);
    if (gaps.longest < gaps.least || gaps.surprise <= best) continue;
    best = gaps.surprise;
    found = {gaps.least, motion};
  }
  return found;
}

EdgeRow::Slices::Slices(const EdgeRow& row, unsigned slices, int motion_px) noexcept {
  static_assert(kMaxMotionPx < kWordPx, "no slice moves further than into the next word");
  for (int slice = 0; slice < kSlices; ++slice) {
    if ((slices >> static_cast<unsigned>(slice) & 1U) == 0) continue;
    const int px = kWordPx + motion_px * (2 * slice + 1 - kSlices) / (2 * kSlices);
    first_[count_] = row.bits_.data() + static_cast<std::size_t>(slice) * row.stride_ + px / kWordPx;
    shift_[count_++] = static_cast<unsigned>(px % kWordPx);
  }
}

/// Longest run of pixels that are empty in the window's middle, where no motion moves them: no gap is longer.
int EdgeRow::longest_still_run() const noexcept {
  static_assert(kMaxMotionPx < 2 * kSlices, "the slices in the middle are not moved");
  int longest = 0;
  for_each_empty_run(kStillSlices, 0, [&](int first, int end) { longest = std::max(longest, end - first); });
  return longest;
}

EdgeRow::Gaps EdgeRow::measure(const GapOptions& options, int motion_px) const noexcept {
  Gaps gaps;
  int usual = 0;
  for_each_empty_run(kAllSlices, motion_px, [&](int first, int end) {
    if (first == 0 || end == size_) return;  // beyond the line's end
    usual += std::min(end - first, kLongRunPx);
    gaps.longest = std::max(gaps.longest, end - first);
  });
  const float share = (static_cast<float>(usual) + 1) / static_cast<float>(size_ + 2);
  const float nats_per_px = -natural_log(share);
  const float tries = natural_log(static_cast<float>(size_ * kNumMotions));
  const float least = (tries + options.min_surprise) / nats_per_px;
  gaps.least = static_cast<int>(std::ceil(std::max(least, options.min_gap_px)));
  gaps.surprise = static_cast<float>(gaps.longest) * nats_per_px;
  return gaps;
}

}  // namespace lecalib
