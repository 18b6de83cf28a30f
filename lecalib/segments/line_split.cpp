// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_split.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/chance.hpp"
#include "lecalib/segments/corridor.hpp"

namespace lecalib {
namespace {

constexpr int kSlices = 8;  // of the window: one bit each
constexpr unsigned kCountOne = 1U << kSlices;
constexpr unsigned kMaxSliceCount = 255;
constexpr int kMotionStepPx = 2;  // along the line, during the window
constexpr int kMaxMotionPx = 12;
constexpr int kLeastMotionPx = 4;  // less moves no slice by a pixel
constexpr int kNumMotions = 2 * ((kMaxMotionPx - kLeastMotionPx) / kMotionStepPx + 1) + 1;
constexpr int kLongRunPx = 4;  // longer runs of empty pixels are what is asked for: they do not count as usual
constexpr float kBandSigmas = 2.5F;
constexpr float kMinBandPx = 1.2F;

/// How events of a window's slices are displaced by a motion along the line: the slices in groups displaced alike.
class SliceShifts {
 public:
  explicit SliceShifts(int motion) {
    for (int slice = 0; slice < kSlices; ++slice) {
      const int px = motion * (2 * slice + 1 - kSlices) / (2 * kSlices);
      if (count_ == 0 || groups_[count_ - 1].px != px) groups_[count_++] = {px, 0};
      groups_[count_ - 1].slices |= 1U << static_cast<unsigned>(slice);
    }
  }

  /// Whether a pixel of the row fired in any slice, seen from mid window.
  [[nodiscard]] bool fired(Span<const std::uint16_t> row, int pixel) const {
    for (int g = 0; g < count_; ++g) {
      const auto i = static_cast<std::size_t>(pixel + groups_[g].px);  // before the row: beyond its end as well
      if (i < row.size() && (row[i] & groups_[g].slices) != 0) return true;
    }
    return false;
  }

 private:
  struct Group {
    int px;
    unsigned slices;
  };
  Group groups_[kSlices];
  int count_ = 0;
};

/// A line's pixels in a row: which of them fired, when, and how often.
class EdgeRow {
 public:
  EdgeRow(const EventCloud& cloud, const SplitOptions& options, const LineFitOptions& fit_options,
          const LineWorkspace& workspace, const MovingLine& line)
      : options_(options),
        line_(line),
        start_(line.lowest()),
        size_(std::min(static_cast<int>(line.highest() - start_) + 1, static_cast<int>(workspace.histogram.size()))),
        band_(std::max(kMinBandPx, kBandSigmas * line.thickness_px)),
        min_length_(min_line_length(fit_options, cloud.width, cloud.height)),
        min_evidence_(required_evidence(fit_options, cloud.width, cloud.height)),
        noise_per_px_(2 * band_ * cloud.noise_in(line.polarities)),
        pixels_(workspace.histogram.data()) {
    collect(cloud);
  }

  /// Looks for gaps. @return whether there is one
  bool find_motion() {
    if (static_cast<float>(longest_still_run()) < options_.min_gap_px) return false;
    float best = 0;
    for (int motion = -kMaxMotionPx; motion <= kMaxMotionPx; motion += kMotionStepPx) {
      if (motion != 0 && motion > -kLeastMotionPx && motion < kLeastMotionPx) continue;
      const Gaps gaps = measure(motion);
      if (gaps.longest < gaps.least || gaps.surprise <= best) continue;
      best = gaps.surprise;
      motion_ = motion;
      gap_ = gaps.least;
    }
    return best > 0;
  }

  /// Writes the pieces. @return how many; none when no piece is a line of its own
  std::size_t cut(Span<MovingLine> out) const {
    const SliceShifts shifts(motion_);
    std::size_t count = 0;
    int first = 0;
    int empty = 0;
    for (int b = 0; b <= size_; ++b) {
      if (b < size_ && !shifts.fired(row(), b)) {
        ++empty;
        continue;
      }
      if (empty >= gap_) {
        count += write_piece(first, b - empty, out.subspan(count));
        first = b;
      }
      empty = 0;
    }
    return count + write_piece(first, size_, out.subspan(count));
  }

 private:
  struct Gaps {
    int least = 0;    // px that a gap must have
    int longest = 0;  // px
    float surprise = 0;
  };

  void collect(const EventCloud& cloud) {
    std::fill(pixels_, pixels_ + size_, std::uint16_t{0});
    for_each_near_line(cloud, line_, start_, line_.highest(), band_, line_.polarities, 1, [&](const LineEvent& event) {
      const int b = std::min(static_cast<int>(event.along_px - start_), size_ - 1);
      const int slice = std::clamp(static_cast<int>((event.tau + 1) * (0.5F * kSlices)), 0, kSlices - 1);
      unsigned pixel = pixels_[b] | 1U << static_cast<unsigned>(slice);
      if (pixel >> kSlices < kMaxSliceCount) pixel += kCountOne;
      pixels_[b] = static_cast<std::uint16_t>(pixel);
    });
  }

  [[nodiscard]] Span<const std::uint16_t> row() const { return {pixels_, static_cast<std::size_t>(size_)}; }

  /// Longest run of pixels that are empty in the window's middle, where no motion moves them: no gap is longer.
  [[nodiscard]] int longest_still_run() const {
    constexpr unsigned kStill = 3U << (kSlices / 2 - 1);
    static_assert(kMaxMotionPx < 2 * kSlices, "the two middle slices are not moved");
    int longest = 0;
    int empty = 0;
    for (int b = 0; b < size_; ++b) {
      empty = (pixels_[b] & kStill) != 0 ? 0 : empty + 1;
      longest = std::max(longest, empty);
    }
    return longest;
  }

  [[nodiscard]] Gaps measure(int motion) const {
    const SliceShifts shifts(motion);
    Gaps gaps;
    int usual = 0;
    int empty = 0;
    bool inside = false;  // ends of the line are no gaps
    for (int b = 0; b < size_; ++b) {
      if (!shifts.fired(row(), b)) {
        ++empty;
        continue;
      }
      if (inside) {
        usual += std::min(empty, kLongRunPx);
        gaps.longest = std::max(gaps.longest, empty);
      }
      inside = true;
      empty = 0;
    }
    const float share = (static_cast<float>(usual) + 1) / static_cast<float>(size_ + 2);
    const float nats_per_px = -natural_log(share);
    const float tries = natural_log(static_cast<float>(size_ * kNumMotions));
    const float least = (tries + options_.min_surprise) / nats_per_px;
    gaps.least = static_cast<int>(std::ceil(std::max(least, options_.min_gap_px)));
    gaps.surprise = static_cast<float>(gaps.longest) * nats_per_px;
    return gaps;
  }

  /// The piece of pixels [first, end) at mid window.
  std::size_t write_piece(int first, int end, Span<MovingLine> out) const {
    if (out.empty() || static_cast<float>(end - first) < min_length_) return 0;
    std::uint32_t events = 0;
    for (int b = first; b < end; ++b) events += pixels_[b] >> kSlices;
    const auto length = static_cast<float>(end - first);
    if (evidence_against_chance(static_cast<float>(events), noise_per_px_ * length) < min_evidence_) return 0;
    MovingLine piece = line_;
    const float half_motion = 0.5F * static_cast<float>(motion_);
    for (int k = 0; k < 2; ++k) {
      const float moved = k == 0 ? -half_motion : half_motion;
      if (first > 0) piece.low[k] = start_ + static_cast<float>(first) + moved;
      if (end < size_) piece.high[k] = start_ + static_cast<float>(end) + moved;
    }
    piece.events = events;
    out[0] = piece;
    return 1;
  }

  const SplitOptions& options_;
  const MovingLine line_;
  float start_;
  int size_;
  float band_;
  float min_length_;
  float min_evidence_;
  float noise_per_px_;
  std::uint16_t* pixels_;  // [size_] a bit for each slice in which the pixel fired, and above them how often it did
  int motion_ = 0;
  int gap_ = 0;
};

}  // namespace

std::size_t split_lines(const EventCloud& cloud, const SplitOptions& options, const LineFitOptions& fit_options,
                        const LineWorkspace& workspace, Span<MovingLine> lines, std::size_t* count) {
  std::size_t cuts = 0;
  const std::size_t original = *count;
  for (std::size_t i = 0; i < original; ++i) {
    EdgeRow row(cloud, options, fit_options, workspace, lines[i]);
    if (!row.find_motion()) continue;
    const std::size_t pieces = row.cut(lines.subspan(*count));
    if (pieces == 0) continue;
    lines[i] = lines[*count + pieces - 1];
    *count += pieces - 1;
    cuts += pieces - 1;
  }
  return cuts;
}

}  // namespace lecalib
