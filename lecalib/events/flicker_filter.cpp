// SPDX-License-Identifier: MIT
#include "lecalib/events/flicker_filter.hpp"

#include "lecalib/core/time.hpp"

namespace lecalib {
namespace {

/// Slots in units of 1/6 us, in which both are whole: 10 ms / 16 and 8.333 ms / 16.
constexpr std::uint64_t kUnitsPerUs = 6;
constexpr std::uint64_t kSlotUnits[kFlickerLights] = {3750, 3125};

/// After a longer pause nothing of the past counts: the histories would be empty, and a pixel's time ambiguous.
constexpr std::uint64_t kMaxPauseUs = std::uint64_t{1} << 16U;
/// Events so far back in time are the sensor's disorder; the clock stands still for them.
constexpr std::uint64_t kMaxDisorderUs = 8192;

// Pixels keep 7 bits of the time in units of 2.048 ms, and whether they were found to repeat. Forgetting comes every 32
// units, or 63 at the most after a pause, and leaves none older than 64: 7 bits suffice.
constexpr std::uint8_t kNeverFired = 0;
constexpr unsigned kPixelTimeShift = 11;
constexpr std::uint64_t kForgetEvery = 32;
constexpr unsigned kPixelTimeMask = 127;
constexpr unsigned kMaxAge = 64;    // 131 ms, 13 periods at least
constexpr unsigned kNextBurst = 2;  // a burst of one edge or one flash is over after as many units

// A lamp lights a region; an edge that vibrates in phase with the mains is a few pixels thin.
constexpr unsigned kRing = 4;  // px, distance of the 8 pixels asked
// So many of them and the pixel itself have fired: at a corner of the region; of a straight line it is 3.
constexpr unsigned kInRegion = 4;

constexpr std::size_t kSlotReach = 2;  // slots to either side that are taken together with a slot

/// Which slots of a period stand out, a bit for each: those above the mean within a run of 5 slots that hold more than
/// 7/4 times their share, and 3 events. Runs, since the pixel grid lets fine gratings fire at a few single times. For
/// counts by chance that happens in 1.5 % at most, so hardly ever in 6 of 8 periods.
unsigned slots_that_stand_out(const std::uint8_t* counts) noexcept {
  unsigned total = 0;
  for (std::size_t slot = 0; slot < kFlickerSlots; ++slot) total += counts[slot];
  if (total <= 3) return 0;
  unsigned run = 0;
  for (std::size_t i = 0; i < 2 * kSlotReach; ++i) run += counts[(i + kFlickerSlots - kSlotReach) % kFlickerSlots];
  unsigned near = 0;
  unsigned busy = 0;
  for (std::size_t slot = 0; slot < kFlickerSlots; ++slot) {
    run += counts[(slot + kSlotReach) % kFlickerSlots];
    if (64 * run > 35 * total + 192) near |= 0x1FU << slot;  // the run's slots, shifted by kSlotReach
    if (16 * counts[slot] > total) busy |= 1U << slot;
    run -= counts[(slot + kFlickerSlots - kSlotReach) % kFlickerSlots];
  }
  near |= near >> kFlickerSlots | near << kFlickerSlots;  // the period is a circle
  return near >> kSlotReach & busy;
}

unsigned bits_set(std::uint8_t bits) noexcept {
  unsigned count = bits - (bits >> 1U & 0x55U);
  count = (count & 0x33U) + (count >> 2U & 0x33U);
  return (count + (count >> 4U)) & 0x0FU;
}

/// Units since the pixel's last burst began, at `now`.
unsigned age_of(std::uint8_t pixel, unsigned now) noexcept { return (now - (pixel >> 1U)) & kPixelTimeMask; }

}  // namespace

std::size_t FlickerFilter::drop(Span<Event> events, std::uint8_t min_periods) noexcept {
  if (events.empty()) return 0;
  const std::int64_t first_us = events[0].t_us;
  if (first_us < now_us_ && distance_us(first_us, now_us_) > kMaxDisorderUs) restart();
  std::size_t kept = 0;
  for (const Event& event : events) {
    advance(event.t_us, min_periods);
    const bool is_flicker = count(event) && has_fired_before(event) && lies_in_region(event);
    if (!is_flicker) events[kept++] = event;
  }
  return kept;
}

void FlickerFilter::start(std::int64_t t_us) noexcept {
  for (FlickerBlock& block : blocks_) block = {};
  for (std::uint8_t& pixel : pixels_) pixel = kNeverFired;
  for (std::size_t light = 0; light < kFlickerLights; ++light) {
    slot_end_[light] = kSlotUnits[light];
    slot_[light] = 0;
  }
  start_us_ = now_us_ = t_us;
  next_forgetting_ = kForgetEvery;
  is_running_ = true;
}

void FlickerFilter::advance(std::int64_t t_us, std::uint8_t min_periods) noexcept {
  if (is_running_ && t_us <= now_us_) return;
  if (!is_running_ || distance_us(now_us_, t_us) >= kMaxPauseUs) {
    start(t_us);
    return;
  }
  now_us_ = t_us;
  const std::uint64_t now = distance_us(start_us_, t_us) * kUnitsPerUs;
  for (std::size_t light = 0; light < kFlickerLights; ++light) {
    while (now >= slot_end_[light]) {
      slot_end_[light] += kSlotUnits[light];
      if (++slot_[light] < kFlickerSlots) continue;
      slot_[light] = 0;
      end_period(light, min_periods);
    }
  }
  if (pixel_time() >= next_forgetting_) forget_old_pixels();
}

/// Notes which slots stood out, tells which flicker, and begins to count anew. The slots beside one that flickers hold
/// the burst's first and last events, and those of the next period when the mains are not at their nominal rate.
void FlickerFilter::end_period(std::size_t light, std::uint8_t min_periods) noexcept {
  for (FlickerBlock& block : blocks_.subspan(light * num_blocks_, num_blocks_)) {
    for (const std::size_t polarity : {0U, 1U}) {
      std::uint8_t* const history = block.history[polarity];
      const unsigned out = slots_that_stand_out(block.counts[polarity]);
      unsigned flickers = 0;
      for (std::size_t slot = 0; slot < kFlickerSlots; ++slot) {
        const unsigned past = history[slot];
        history[slot] = static_cast<std::uint8_t>(past << 1U | (out >> slot & 1U));
        block.counts[polarity][slot] = 0;
        if (bits_set(history[slot]) >= min_periods) flickers |= 7U << slot;  // shifted by one
      }
      flickers |= flickers >> kFlickerSlots | flickers << kFlickerSlots;
      block.flickers[polarity] = static_cast<std::uint16_t>(flickers >> 1U);
    }
  }
}

/// @return whether a light flickers in the event's block, slot and polarity
bool FlickerFilter::count(const Event& event) noexcept {
  const std::size_t at = (std::size_t{event.y} >> kFlickerBlockShift) * columns_ + (event.x >> kFlickerBlockShift);
  const std::size_t polarity = event.polarity != 0 ? 1 : 0;
  bool flickers = false;
  for (std::size_t light = 0; light < kFlickerLights; ++light) {
    FlickerBlock& block = blocks_[light * num_blocks_ + at];
    std::uint8_t& counted = block.counts[polarity][slot_[light]];
    if (counted < 255) ++counted;
    flickers = flickers || (block.flickers[polarity] >> slot_[light] & 1) != 0;
  }
  return flickers;
}

/// Whether the event's pixel fired in another burst before, not long ago; notes that it fires now. A burst's further
/// events fare as its first one. A pixel that fires first while the time's bits are 0 passes for one that never did.
bool FlickerFilter::has_fired_before(const Event& event) noexcept {
  std::uint8_t& pixel = pixels_[std::size_t{event.y} * width_ + event.x];
  const auto now = static_cast<unsigned>(pixel_time() & kPixelTimeMask);
  bool repeats = false;
  if (pixel != kNeverFired) {
    const unsigned age = age_of(pixel, now);
    if (age < kNextBurst) return (pixel & 1U) != 0;
    repeats = age <= kMaxAge;
  }
  pixel = static_cast<std::uint8_t>((now << 1U) | (repeats ? 1U : 0U));
  return repeats;
}

/// Whether pixels all around the event's fired in a slot that stands out as well, not long ago.
bool FlickerFilter::lies_in_region(const Event& event) const noexcept {
  // Beyond the sensor's rim the opposite side stands in.
  const std::size_t left = event.x >= kRing ? event.x - kRing : event.x + kRing;
  const std::size_t right = event.x + kRing < width_ ? event.x + kRing : left;
  const std::size_t above = event.y >= kRing ? event.y - kRing : event.y + kRing;
  const std::size_t below = event.y + kRing < height_ ? event.y + kRing : above;
  if (left >= width_ || above >= height_) return true;  // the sensor is smaller than the ring
  const auto now = static_cast<unsigned>(pixel_time() & kPixelTimeMask);
  unsigned fired = 0;
  for (const std::size_t y : {above, std::size_t{event.y}, below}) {
    const std::uint8_t* const row = &pixels_[y * width_];
    for (const std::size_t x : {left, std::size_t{event.x}, right}) {
      fired += row[x] != kNeverFired && age_of(row[x], now) <= kMaxAge ? 1U : 0U;
    }
  }
  return fired >= kInRegion;
}

void FlickerFilter::forget_old_pixels() noexcept {
  const auto now = static_cast<unsigned>(pixel_time() & kPixelTimeMask);
  for (std::uint8_t& pixel : pixels_) {
    if (age_of(pixel, now) > kMaxAge) pixel = kNeverFired;
  }
  next_forgetting_ = pixel_time() + kForgetEvery;
}

std::uint64_t FlickerFilter::pixel_time() const noexcept { return distance_us(start_us_, now_us_) >> kPixelTimeShift; }

}  // namespace lecalib
