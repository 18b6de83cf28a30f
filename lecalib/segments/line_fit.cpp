// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_fit.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/chance.hpp"
#include "lecalib/segments/corridor.hpp"
#include "lecalib/segments/event_list.hpp"
#include "lecalib/segments/event_weight.hpp"
#include "lecalib/segments/line_kink.hpp"

namespace lecalib {
namespace {

constexpr float kWideBandPx = 5;  // events that the robust fit chooses from
constexpr int kFitRounds = 3;
constexpr std::size_t kNearingEvents = 400;   // that a round takes at most, but the last
constexpr std::uint32_t kSampleEvents = 200;  // of a line that are fitted before the others ...
constexpr std::uint32_t kSamplesWorth = 2;    // ... where there are so many times as many
constexpr float kSampleTolerance = 1.15F;     // of the limit of thickness: a sample scatters

constexpr int kMaxParts = 3;  // a line is cut at a kink that often, less one

constexpr float kInlierSigmas = 2.5F;
constexpr float kMinInlierPx = 1;
constexpr float kFlankMarginPx = 0.5F;

constexpr int kMaxPatchCount = 65535;
constexpr float kEndDensity = 0.35F;  // of the mean: less is beyond the line's end
constexpr float kEventsPerPatch = 8;  // in the test of evenness
constexpr int kMinPatches = 3;
constexpr float kMaxEndMotion = 0.25F;  // of the length, during the window
constexpr float kMinEndMotionPx = 6;    // less is within the extents' own error

static_assert(kMaxListedEvents <= 65535, "they may all fall into one bin of the histogram");

/// Rows of the histogram per unit of tau, whose range is 2.
constexpr float kRowsPerTau = 0.5F * static_cast<float>(kHistogramRows);

/// The nearest integer.
int nearest(float value) { return static_cast<int>(std::floor(value + 0.5F)); }

class LineFitter {
 public:
  LineFitter(const EventCloud& cloud, const LineFitOptions& options, const LineWorkspace& workspace,
             const FitClaim& claim, const MovingLine& line)
      : cloud_(cloud), options_(options), ws_(workspace), claim_(claim), line_(line) {}

  /// @param[out] kink_px  where the line turns off, written when the outcome is kinked
  FitOutcome fit(float* kink_px) {
    recentre(&line_);
    if (line_.events >= kSamplesWorth * kSampleEvents && is_texture()) return FitOutcome::too_thick;
    collect(options_.max_fit_events);
    if (count_ * stride_ < options_.min_events) return FitOutcome::too_few_events;
    FitOutcome outcome = fit_robustly();
    if (outcome == FitOutcome::accepted && line_.thickness_px > options_.max_thickness_px)
      outcome = FitOutcome::too_thick;
    if (outcome == FitOutcome::accepted) outcome = judge_events(kink_px);
    if (outcome == FitOutcome::accepted) outcome = find_extents();
    if (outcome == FitOutcome::accepted && !is_certain()) outcome = FitOutcome::uncertain;
    if (outcome == FitOutcome::accepted) mark_events();
    return outcome;
  }

  [[nodiscard]] const MovingLine& line() const { return line_; }

 private:
  /// Whether a fit to a few of the line's events already is too thick: that tells most texture from edges at a fraction
  /// of the cost.
  bool is_texture() {
    const MovingLine estimate = line_;
    collect(kSampleEvents);
    const bool is_thick =
        fit_robustly() == FitOutcome::accepted && line_.thickness_px > kSampleTolerance * options_.max_thickness_px;
    line_ = estimate;
    return is_thick;
  }

  /// Lists the events near to the line; of more than are wanted, an even share.
  void collect(std::uint32_t wanted) {
    stride_ = std::max<std::uint32_t>(1, line_.events / std::max<std::uint32_t>(1, wanted));
    const ListedArea area{line_.lowest() - kBeyondEndsPx, line_.highest() + kBeyondEndsPx, kWideBandPx};
    const std::uint8_t* const owner = ws_.owner.data();
    const OwnerFilter is_free = claim_.may_take;
    count_ = list_near_line(cloud_, line_, area, ws_, &stride_, [&](const LineEvent& event) {
      return is_free(owner[event.index]) || may_share(owner[event.index], event);
    });
    set_shared_aside();
  }

  [[nodiscard]] bool may_share(std::uint8_t owner, const LineEvent& event) const {
    return claim_.shared.may_have(line_, owner, event.along_px, event.tau);
  }

  /// Puts events where it is unknown whose they are at the list's end: they support the line but don't shape it.
  void set_shared_aside() {
    clear_ = count_;
    if (claim_.shared.empty()) return;
    const EventList list(ws_);
    std::size_t clear = 0;
    for_each_clear(claim_.shared, line_, list, 0, count_, [&](std::size_t k) {
      std::swap(list.along[k], list.along[clear]);
      std::swap(list.across[k], list.across[clear]);
      std::swap(list.tau[k], list.tau[clear++]);
    });
    clear_ = clear;
  }

  [[nodiscard]] float residual(std::size_t k) const { return ws_.across[k] - line_.offset(ws_.along[k], ws_.tau[k]); }
  [[nodiscard]] float band() const { return weight_band(line_.thickness_px); }

  FitOutcome fit_robustly() {
    for (int round = 0; round < kFitRounds; ++round) {
      const float band_px = band();
      // The last round counts; those before only bring the line near.
      const bool is_last = round + 1 == kFitRounds;
      const std::size_t step = is_last ? 1 : 1 + clear_ / kNearingEvents;
      LineEquations equations;
      const WeightedSupport support = equations.add_near(
          {ws_.along.data(), ws_.across.data(), ws_.tau.data(), (clear_ + step - 1) / step, step}, line_, band_px);
      if (support.events * step * stride_ < options_.min_events / 2) return FitOutcome::too_few_events;
      const float variance = support.square / (support.weight * kWeightedVariance) * (band_px * band_px);
      line_.thickness_px = std::sqrt(variance);
      if (!equations.solve(claim_.shared.priors(options_.priors, line_), 1, line_.m,
                           is_last ? line_.covariance : nullptr))
        return FitOutcome::no_solution;
      if (!is_last) continue;
      for (float& entry : line_.covariance) entry *= variance * kVarianceInflation;
    }
    return FitOutcome::accepted;
  }

  /// What the line's events amount to.
  struct Support {
    float inlier_px;  // events as near as this are on the line
    std::uint32_t flank = 0;
    std::uint32_t on_line[kHistogramRows] = {};
  };

  /// Looks at the events once more: whether the line turns off, and whether they are enough.
  FitOutcome judge_events(float* kink_px) {
    KinkFinder finder(line_.lowest(), line_.highest());
    Support support{std::max(kMinInlierPx, kInlierSigmas * line_.thickness_px)};
    clear_histogram();
    const std::size_t shaping = finder.can_tell() ? clear_ : 0;
    const float per_band = 1 / band();
    for (std::size_t k = 0; k < count_; ++k) {
      const float r = residual(k);
      const float weight = 1 - r * r * per_band * per_band;
      if (k < shaping && weight > 0) finder.add(ws_.along[k], r, weight);
      count_event(ws_.along[k], ws_.tau[k], std::fabs(r), &support);
    }
    if (finder.find(options_.kink, line_.thickness_px * line_.thickness_px, kink_px)) return FitOutcome::kinked;
    return judge_support(support);
  }

  void clear_histogram() {
    histogram_start_ = line_.lowest() - kHistogramBinPx;
    const float span = line_.highest() + kHistogramBinPx - histogram_start_;
    num_bins_ =
        std::min(static_cast<int>(span / kHistogramBinPx) + 1, static_cast<int>(ws_.histogram.size() / kHistogramRows));
    std::fill_n(ws_.histogram.begin(), kHistogramRows * static_cast<std::size_t>(num_bins_), std::uint16_t{0});
  }

  void count_event(float along_px, float tau, float distance_px, Support* support) const {
    if (distance_px > support->inlier_px) {
      support->flank += distance_px < 2 * support->inlier_px + kFlankMarginPx ? 1U : 0U;
      return;
    }
    const int bin = static_cast<int>((along_px - histogram_start_) / kHistogramBinPx);
    if (along_px < histogram_start_ || bin >= num_bins_) return;
    const int row = std::min(static_cast<int>((tau + 1) * kRowsPerTau), static_cast<int>(kHistogramRows) - 1);
    ++count_at(row, bin);
    ++support->on_line[row];
  }

  /// Holds the events on the line against those beside it.
  FitOutcome judge_support(const Support& support) {
    const std::uint32_t* const on_line = support.on_line;
    const float inlier = support.inlier_px;
    const std::uint32_t early = on_line[0] + on_line[1];
    const std::uint32_t late = on_line[2] + on_line[3];
    line_.events = (early + late) * stride_;
    if (line_.events < options_.min_events) return FitOutcome::too_few_events;
    const auto events = static_cast<float>(early + late);
    const float beside = static_cast<float>(support.flank) * inlier / (inlier + kFlankMarginPx);
    if (events < options_.min_contrast * beside) return FitOutcome::low_contrast;
    const float noise = cloud_.noise_in(line_.polarities) * 2 * inlier * line_.length() / static_cast<float>(stride_);
    if (evidence_against_chance(events, std::max(noise, beside)) <
        required_evidence(options_, cloud_.width, cloud_.height))
      return FitOutcome::noise;
    if (static_cast<float>(std::min(early, late)) < options_.min_half_share * events) return FitOutcome::one_sided;
    return FitOutcome::accepted;
  }

  [[nodiscard]] std::uint16_t& count_at(int row, int bin) const {
    return ws_.histogram[static_cast<std::size_t>(row * num_bins_ + bin)];
  }
  /// Events in a bin, in one half of the window.
  [[nodiscard]] int half_count(int half, int bin) const {
    return count_at(2 * half, bin) + count_at(2 * half + 1, bin);
  }
  [[nodiscard]] int half_sum(int half, int first, int bins) const {
    int sum = 0;
    for (int b = std::max(0, first); b < std::min(num_bins_, first + bins); ++b) sum += half_count(half, b);
    return sum;
  }

  /// First and last bin of the line's support in one half of the window. @return false without support
  bool support_range(int half, int* first, int* last) const {
    int filled = 0;
    for (int b = 0; b < num_bins_; ++b) filled += half_count(half, b) > 0 ? 1 : 0;
    if (filled == 0) return false;
    const float mean = static_cast<float>(half_sum(half, 0, num_bins_)) / static_cast<float>(filled);
    const int run = std::clamp(nearest(3 / mean), 1, 8);  // bins that hold three events on average
    const float need = std::max(kEndDensity * mean * static_cast<float>(run), 1.0F);
    const auto supported = [&](int near, int far) {
      return static_cast<float>(half_sum(half, near, run)) >= need &&
             static_cast<float>(half_sum(half, far, run)) >= need;
    };
    *first = 0;
    while (*first < num_bins_ && !(half_count(half, *first) > 0 && supported(*first, *first + run))) ++*first;
    *last = num_bins_ - 1;
    while (*last >= 0 && !(half_count(half, *last) > 0 && supported(*last - run + 1, *last - 2 * run + 1))) --*last;
    return *last > *first + 1;
  }

  FitOutcome find_extents() {
    float low[2] = {};
    float high[2] = {};
    bool seen[2] = {};
    for (int half = 0; half < 2; ++half) {
      int first = 0;
      int last = 0;
      seen[half] = support_range(half, &first, &last);
      low[half] = histogram_start_ + kHistogramBinPx * static_cast<float>(first);
      high[half] = histogram_start_ + kHistogramBinPx * static_cast<float>(last + 1);
    }
    if (!seen[0] && !seen[1]) return FitOutcome::uneven;
    for (int half = 0; half < 2; ++half) {
      if (seen[half]) continue;
      low[half] = low[1 - half];
      high[half] = high[1 - half];
    }
    if (!is_even(std::min(low[0], low[1]), std::max(high[0], high[1]))) return FitOutcome::uneven;
    // The halves' extents are those at a quarter and three quarters of the window; their motion goes on to its ends.
    const float limit = kMaxEndMotion * std::max(high[0] - low[0], high[1] - low[1]);
    extrapolate(low[0], low[1], limit, line_.low);
    extrapolate(high[0], high[1], limit, line_.high);
    const float longest = std::max(line_.high[0] - line_.low[0], line_.high[1] - line_.low[1]);
    const bool is_long = longest >= min_line_length(options_, cloud_.width, cloud_.height);
    return is_long ? FitOutcome::accepted : FitOutcome::too_short;
  }

  static void extrapolate(float early, float late, float limit, float* ends) {
    float motion = std::clamp(late - early, -limit, limit);
    if (std::fabs(motion) < kMinEndMotionPx) motion = 0;
    const float middle = 0.5F * (early + late);
    ends[0] = middle - motion;
    ends[1] = middle + motion;
  }

  /// Whether the bin lies where the line's events may be others'.
  [[nodiscard]] bool is_shared(int bin) const {
    const float s = histogram_start_ + kHistogramBinPx * (static_cast<float>(bin) + 0.5F);
    return claim_.shared.hold(line_, s, 0);
  }

  /// Whether equal patches along the line hold about equally many events.
  bool is_even(float low, float high) {
    const int first = std::max(0, static_cast<int>((low - histogram_start_) / kHistogramBinPx));
    const int end = std::min(num_bins_, static_cast<int>((high - histogram_start_) / kHistogramBinPx));
    if (end - first < 2 * kMinPatches) return false;
    int total = 0;
    int bins = 0;
    for (int b = first; b < end; ++b) {
      if (is_shared(b)) continue;
      total += half_count(0, b) + half_count(1, b);
      ++bins;
    }
    if (bins == 0) return false;
    const float per_bin = static_cast<float>(total) / static_cast<float>(bins);
    const int width = std::max(2, std::min(nearest(kEventsPerPatch / std::max(per_bin, 0.1F)), (end - first) / 5));
    int patches = 0;
    int empty = 0;
    for (int b = first; b + width <= end; b += width) {
      if (is_shared(b + width / 2)) continue;
      const int n = half_sum(0, b, width) + half_sum(1, b, width);
      ws_.patches[static_cast<std::size_t>(patches++)] = static_cast<std::uint16_t>(std::min(n, kMaxPatchCount));
      empty += n == 0 ? 1 : 0;
    }
    if (patches < kMinPatches) return false;
    std::uint16_t* median = ws_.patches.begin() + patches / 2;
    std::nth_element(ws_.patches.begin(), median, ws_.patches.begin() + patches);
    const float mean = per_bin * static_cast<float>(width);
    const float max_empty = 1 - (1 - options_.max_empty_share) * claim_.tolerance;
    return static_cast<float>(*median) >= options_.min_evenness * claim_.tolerance * mean &&
           static_cast<float>(empty) <= max_empty * static_cast<float>(patches);
  }

  [[nodiscard]] bool is_certain() const {
    const float limit = options_.max_end_sigma_px * options_.max_end_sigma_px;
    for (int end = 0; end < 2; ++end) {
      const float tau = end == 0 ? -1.0F : 1.0F;
      if (offset_variance(line_, line_.low[end], tau) > limit || offset_variance(line_, line_.high[end], tau) > limit) {
        return false;
      }
    }
    return true;
  }

  /// Takes the line's events and looks for gaps among all that lie on it.
  void mark_events() {
    line_.id = claim_.id;
    EdgeRow row(line_, ws_.histogram);
    const float claimed = claimed_band(line_.thickness_px);  // wider than the row's
    // The same row by values that no owner's mark could change, for all that the compiler knows.
    EdgeRow pixels = row;
    std::uint8_t* const owner = ws_.owner.data();
    const std::uint8_t id = claim_.id;
    const OwnerFilter is_free = claim_.may_take;
    for_each_near_line(cloud_, line_, line_.lowest() - kBeyondEndsPx, line_.highest() + kBeyondEndsPx, claimed,
                       line_.polarities, 1, [&](const LineEvent& event) {
                         pixels.add(event);
                         std::uint8_t& mark = owner[event.index];
                         if (is_free(mark) || may_share(mark, event)) mark = id;
                       });
    line_.has_gap = row.find_gaps(options_.gaps).least_px > 0;
  }

  const EventCloud& cloud_;
  const LineFitOptions& options_;
  const LineWorkspace& ws_;
  const FitClaim& claim_;
  MovingLine line_;
  std::size_t count_ = 0;     // events in the lists
  std::size_t clear_ = 0;     // of these, first in the lists, those that are surely not another line's
  std::uint32_t stride_ = 1;  // of the cloud's events, so many are passed over for one that is looked at
  float histogram_start_ = 0;
  int num_bins_ = 0;
};

void keep_longer_part(float cut_px, MovingLine* line) {
  const bool keep_low = cut_px - line->lowest() > line->highest() - cut_px;
  for (int end = 0; end < 2; ++end) {
    if (keep_low) {
      line->high[end] = cut_px;
    } else {
      line->low[end] = cut_px;
    }
  }
}

}  // namespace

FitOutcome fit_line(const EventCloud& cloud, const LineFitOptions& options, const LineWorkspace& workspace,
                    const FitClaim& claim, MovingLine* line) {
  MovingLine part = *line;
  FitOutcome outcome = FitOutcome::kinked;
  for (int i = 0; i < kMaxParts && outcome == FitOutcome::kinked; ++i) {
    LineFitter fitter(cloud, options, workspace, claim, part);
    float kink_px = 0;
    outcome = fitter.fit(&kink_px);
    part = fitter.line();
    if (outcome == FitOutcome::kinked) keep_longer_part(kink_px, &part);
  }
  if (outcome == FitOutcome::accepted) *line = part;
  return outcome;
}

float required_evidence(const LineFitOptions& options, std::uint16_t width, std::uint16_t height) {
  constexpr float kAcrossPx = 2;
  constexpr float kAlongPx = 8;
  constexpr float kMotions = 20 / kAcrossPx;
  const float ends = static_cast<float>(width) * static_cast<float>(height) * kMotions / (kAcrossPx * kAlongPx);
  // Two ends; which is which does not matter.
  return options.min_evidence + 2 * natural_log(std::max(ends, 2.0F)) - natural_log(2);
}

float min_line_length(const LineFitOptions& options, std::uint16_t width, std::uint16_t height) {
  if (options.min_length_px > 0) return options.min_length_px;
  const auto w = static_cast<float>(width);
  const auto h = static_cast<float>(height);
  return std::clamp(0.03F * std::sqrt(w * w + h * h), 12.0F, 30.0F);
}

}  // namespace lecalib
