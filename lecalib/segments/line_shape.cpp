// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_shape.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/segments/event_list.hpp"
#include "lecalib/segments/event_weight.hpp"
#include "lecalib/segments/shape_cells.hpp"

namespace lecalib {
namespace {

constexpr float kColumnPx = 12;
constexpr int kMinColumns = 4;
constexpr float kMinHalfLengthPx = 8;
constexpr std::size_t kFirstRoundEvents = 500;  // it only brings the shape near

constexpr float kShapeMarginPx = 2;  // by which the shape may stray from the fitted line

/// The line as a shape: what it has of the terms.
LineShape shape_of(const MovingLine& line) {
  LineShape out;
  out.middle_px = 0.5F * (line.lowest() + line.highest());
  out.half_px = std::max(0.5F * (line.highest() - line.lowest()), kMinHalfLengthPx);
  const float scale = out.half_px * kAlongUnit;
  const float s = out.middle_px * kAlongUnit;
  out.terms[0] = line.m[0] + s * (line.m[1] + s * line.m[4]);
  out.terms[1] = (line.m[1] + 2 * s * line.m[4]) * scale;
  out.terms[2] = line.m[2] + s * line.m[3];
  out.terms[3] = line.m[3] * scale;
  out.terms[4] = line.m[4] * scale * scale;
  return out;
}

class ShapeFitter {
 public:
  ShapeFitter(const EventCloud& cloud, const LineShapeOptions& options, const LinePriors& priors,
              const LineWorkspace& workspace, const MovingLine& line, const SharedStretches& shared)
      : cloud_(cloud),
        options_(options),
        priors_(priors),
        ws_(workspace),
        line_(line),
        shared_(shared),
        shape_(shape_of(line)),
        cells_(shape_columns(shape_)),
        variance_(line.thickness_px * line.thickness_px),
        equations_(variance_) {}

  void fit() {
    list_events();
    for (int round = 0; round < 2; ++round) {
      if (round > 0) cells_.clear();
      sum_cells(round == 0 ? 1 + listed_ / kFirstRoundEvents : 1);
      if (!(weight_ > 0)) return;
      if (round > 0) misfit2_ = cells_.misfit2(variance_);
      ShapeEquations equations;
      cells_.add_to(&equations, variance_, misfit2_);
      add_shape_priors(options_, priors_, shape_, &equations);
      if (!equations.solve(change_)) return;
      for (int i = 0; i < kNumShapeTerms; ++i) shape_.terms[i] += change_[i];
      equations_ = equations;
    }
  }

  [[nodiscard]] const LineShape& shape() const { return shape_; }

  [[nodiscard]] EventLine record() const {
    EventLine out{};
    out.begin = segment(0);
    out.end = segment(1);
    const float low = 0.5F * (line_.low[0] + line_.low[1]);
    const float high = 0.5F * (line_.high[0] + line_.high[1]);
    const float quarter = bow(low, high, 0.25F, 0);
    const float three_quarters = bow(low, high, 0.75F, 0);
    out.bend_px = bow(low, high, 0.5F, 0);
    const float unshaped_px = options_.unshaped_bend_share * out.bend_px;
    const float common = systematic_variance() + unshaped_px * unshaped_px;
    out.sigma_begin_px = std::sqrt(end_variance(0) + common);
    out.sigma_end_px = std::sqrt(end_variance(1) + common);
    out.bend_change_px = bow(low, high, 0.5F, 1) - bow(low, high, 0.5F, -1);
    out.skew_px = (three_quarters - quarter) / 0.75F;
    out.peak_px = 4 * ((quarter + three_quarters) / 1.5F - out.bend_px);
    out.events = line_.events;
    constexpr std::int8_t kPolarities[4] = {0, -1, 1, 0};  // by the bits of MovingLine::polarities
    out.polarity = kPolarities[line_.polarities & 3U];
    return out;
  }

  /// Cells, as many side by side taken together as the room asks for.
  [[nodiscard]] std::size_t write_samples(Span<LineSample> out) const {
    const int all_columns = cells_.columns();
    const auto room = static_cast<int>(std::min<std::size_t>(out.size(), ShapeCells::kMaxCells));
    if (room == 0) return 0;
    constexpr int kSlots = ShapeCells::kSlots;
    const int slots = room >= all_columns * kSlots ? kSlots : room >= 2 * kMinColumns ? 2 : 1;
    const int columns = std::min(all_columns, room / slots);
    std::size_t count = 0;
    for (int i = 0; i < columns; ++i) {
      for (int k = 0; k < slots; ++k) {
        const ShapeCell sum = cells_.joined(i * all_columns / columns, (i + 1) * all_columns / columns,
                                            k * kSlots / slots, (k + 1) * kSlots / slots);
        if (sum.weight > 0) out[count++] = sample_of(sum);
      }
    }
    return count;
  }

 private:
  [[nodiscard]] float position(float s_px) const { return shape_.position(s_px); }
  [[nodiscard]] float offset(float s_px, float tau) const { return shape_at(shape_.terms, position(s_px), tau); }

  [[nodiscard]] Segment segment(int end) const {
    const float tau = end == 0 ? -1.0F : 1.0F;
    const float low = offset(line_.low[end], tau);
    const float high = offset(line_.high[end], tau);
    return {line_.x(line_.low[end], low), line_.y(line_.low[end], low), line_.x(line_.high[end], high),
            line_.y(line_.high[end], high)};
  }

  /// How far the shape stands beside the chord from `low` to `high`, at a fraction of its length.
  [[nodiscard]] float bow(float low, float high, float fraction, float tau) const {
    const float chord = offset(low, tau) + fraction * (offset(high, tau) - offset(low, tau));
    return offset(low + fraction * (high - low), tau) - chord;
  }

  [[nodiscard]] float end_variance(int end) const {
    const float tau = end == 0 ? -1.0F : 1.0F;
    return 0.5F *
           (equations_.variance(position(line_.low[end]), tau) + equations_.variance(position(line_.high[end]), tau));
  }

  /// Lists the events near to the line, with u in the place of s.
  void list_events() {
    const float margin = weight_band(line_.thickness_px) + kShapeMarginPx;
    std::uint32_t stride = std::max<std::uint32_t>(1, line_.events / std::max<std::uint32_t>(1, options_.max_events));
    const EventList list(ws_);
    const std::uint8_t id = line_.id;
    const LineShape shape = shape_;
    const bool is_shared = !shared_.empty();
    listed_ =
        list_near_line(cloud_, line_, {shape.low_px(), shape.high_px(), margin}, ws_, &stride, [&](LineEvent& event) {
          const std::uint8_t owner = list.owner[event.index];
          if (!is_shared) event.along_px = shape.position(event.along_px);
          return owner == 0 || owner == id;
        });
    if (!is_shared) return;
    std::size_t kept = 0;
    for_each_clear(shared_, line_, list, 0, listed_, [&](std::size_t k) {
      list.along[kept] = shape.position(list.along[k]);
      list.across[kept] = list.across[k];
      list.tau[kept++] = list.tau[k];
    });
    listed_ = kept;
  }

  /// Sums up the residuals of one in `step` of the listed events.
  void sum_cells(std::size_t step) {
    const float band = weight_band(std::sqrt(variance_));
    const float per_band2 = 1 / (band * band);
    const LineShape shape = shape_;  // the sums could be it, or the lists, for all that the compiler knows
    const EventList list(ws_);
    float weighted_square = 0;
    float all_weight = 0;
    for (std::size_t k = 0; k < listed_; k += step) {
      const float u = list.along[k];
      const float tau = list.tau[k];
      const float r = list.across[k] - shape_at(shape.terms, u, tau);
      const float weight = 1 - r * r * per_band2;
      if (weight <= 0) continue;
      cells_.add(u, tau, weight, r);
      weighted_square += weight * r * r;
      all_weight += weight;
    }
    weight_ = all_weight;
    if (weight_ > 0) variance_ = std::max(weighted_square / (weight_ * kWeightedVariance), 1e-4F);
  }

  [[nodiscard]] float systematic_variance() const {
    const bool is_independent = line_.polarities != 3 && std::sqrt(variance_) > options_.independent_scatter_px &&
                                cells_.dispersion() > options_.independent_dispersion;
    if (is_independent) return options_.independent_px * options_.independent_px;
    // Events per px^2 of swept area, once more than nothing: the denser an edge fires, the sharper it stands.
    constexpr float kLeastDensity = 0.05F;
    const float travel = std::max(1.0F, 2 * std::fabs(shape_.terms[2]));
    const float fired = static_cast<float>(line_.events) / cloud_.kept_share;
    const float density = std::max(fired / std::max(1.0F, line_.length() * travel), kLeastDensity);
    return options_.systematic_px * options_.systematic_px + options_.systematic_sparse_px2 / density;
  }

  [[nodiscard]] LineSample sample_of(const ShapeCell& sum) const {
    const float u = sum.u / sum.weight;
    const float tau = sum.tau / sum.weight;
    const float s = shape_.middle_px + shape_.half_px * u;
    // The residuals are those from the shape before its last change.
    const float d = shape_at(shape_.terms, u, tau) - shape_at(change_, u, tau) + sum.residual / sum.weight;
    return {line_.x(s, d), line_.y(s, d), 0.5F * (tau + 1), std::sqrt(ShapeCells::variance(sum, variance_, misfit2_))};
  }

  const EventCloud& cloud_;
  const LineShapeOptions& options_;
  const LinePriors& priors_;
  const LineWorkspace& ws_;
  const MovingLine& line_;
  const SharedStretches& shared_;
  LineShape shape_;
  float change_[kNumShapeTerms] = {};  // by the last solution
  ShapeCells cells_;
  std::size_t listed_ = 0;  // events in the lists
  float weight_ = 0;
  float variance_;            // of the events' distance, px^2
  float misfit2_ = 0;         // of the cells' means, px^2
  ShapeEquations equations_;  // until they are solved, sigma is that of the events
};

}  // namespace

int shape_columns(const LineShape& shape) {
  return std::clamp(static_cast<int>(2 * shape.half_px / kColumnPx), kMinColumns, ShapeCells::kMaxColumns);
}

void add_shape_priors(const LineShapeOptions& options, const LinePriors& priors, const LineShape& shape,
                      ShapeEquations* equations) {
  const float bend = std::fabs(shape.terms[4]);
  const float higher = options.least_bend_px + options.higher_bend_share * bend;
  const float scale = shape.half_px * kAlongUnit;
  const float sigmas[kNumShapeTerms - 1] = {priors.motion_px * scale,
                                            priors.motion_px,
                                            priors.turn_px * scale,
                                            priors.bend_px * scale * scale,
                                            options.acceleration_px,
                                            options.turn_acceleration_px,
                                            options.least_bend_change_px + options.bend_change_share * bend,
                                            higher,
                                            higher};
  for (int i = 1; i < kNumShapeTerms; ++i) equations->add_prior(i, sigmas[i - 1], shape.terms[i]);
}

ShapedLine shape_line(const EventCloud& cloud, const LineShapeOptions& options, const LinePriors& priors,
                      const LineWorkspace& workspace, const MovingLine& line, const SharedStretches& shared,
                      Span<LineSample> samples) {
  ShapeFitter fitter(cloud, options, priors, workspace, line, shared);
  fitter.fit();
  return {fitter.record(), fitter.shape(), fitter.write_samples(samples)};
}

}  // namespace lecalib
