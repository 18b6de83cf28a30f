// SPDX-License-Identifier: MIT
#include "lecalib/host/plot_axis.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "lecalib/host/exponential.hpp"
#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

constexpr double kTicksWanted = 5;  // of a linear axis, at most one more
constexpr int kMaxDecimals = 12;
constexpr double kLabelRoom = 0.15;  // of an axis, between two labels of given values
/// A logarithmic axis of more decades has labels at powers of ten alone.
constexpr int kMaxFullDecades = 2;
constexpr double kRounding = 1e-9;  // of a step

double power_of_ten(int exponent) {
  double power = 1;
  for (int i = 0; i < std::abs(exponent); ++i) power *= 10;
  return exponent < 0 ? 1 / power : power;
}

/// The largest exponent whose power of ten is not above `value`, > 0.
int decade_of(double value) {
  int exponent = static_cast<int>(std::floor(logarithm(value) / logarithm(10)));
  if (power_of_ten(exponent + 1) <= value) ++exponent;
  return power_of_ten(exponent) <= value ? exponent : exponent - 1;
}

/// The smallest of 1, 2, 5 times a power of ten that is at least `value`, > 0.
double round_up(double value) {
  const double power = power_of_ten(decade_of(value));
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (digit * power >= value * (1 - kRounding)) return digit * power;
  }
  return 10 * power;
}

/// The largest of 1, 2, 5 times a power of ten that is at most `value`, > 0.
double round_down(double value) {
  const double power = power_of_ten(decade_of(value));
  for (const double digit : {5.0, 2.0}) {
    if (digit * power <= value * (1 + kRounding)) return digit * power;
  }
  return power;
}

int decimals_for(double step) { return std::clamp(-decade_of(step), 0, kMaxDecimals); }

std::vector<double> usable(const std::vector<double>& values, bool positive) {
  std::vector<double> kept;
  for (const double value : values) {
    if (std::isfinite(value) && (!positive || value > 0)) kept.push_back(value);
  }
  return kept;
}

}  // namespace

double PlotAxis::place(double value) const {
  if (!logarithmic) return (value - first) / (last - first);
  return (logarithm(value) - logarithm(first)) / (logarithm(last) - logarithm(first));
}

std::string PlotAxis::label(double tick) const {
  if (!logarithmic) return fixed(tick, decimals);
  return fixed(tick, decimals_for(tick));
}

PlotAxis value_axis(const std::vector<double>& values) {
  PlotAxis axis;
  axis.first = values.front();
  axis.last = values.back();
  double smallest_step = std::abs(axis.last - axis.first);
  for (const double value : values) {
    if (!axis.ticks.empty()) {
      const double before = axis.ticks.back();
      if (std::abs(axis.place(value) - axis.place(before)) < kLabelRoom) {
        axis.minor_ticks.push_back(value);
        continue;
      }
      smallest_step = std::min(smallest_step, std::abs(value - before));
    }
    axis.ticks.push_back(value);
  }
  axis.decimals = decimals_for(smallest_step * (1 + kRounding));
  return axis;
}

PlotAxis linear_axis(const std::vector<double>& values) {
  const std::vector<double> kept = usable(values, true);
  const double largest = kept.empty() ? 1 : *std::max_element(kept.begin(), kept.end());
  PlotAxis axis;
  const double step = round_up(largest / kTicksWanted);
  const int steps = static_cast<int>(std::ceil(largest / step - kRounding));
  axis.last = step * steps;
  for (int i = 0; i <= steps; ++i) axis.ticks.push_back(step * i);
  axis.decimals = decimals_for(step);
  return axis;
}

PlotAxis logarithmic_axis(const std::vector<double>& values) {
  const std::vector<double> kept = usable(values, true);
  PlotAxis axis;
  axis.logarithmic = true;
  axis.first = kept.empty() ? 1 : round_down(*std::min_element(kept.begin(), kept.end()));
  axis.last = kept.empty() ? 10 : round_up(*std::max_element(kept.begin(), kept.end()));
  if (!(axis.first < axis.last)) axis.last = round_up(1.01 * axis.first);
  const bool full = decade_of(axis.last) - decade_of(axis.first) <= kMaxFullDecades;
  for (int decade = decade_of(axis.first); decade <= decade_of(axis.last); ++decade) {
    for (int digit = 1; digit < 10; ++digit) {
      const double tick = digit * power_of_ten(decade);
      if (tick < axis.first * (1 - kRounding) || tick > axis.last * (1 + kRounding)) continue;
      const bool has_label = digit == 1 || (full && (digit == 2 || digit == 5));
      (has_label ? axis.ticks : axis.minor_ticks).push_back(tick);
    }
  }
  return axis;
}

}  // namespace lecalib::host
