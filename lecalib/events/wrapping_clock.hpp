// SPDX-License-Identifier: MIT
#pragma once

#include "lecalib/events/decoder.hpp"

namespace lecalib {

/// Unrolls a counter of kBits bits that runs over.
///
/// A roll-over is a step back by more than three quarters of the range; the like step forward undoes it (a late word
/// from before the roll-over). Smaller steps are taken as they are: a single wrong bit moves the counter by half of
/// its range at most, so it spoils one reading and never the ones after it.
template <unsigned kBits>
class WrappingClock {
 public:
  void update(std::uint32_t reading) noexcept {
    const std::int64_t step = static_cast<std::int64_t>(reading) - reading_;
    if (step < -kRollOver) ++wraps_;
    if (step > kRollOver && wraps_ > 0) --wraps_;
    reading_ = reading;
    started_ = true;
  }

  /// Whether update() with it would change nothing.
  [[nodiscard]] bool repeats(std::uint64_t reading) const noexcept {
    return started_ && static_cast<std::int64_t>(reading) == reading_;
  }
  [[nodiscard]] bool started() const noexcept { return started_; }
  /// The last reading with its roll-overs; 0 before the first.
  [[nodiscard]] std::int64_t value() const noexcept { return (wraps_ << kBits) + reading_; }
  [[nodiscard]] std::int64_t wraps() const noexcept { return wraps_; }

 private:
  static_assert(kBits <= 32);
  static constexpr std::int64_t kRollOver = (std::int64_t{1} << kBits) / 4 * 3;

  std::int64_t reading_ = 0;
  std::int64_t wraps_ = 0;
  bool started_ = false;
};

/// Updates the clock and counts what the reading says about it.
template <unsigned kBits>
void take_time(std::uint32_t reading, WrappingClock<kBits>* clock, DecoderStats* stats) noexcept {
  const std::int64_t before = clock->value();
  clock->update(reading);
  if (clock->value() < before) ++stats->time_steps_back;
  stats->time_wraps = static_cast<std::uint64_t>(clock->wraps());
}

}  // namespace lecalib
