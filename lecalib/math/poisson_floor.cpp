// SPDX-License-Identifier: MIT
#include "lecalib/math/poisson_floor.hpp"

namespace lecalib {
namespace {

constexpr int kHalvings = 20;
constexpr float kTailAccuracy = 1e-6F;

/// p(last) / P(n <= last), Erlang's formula B, by its recursion: no exponential, nothing that overflows.
float last_over_head(std::size_t last, float mean) {
  float ratio = 1;
  for (std::size_t k = 1; k <= last; ++k) {
    const float next = ratio * mean / static_cast<float>(k);
    ratio = next / (1 + next);
  }
  return ratio;
}

/// P(n > last) / p(last), for mean <= 2 (last + 1).
float tail_over_last(std::size_t last, float mean) {
  float sum = 0;
  float term = 1;
  for (std::size_t k = last + 1; static_cast<float>(k) <= mean || term > kTailAccuracy * sum; ++k) {
    term *= mean / static_cast<float>(k);
    sum += term;
  }
  return sum;
}

/// Where a function that falls passes zero, in [0, high].
template <class Function>
float zero_of_falling(float high, Function function) {
  float low = 0;
  for (int i = 0; i < kHalvings; ++i) {
    const float middle = 0.5F * (low + high);
    (function(middle) > 0 ? low : high) = middle;
  }
  return 0.5F * (low + high);
}

/// The counts up to `last`, and how many lie above.
struct Head {
  std::size_t last = 0;
  float count = 0, sum = 0;
  float above = 0;
};

Head head_of(Span<const std::uint32_t> histogram, float quiet_share) {
  std::uint64_t total = 0;
  for (const std::uint32_t n : histogram) total += n;
  const float wanted = quiet_share * static_cast<float>(total);
  std::uint64_t count = 0;
  std::uint64_t sum = 0;
  std::size_t k = 0;
  // At least 0 and 1: from one count alone follows no mean. The last entry is no count.
  for (; k + 1 < histogram.size() && (k < 2 || static_cast<float>(count) <= wanted); ++k) {
    count += histogram[k];
    sum += k * histogram[k];
  }
  return {k - 1, static_cast<float>(count), static_cast<float>(sum), static_cast<float>(total - count)};
}

}  // namespace

float poisson_floor(Span<const std::uint32_t> histogram, float quiet_share) {
  const Head head = head_of(histogram, quiet_share);
  const float high = 2 * static_cast<float>(head.last + 1);
  if (head.count == 0) return head.above > 0 ? high : 0;
  if (head.sum == 0 && head.above == 0) return 0;
  // Slopes of the logarithms of the likelihoods.
  const float truncated = zero_of_falling(
      high, [&](float mean) { return head.sum - head.count * mean * (1 - last_over_head(head.last, mean)); });
  const float tail_over_head =
      truncated > 0 ? last_over_head(head.last, truncated) * tail_over_last(head.last, truncated) : 0;
  if (head.above >= head.count * tail_over_head) return truncated;
  return zero_of_falling(high, [&](float mean) {
    return head.sum - head.count * mean + head.above * mean / tail_over_last(head.last, mean);
  });
}

}  // namespace lecalib
