// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_growth.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/chance.hpp"
#include "lecalib/segments/corridor.hpp"
#include "lecalib/segments/event_list.hpp"

namespace lecalib {
namespace {

constexpr int kMaxSteps = 48;  // a step is 16 to 64 px long: more than the longest diagonal needs
constexpr float kMinStepPx = 16;
constexpr float kMaxStepPx = 64;
constexpr float kBinPx = 4;
constexpr int kMaxBins = static_cast<int>(kMaxStepPx / kBinPx);
/// Events per px of line that growth needs; of more, an even share is looked at.
constexpr float kEnoughPerPx = 3;
constexpr int kMaxBridges = 2;       // steps in a row that see other lines' events only
constexpr float kBorderPx = 8;       // beyond the sensor's border nothing is to be found
constexpr float kPriorVariance = 1;  // of the events' distance while the thickness is unknown, px^2

/// How far the line goes on in one step.
struct StepReach {
  float extent_px = 0;
  bool to_the_end = false;  // no gap before the step's end
  bool supported = false;
};

class LineGrower {
 public:
  LineGrower(const EventCloud& cloud, const GrowthOptions& options, const LinePriors& priors,
             const LineWorkspace& workspace, const OwnerFilter& may_take, const SharedStretches& shared,
             const MovingLine& guess)
      : cloud_(cloud),
        options_(options),
        priors_(shared.priors(priors, guess)),
        ws_(workspace),
        may_take_(may_take),
        shared_(shared),
        line_(guess) {}

  bool start() {
    line_.low[0] = line_.low[1] = line_.lowest();
    line_.high[0] = line_.high[1] = line_.highest();
    if (!(length() > 0)) return false;
    if (line_.events == 0) {
      gather(line_.low[0], line_.high[0], line_.polarities, 1);
      line_.events = static_cast<std::uint32_t>(count_);
      count_ = 0;
    }
    stride_ =
        static_cast<std::uint32_t>(std::max(1.0F, static_cast<float>(line_.events) / (kEnoughPerPx * length()) + 0.5F));
    gather(line_.low[0], line_.high[0], line_.polarities, 1);
    if (count_ * stride_ < options_.min_events) return false;
    accept_from(0);
    return refit();
  }

  void grow() {
    for (int step = 0; step < kMaxSteps && (sides_[0].active || sides_[1].active); ++step) {
      for (int side = 0; side < 2; ++side) {
        if (sides_[side].active && !step_out(side)) return;
      }
    }
  }

  [[nodiscard]] MovingLine line() const {
    MovingLine grown = line_;
    grown.events = static_cast<std::uint32_t>(count_) * stride_;
    return grown;
  }

 private:
  struct Side {
    bool active = true;
    float max_step_px = kMaxStepPx;
    int bridges = 0;
  };

  [[nodiscard]] float length() const { return line_.high[0] - line_.low[0]; }
  [[nodiscard]] float density() const { return static_cast<float>(count_) / length(); }

  /// Appends the events in [from, to) that the line may take to the list; counts those of other lines in bins from the
  /// inner end on.
  void gather(float from, float to, unsigned polarities, int side) {
    const EventList list(ws_);
    std::size_t count = count_;
    for_each_near_line(cloud_, line_, from, to, options_.band_px, polarities, stride_, [&](const LineEvent& event) {
      const std::uint8_t owner = list.owner[event.index];
      if (may_take_(owner) || shared_.may_have(line_, owner, event.along_px, event.tau)) {
        // At kEnoughPerPx it is full after 2700 px, or where the line is denser than its beginning. What follows is no
        // support: the line ends there, and its fit lists an even share of all.
        if (count == list.room) return;
        list.put(count++, event);
        return;
      }
      const int bin = static_cast<int>((side == 1 ? event.along_px - from : to - event.along_px) / kBinPx);
      if (bin >= 0 && bin < kMaxBins) ++foreign_[bin];
    });
    count_ = count;
  }

  void accept_from(std::size_t first) {
    if (!shared_.empty()) {
      const EventList list(ws_);
      for_each_clear(shared_, line_, list, first, count_,
                     [&](std::size_t k) { equations_.add(list.along[k], list.tau[k], list.across[k], 1); });
      return;
    }
    equations_.add({ws_.along.data() + first, ws_.across.data() + first, ws_.tau.data() + first, count_ - first});
  }

  bool refit() { return equations_.solve(priors_, kPriorVariance, line_.m, nullptr); }

  /// How far the events from `first` on reach without a gap, in the step [from, to).
  [[nodiscard]] StepReach measure(std::size_t first, float from, float to, int side) const {
    int own[kMaxBins] = {};
    for (std::size_t k = first; k < count_; ++k) {
      const int bin = static_cast<int>((side == 1 ? ws_.along[k] - from : to - ws_.along[k]) / kBinPx);
      if (bin >= 0 && bin < kMaxBins) ++own[bin];
    }
    const float before = static_cast<float>(first) / length();
    const float noise = noise_in(line_.polarities, kBinPx);
    const float need =
        std::max(std::max(options_.min_density * before * kBinPx, 0.6F), options_.min_over_noise * noise);
    const float gap_px = options_.gap_events / std::max(before, 0.05F);
    const int max_gap = static_cast<int>(std::floor(std::clamp(gap_px, kBinPx, options_.max_gap_px) / kBinPx + 0.5F));
    const int bins = std::min(static_cast<int>((to - from) / kBinPx + 0.999F), kMaxBins);

    StepReach reach;
    int last = -1;
    int gap = 0;
    for (int b = 0; b < bins && gap < max_gap; ++b) {
      // Two bins together: a sparse line has holes by chance.
      const int pair = own[b] + own[b + 1 < bins ? b + 1 : b];
      if (own[b] > 0 && static_cast<float>(pair) >= 2 * need) {
        last = b;
        gap = 0;
      } else if (static_cast<float>(own[b] + foreign_[b]) < need) {
        ++gap;
      }
    }
    reach.extent_px = std::min(static_cast<float>(last + 1) * kBinPx, to - from);
    reach.to_the_end = gap < max_gap;
    reach.supported = last >= 0;
    return reach;
  }

  /// Events that the noise floor lets expect on a stretch of the line.
  [[nodiscard]] float noise_in(unsigned polarities, float length_px) const {
    return cloud_.noise_in(polarities) * 2 * options_.band_px * length_px / static_cast<float>(stride_);
  }

  /// Looks whether the line goes on in the polarity that it does not have yet; if so it becomes one of both.
  StepReach try_other_polarity(const StepReach& own, std::size_t first, float from, float to, int side) {
    if (options_.other_polarity_px <= 0 || line_.polarities == 3) return own;
    const std::size_t keep = count_;
    gather(from, to, line_.polarities ^ 3U, side);
    const StepReach both = measure(first, from, to, side);
    const auto gained = static_cast<float>(count_ - keep);
    const float by_chance = noise_in(line_.polarities ^ 3U, to - from);
    if (both.extent_px >= own.extent_px + options_.other_polarity_px &&
        evidence_against_chance(gained, by_chance) > options_.min_other_polarity_evidence) {
      line_.polarities = 3;
      return both;
    }
    count_ = keep;
    return own;
  }

  void drop_beyond(std::size_t first, float extent, float from, float to, int side) {
    const float* const along = ws_.along.data();
    const auto is_beyond = [&](std::size_t k) { return (side == 1 ? along[k] - from : to - along[k]) >= extent; };
    std::size_t kept = first;
    while (kept < count_ && !is_beyond(kept)) ++kept;  // mostly all
    for (std::size_t k = kept; k < count_; ++k) {
      if (is_beyond(k)) continue;
      ws_.along[kept] = ws_.along[k];
      ws_.across[kept] = ws_.across[k];
      ws_.tau[kept++] = ws_.tau[k];
    }
    count_ = kept;
  }

  /// One step at one end. @return false when the fit failed, which ends the growth
  bool step_out(int side) {
    Side& state = sides_[side];
    const float step = std::min(std::max(0.5F * length(), kMinStepPx), state.max_step_px);
    const float from = side == 1 ? line_.high[0] : line_.low[0] - step;
    const float to = from + step;
    const std::size_t first = count_;
    for (int& bin : foreign_) bin = 0;
    gather(from, to, line_.polarities, side);
    StepReach reach = measure(first, from, to, side);
    if (!reach.to_the_end && step <= kMinStepPx) reach = try_other_polarity(reach, first, from, to, side);
    if (reach.to_the_end && !reach.supported) {
      if (!shared_.hold(line_, 0.5F * (from + to), 0)) ++state.bridges;
      reach.to_the_end = state.bridges <= kMaxBridges;
      reach.extent_px = reach.to_the_end ? step : 0;
    }
    drop_beyond(first, reach.extent_px, from, to, side);
    if (reach.extent_px > 0) {
      accept_from(first);
      if (side == 1) line_.high[0] = line_.high[1] = line_.high[0] + reach.extent_px;
      if (side == 0) line_.low[0] = line_.low[1] = line_.low[0] - reach.extent_px;
      if (!refit()) return false;
    }
    update_side(side, step, reach);
    return true;
  }

  void update_side(int side, float step, const StepReach& reach) {
    Side& state = sides_[side];
    if (reach.to_the_end) {
      state.max_step_px = std::min(kMaxStepPx, 2 * state.max_step_px);
    } else if (step > kMinStepPx) {
      state.max_step_px = kMinStepPx;  // a long step may have missed by its extrapolation: once more, with care
    } else if (reach.extent_px < kBinPx) {
      state.active = false;
    }
    const float end = side == 1 ? line_.high[0] : line_.low[0];
    const float x = line_.x(end, line_.offset(end, 0));
    const float y = line_.y(end, line_.offset(end, 0));
    if (x < -kBorderPx || y < -kBorderPx || x > static_cast<float>(cloud_.width) + kBorderPx ||
        y > static_cast<float>(cloud_.height) + kBorderPx) {
      state.active = false;
    }
  }

  const EventCloud& cloud_;
  const GrowthOptions& options_;
  LinePriors priors_;
  const LineWorkspace& ws_;
  const OwnerFilter& may_take_;
  const SharedStretches& shared_;
  MovingLine line_;
  LineEquations equations_;
  std::size_t count_ = 0;     // events in the lists
  std::uint32_t stride_ = 1;  // of the cloud's events, so many are passed over for one that is looked at
  Side sides_[2];
  int foreign_[kMaxBins] = {};
};

}  // namespace

bool grow_line(const EventCloud& cloud, const GrowthOptions& options, const LinePriors& priors,
               const LineWorkspace& workspace, const OwnerFilter& may_take, const SharedStretches& shared,
               MovingLine* line) {
  LineGrower grower(cloud, options, priors, workspace, may_take, shared, *line);
  if (!grower.start()) return false;
  grower.grow();
  *line = grower.line();
  return true;
}

}  // namespace lecalib
