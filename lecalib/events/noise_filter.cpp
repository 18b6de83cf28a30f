// SPDX-License-Identifier: MIT
/// Each filter but that of flicker is one or two walks over the events with one byte per pixel beside them: a count, or
/// a time in ticks of 1/254 of the window.
#include "lecalib/events/noise_filter.hpp"

#include "lecalib/core/time.hpp"

namespace lecalib {
namespace {

constexpr std::uint8_t kNever = 0;
constexpr std::uint8_t kTicks = 254;

/// The workspace's bytes by pixel.
class PixelMap {
 public:
  PixelMap(Span<std::uint8_t> bytes, std::uint16_t width, std::uint16_t height) noexcept
      : columns_(width + std::size_t{2}), bytes_(bytes.first(columns_ * (height + std::size_t{2}))) {}

  void clear() noexcept {
    for (std::uint8_t& byte : bytes_) byte = 0;
  }
  [[nodiscard]] std::uint8_t& at(const Event& event) const noexcept { return bytes_[index(event)]; }

  /// Calls use(byte) for the pixel's 8 neighbours.
  template <class Use>
  void for_each_neighbour(const Event& event, Use&& use) const noexcept {
    const std::uint8_t* const above = &bytes_[index(event) - columns_ - 1];
    const std::uint8_t* const beside = above + columns_;
    const std::uint8_t* const below = beside + columns_;
    for (const std::size_t i : {0U, 1U, 2U}) use(above[i]);
    use(beside[0]);
    use(beside[2]);
    for (const std::size_t i : {0U, 1U, 2U}) use(below[i]);
  }

 private:
  [[nodiscard]] std::size_t index(const Event& event) const noexcept {
    return (event.y + std::size_t{1}) * columns_ + event.x + 1;
  }

  std::size_t columns_;
  Span<std::uint8_t> bytes_;
};

/// Times of a window in ticks from 1 to 255; what lies beside the window counts as its begin or end.
class TickClock {
 public:
  explicit TickClock(const EventWindow& window) noexcept
      : begin_us_(window.begin_us), length_us_(distance_us(window.begin_us, window.end_us)) {
    ticks_per_us_ = length_us_ > 0 ? (std::uint64_t{kTicks} << 32U) / length_us_ : 0;
  }
  [[nodiscard]] std::uint8_t tick(std::int64_t t_us) const noexcept {
    return static_cast<std::uint8_t>(1 + (t_us > begin_us_ ? scale(distance_us(begin_us_, t_us)) >> 32U : 0));
  }
  /// Rounded, at least 1.
  [[nodiscard]] int ticks_of(std::int64_t duration_us) const noexcept {
    const auto nearest = static_cast<int>((scale(static_cast<std::uint64_t>(duration_us)) + (1U << 31U)) >> 32U);
    return nearest > 0 ? nearest : 1;
  }

 private:
  /// Ticks times 2^32, at most kTicks of them.
  [[nodiscard]] std::uint64_t scale(std::uint64_t us) const noexcept {
    return (us < length_us_ ? us : length_us_) * ticks_per_us_;
  }

  std::int64_t begin_us_;
  std::uint64_t length_us_;
  std::uint64_t ticks_per_us_;  ///< times 2^32
};

/// Copies the events that `is_wanted`, in order. @return how many
template <class IsWanted>
std::size_t keep_if(Span<const Event> events, Span<Event> out, IsWanted&& is_wanted) noexcept {
  std::size_t kept = 0;
  for (const Event& event : events) {
    if (is_wanted(event)) out[kept++] = event;
  }
  return kept;
}

std::size_t drop_hot(Span<Event> events, const NoiseFilterOptions& options, PixelMap* counts) noexcept {
  counts->clear();
  for (const Event& event : events) {
    std::uint8_t& count = counts->at(event);
    if (count < 255) ++count;
  }
  return keep_if(events, events, [&](const Event& event) {
    const std::uint8_t count = counts->at(event);
    if (count < options.hot_min_events) return true;
    std::uint8_t busiest = 0;
    counts->for_each_neighbour(event, [&](std::uint8_t other) {
      if (other > busiest) busiest = other;
    });
    return count <= options.hot_ratio * busiest;
  });
}

std::size_t drop_refractory(Span<Event> events, const TickClock& clock, int refractory, PixelMap* last_ticks) noexcept {
  last_ticks->clear();
  return keep_if(events, events, [&](const Event& event) {
    std::uint8_t& last = last_ticks->at(event);
    const std::uint8_t now = clock.tick(event.t_us);
    if (last != kNever && now - last < refractory) return false;
    last = now;
    return true;
  });
}

/// Set beside the polarity in events that have enough neighbours.
constexpr std::uint8_t kSupported = 0x80;

/// Marks the event if enough neighbours fired within `support` ticks of it, and notes its own time.
void mark_if_supported(Event* event, int now, int support, std::uint8_t min_neighbours, PixelMap* ticks) noexcept {
  if ((event->polarity & kSupported) == 0) {
    const int first = now - support > 1 ? now - support : 1;  // kNever lies before
    const auto span = static_cast<unsigned>(now + support - first);
    unsigned neighbours = 0;
    ticks->for_each_neighbour(
        *event, [&](std::uint8_t tick) { neighbours += static_cast<unsigned>(tick - first) <= span ? 1U : 0U; });
    if (neighbours >= min_neighbours) event->polarity |= kSupported;
  }
  ticks->at(*event) = static_cast<std::uint8_t>(now);
}

std::size_t drop_isolated(Span<Event> events, const TickClock& clock, int support, std::uint8_t min_neighbours,
                          PixelMap* ticks) noexcept {
  ticks->clear();
  for (Event& event : events) mark_if_supported(&event, clock.tick(event.t_us), support, min_neighbours, ticks);
  ticks->clear();
  for (std::size_t i = events.size(); i-- > 0;) {
    mark_if_supported(&events[i], clock.tick(events[i].t_us), support, min_neighbours, ticks);
  }
  return keep_if(events, events, [](const Event& event) { return (event.polarity & kSupported) != 0; });
}

}  // namespace

Status filter_noise(const EventWindow& window, const NoiseFilterOptions& options, NoiseFilterWorkspace* workspace,
                    Span<Event> out, EventWindow* filtered, NoiseFilterStats* stats) noexcept {
  if (options.width == 0 || options.height == 0 || options.hot_ratio == 0) return Status::invalid_argument;
  if (options.refractory_us < 0 || options.support_us < 0 || options.min_neighbours > 8)
    return Status::invalid_argument;
  if (options.flicker_periods > 8) return Status::invalid_argument;
  if (window.end_us < window.begin_us) return Status::invalid_argument;
  if (out.size() < window.events.size()) return Status::buffer_too_small;
  if (workspace->pixels.size() < (options.width + std::size_t{2}) * (options.height + std::size_t{2})) {
    return Status::buffer_too_small;
  }
  if (options.flicker_periods > 0 && !workspace->flicker.holds(options.width, options.height)) {
    return Status::buffer_too_small;
  }
  PixelMap map(workspace->pixels, options.width, options.height);
  const TickClock clock(window);

  std::size_t before = window.events.size();
  std::size_t kept = keep_if(window.events, out,
                             [&](const Event& event) { return event.x < options.width && event.y < options.height; });
  stats->events += before;
  stats->outside += before - kept;
  if (options.flicker_periods > 0) {
    before = kept;
    kept = workspace->flicker.drop(out.first(kept), options.flicker_periods);
    stats->flicker += before - kept;
  }
  if (options.hot_min_events > 0) {
    before = kept;
    kept = drop_hot(out.first(kept), options, &map);
    stats->hot += before - kept;
  }
  if (options.refractory_us > 0) {
    before = kept;
    kept = drop_refractory(out.first(kept), clock, clock.ticks_of(options.refractory_us), &map);
    stats->refractory += before - kept;
  }
  if (options.min_neighbours > 0) {
    before = kept;
    const int support = options.support_us > 0 ? clock.ticks_of(options.support_us) : kTicks / 2;
    kept = drop_isolated(out.first(kept), clock, support, options.min_neighbours, &map);
    for (Event& event : out.first(kept)) event.polarity &= static_cast<std::uint8_t>(~kSupported);
    stats->isolated += before - kept;
  }
  stats->kept += kept;
  *filtered = {window.begin_us, window.end_us, out.first(kept)};
  return Status::ok;
}

}  // namespace lecalib
