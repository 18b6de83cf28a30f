// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_shape.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/segments/corridor.hpp"
#include "lecalib/segments/event_weight.hpp"
#include "lecalib/segments/shape_equations.hpp"

namespace lecalib {
namespace {

constexpr float kColumnPx = 12;
constexpr int kMinColumns = 4;
constexpr int kMaxColumns = 24;
constexpr int kSlots = 4;  // of the window
constexpr int kMaxCells = kMaxColumns * kSlots;
constexpr float kMinHalfLengthPx = 8;
constexpr std::uint32_t kFirstRoundEvents = 2000;  // it only brings the shape near

constexpr float kShapeMarginPx = 2;  // by which the shape may stray from the fitted line
constexpr float kMinCellWeight = 3;  // of cells that tell whether the shape fits
constexpr float kFreeTerms = 5;      // of the shape, that the priors hardly hold

/// Weighted sums over the events in a stretch of the line and a part of the window.
struct ShapeCell {
  float events, weight, u, tau, residual;
};

class ShapeFitter {
 public:
  ShapeFitter(const EventCloud& cloud, const LineShapeOptions& options, const LinePriors& priors,
              const LineWorkspace& workspace, const MovingLine& line)
      : cloud_(cloud),
        options_(options),
        priors_(priors),
        ws_(workspace),
        line_(line),
        middle_(0.5F * (line.lowest() + line.highest())),
        half_(std::max(0.5F * (line.highest() - line.lowest()), kMinHalfLengthPx)),
        columns_(std::clamp(static_cast<int>(2 * half_ / kColumnPx), kMinColumns, kMaxColumns)),
        variance_(line.thickness_px * line.thickness_px) {
    const float scale = half_ * kAlongUnit;
    const float s = middle_ * kAlongUnit;
    shape_[0] = line.m[0] + s * (line.m[1] + s * line.m[4]);
    shape_[1] = (line.m[1] + 2 * s * line.m[4]) * scale;
    shape_[2] = line.m[2] + s * line.m[3];
    shape_[3] = line.m[3] * scale;
    shape_[4] = line.m[4] * scale * scale;
  }

  void fit() {
    // Until it is solved, sigma is that of the events.
    equations_ = ShapeEquations(variance_);
    for (int round = 0; round < 2; ++round) {
      const std::uint32_t wanted = round == 0 ? std::min(kFirstRoundEvents, options_.max_events) : options_.max_events;
      collect(std::max<std::uint32_t>(1, line_.events / std::max<std::uint32_t>(1, wanted)));
      if (!(weight_ > 0)) return;
      if (round > 0) measure_misfit();
      ShapeEquations equations;
      for (int i = 0; i < columns_ * kSlots; ++i) {
        const ShapeCell& cell = cells_[i];
        if (!(cell.weight > 0)) continue;
        equations.add(cell.u / cell.weight, cell.tau / cell.weight, 1 / cell_variance(cell),
                      cell.residual / cell.weight);
      }
      add_priors(&equations);
      if (!equations.solve(change_)) return;
      for (int i = 0; i < kNumShapeTerms; ++i) shape_[i] += change_[i];
      equations_ = equations;
    }
  }

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
    const auto room = static_cast<int>(std::min<std::size_t>(out.size(), kMaxCells));
    if (room == 0) return 0;
    const int slots = room >= columns_ * kSlots ? kSlots : room >= 2 * kMinColumns ? 2 : 1;
    const int columns = std::min(columns_, room / slots);
    std::size_t count = 0;
    for (int i = 0; i < columns; ++i) {
      for (int k = 0; k < slots; ++k) {
        const ShapeCell sum =
            joined(i * columns_ / columns, (i + 1) * columns_ / columns, k * kSlots / slots, (k + 1) * kSlots / slots);
        if (sum.weight > 0) out[count++] = sample_of(sum);
      }
    }
    return count;
  }

 private:
  [[nodiscard]] float position(float s_px) const { return (s_px - middle_) / half_; }
  [[nodiscard]] float offset(float s_px, float tau) const { return shape_at(shape_, position(s_px), tau); }

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

  void collect(std::uint32_t stride) {
    for (ShapeCell& cell : cells_) cell = {};
    const float band = weight_band(std::sqrt(variance_));
    const float per_band2 = 1 / (band * band);
    float weighted_square = 0;
    weight_ = 0;
    for_each_near_line(cloud_, line_, middle_ - half_, middle_ + half_, band + kShapeMarginPx, line_.polarities, stride,
                       [&](const LineEvent& event) {
                         const std::uint8_t owner = ws_.owner[event.index];
                         if (owner != 0 && owner != line_.id) return;
                         const float u = position(event.along_px);
                         const float r = event.across_px - shape_at(shape_, u, event.tau);
                         const float weight = 1 - r * r * per_band2;
                         if (weight <= 0) return;
                         ShapeCell& cell = cells_[cell_of(u, event.tau)];
                         cell.events += 1;
                         cell.weight += weight;
                         cell.u += weight * u;
                         cell.tau += weight * event.tau;
                         cell.residual += weight * r;
                         weighted_square += weight * r * r;
                         weight_ += weight;
                       });
    if (weight_ > 0) variance_ = std::max(weighted_square / (weight_ * kWeightedVariance), 1e-4F);
  }

  [[nodiscard]] int cell_of(float u, float tau) const {
    const int column = std::clamp(static_cast<int>((u + 1) * 0.5F * static_cast<float>(columns_)), 0, columns_ - 1);
    const int slot = std::clamp(static_cast<int>((tau + 1) * (0.5F * kSlots)), 0, kSlots - 1);
    return column * kSlots + slot;
  }

  /// How much the cells' means scatter beyond what the number of their events explains, px^2: what the shape does not
  /// follow, and what neighbouring events have in common.
  void measure_misfit() {
    float chi2 = 0;
    float cells = 0;
    for (int i = 0; i < columns_ * kSlots; ++i) {
      const ShapeCell& cell = cells_[i];
      if (cell.weight < kMinCellWeight) continue;
      chi2 += cell.residual * cell.residual / cell.weight;
      cells += 1;
    }
    const float expected = std::max(cells - kFreeTerms, 1.0F) * variance_ * kVarianceInflation;
    misfit2_ = std::max(0.0F, (chi2 - expected) / weight_);
  }

  [[nodiscard]] float cell_variance(const ShapeCell& cell) const {
    return variance_ * kVarianceInflation / cell.weight + misfit2_;
  }

  void add_priors(ShapeEquations* equations) const {
    const float bend = std::fabs(shape_[4]);
    const float higher = options_.least_bend_px + options_.higher_bend_share * bend;
    const float scale = half_ * kAlongUnit;
    const float sigmas[kNumShapeTerms - 1] = {priors_.motion_px * scale,
                                              priors_.motion_px,
                                              priors_.turn_px * scale,
                                              priors_.bend_px * scale * scale,
                                              options_.acceleration_px,
                                              options_.turn_acceleration_px,
                                              options_.least_bend_change_px + options_.bend_change_share * bend,
                                              higher,
                                              higher};
    for (int i = 1; i < kNumShapeTerms; ++i) equations->add_prior(i, sigmas[i - 1], shape_[i]);
  }

  /// Variance over mean of the cells' counts along the line; slow changes are left aside by second differences.
  [[nodiscard]] float dispersion() const {
    float square = 0;
    float sum = 0;
    for (int i = 1; i + 1 < columns_; ++i) {
      for (int slot = 0; slot < kSlots; ++slot) {
        const ShapeCell* const cell = &cells_[i * kSlots + slot];
        const float second = cell[-kSlots].events - 2 * cell->events + cell[kSlots].events;
        square += second * second / 6;
        sum += cell->events;
      }
    }
    return sum > 0 ? square / sum : 0;
  }

  [[nodiscard]] float systematic_variance() const {
    const bool is_independent = line_.polarities != 3 && std::sqrt(variance_) > options_.independent_scatter_px &&
                                dispersion() > options_.independent_dispersion;
    if (is_independent) return options_.independent_px * options_.independent_px;
    // Events per px^2 of swept area, once more than nothing: the denser an edge fires, the sharper it stands.
    constexpr float kLeastDensity = 0.05F;
    const float travel = std::max(1.0F, 2 * std::fabs(shape_[2]));
    const float fired = static_cast<float>(line_.events) / cloud_.kept_share;
    const float density = std::max(fired / std::max(1.0F, line_.length() * travel), kLeastDensity);
    return options_.systematic_px * options_.systematic_px + options_.systematic_sparse_px2 / density;
  }

  [[nodiscard]] ShapeCell joined(int first_column, int last_column, int first_slot, int last_slot) const {
    ShapeCell sum{};
    for (int i = first_column; i < last_column; ++i) {
      for (int slot = first_slot; slot < last_slot; ++slot) {
        const ShapeCell& cell = cells_[i * kSlots + slot];
        sum.events += cell.events;
        sum.weight += cell.weight;
        sum.u += cell.u;
        sum.tau += cell.tau;
        sum.residual += cell.residual;
      }
    }
    return sum;
  }

  [[nodiscard]] LineSample sample_of(const ShapeCell& sum) const {
    const float u = sum.u / sum.weight;
    const float tau = sum.tau / sum.weight;
    const float s = middle_ + half_ * u;
    // The residuals are those from the shape before its last change.
    const float d = shape_at(shape_, u, tau) - shape_at(change_, u, tau) + sum.residual / sum.weight;
    return {line_.x(s, d), line_.y(s, d), 0.5F * (tau + 1), std::sqrt(cell_variance(sum))};
  }

  const EventCloud& cloud_;
  const LineShapeOptions& options_;
  const LinePriors& priors_;
  const LineWorkspace& ws_;
  const MovingLine& line_;
  float middle_;  // of the line, and half of its length, px along it
  float half_;
  int columns_;
  float shape_[kNumShapeTerms] = {};
  float change_[kNumShapeTerms] = {};  // by the last solution
  ShapeCell cells_[kMaxCells] = {};
  float weight_ = 0;
  float variance_;     // of the events' distance, px^2
  float misfit2_ = 0;  // of the cells' means, px^2
  ShapeEquations equations_;
};

}  // namespace

EventLine shape_line(const EventCloud& cloud, const LineShapeOptions& options, const LinePriors& priors,
                     const LineWorkspace& workspace, const MovingLine& line, Span<LineSample> samples,
                     std::size_t* num_samples) {
  ShapeFitter fitter(cloud, options, priors, workspace, line);
  fitter.fit();
  if (num_samples != nullptr) *num_samples = fitter.write_samples(samples);
  return fitter.record();
}

}  // namespace lecalib
