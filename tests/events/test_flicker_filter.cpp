// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/events/flicker_filter.hpp"
#include "support/alloc_counter.hpp"
#include "support/decode_pieces.hpp"
#include "support/guarded_arena.hpp"

namespace lecalib::test {
namespace {

constexpr std::uint16_t kWidth = 80;
constexpr std::uint16_t kHeight = 70;
constexpr std::uint8_t kMinPeriods = 6;

bool is_earlier(const Event& a, const Event& b) { return a.t_us < b.t_us; }

/// The filter in memory of its own.
class Filter {
 public:
  Filter() : memory_(bytes()) { REQUIRE(filter_.carve(memory_.arena(), kWidth, kHeight)); }

  static std::size_t bytes() {
    ArenaMeter meter;
    FlickerFilter filter;
    REQUIRE(filter.carve(meter, kWidth, kHeight));
    return meter.peak();
  }

  /// What is kept of events in order of time, given in windows of random lengths up to max_window_us.
  std::vector<Event> run(const std::vector<Event>& events, std::uint32_t max_window_us, std::uint64_t seed = 3) {
    Rng rng(seed);
    std::vector<Event> kept;
    std::vector<Event> window;
    for (std::size_t i = 0; i < events.size();) {
      const std::int64_t end_us = events[i].t_us + 1 + rng.below(max_window_us);
      window.clear();
      while (i < events.size() && events[i].t_us < end_us) window.push_back(events[i++]);
      const AllocScope heap;
      const std::size_t count = filter_.drop(window, kMinPeriods);
      const std::size_t allocations = heap.allocations();
      CHECK(allocations == 0);
      REQUIRE(count <= window.size());
      kept.insert(kept.end(), window.begin(), window.begin() + static_cast<std::ptrdiff_t>(count));
    }
    return kept;
  }
  FlickerFilter& filter() { return filter_; }

 private:
  GuardedArena memory_;
  FlickerFilter filter_;
};

/// A lamp: each pixel of [x0, x1) x [y0, y1) fires ON at the begin of each period and OFF half a period later, with
/// jitter, up to three times, and misses one burst in `miss`.
void add_lamp(Rng* rng, double hz, std::int64_t end_us, std::uint16_t x0, std::uint16_t y0, std::uint16_t x1,
              std::uint16_t y1, std::uint32_t miss, std::vector<Event>* out) {
  const double half_us = 0.5e6 / hz;
  for (int half = 0; half * half_us < static_cast<double>(end_us); ++half) {
    for (std::uint16_t y = y0; y < y1; ++y) {
      for (std::uint16_t x = x0; x < x1; ++x) {
        if (rng->below(miss) == 0) continue;
        auto t_us = static_cast<std::int64_t>(half * half_us) + 700 + rng->below(1000);
        for (std::uint32_t left = 1 + rng->below(3); left > 0; --left) {
          out->push_back({t_us, x, y, static_cast<std::uint8_t>(half % 2 == 0 ? 1 : 0)});
          t_us += 100 + rng->below(300);
        }
      }
    }
  }
}

/// An edge that stands upright and moves to the right: each pixel of rows [y0, y1) fires two or three times.
void add_edge(Rng* rng, std::int64_t begin_us, double us_per_px, std::uint8_t polarity, std::uint16_t y0,
              std::uint16_t y1, std::vector<Event>* out) {
  for (std::uint16_t x = 0; x < kWidth; ++x) {
    for (std::uint16_t y = y0; y < y1; ++y) {
      auto t_us = begin_us + static_cast<std::int64_t>(x * us_per_px) + rng->below(300);
      for (std::uint32_t left = 2 + rng->below(2); left > 0; --left) {
        out->push_back({t_us, x, y, polarity});
        t_us += 200 + rng->below(400);
      }
    }
  }
}

/// Events of both kinds in order of time; which is which is told by the pixel, or by tag.
struct Share {
  std::size_t all = 0;
  std::size_t kept = 0;
  [[nodiscard]] double dropped() const {
    return all == 0 ? 0 : 1 - static_cast<double>(kept) / static_cast<double>(all);
  }
};
template <class Belongs>
Share share_of(const std::vector<Event>& events, const std::vector<Event>& kept, Belongs belongs) {
  return {static_cast<std::size_t>(std::count_if(events.begin(), events.end(), belongs)),
          static_cast<std::size_t>(std::count_if(kept.begin(), kept.end(), belongs))};
}

TEST_CASE("flicker: of a lamp on the mains 95 % go, of an edge that moves beside it nothing") {
  for (const double hz : {100.0, 120.0, 99.6, 120.5}) {
    for (const std::uint32_t window_us : {1000U, 100'000U}) {
      Rng rng(5);
      std::vector<Event> events;
      add_lamp(&rng, hz, 2'400'000, 20, 5, 45, 25, 20, &events);
      for (int pass = 0; pass < 12; ++pass) {
        add_edge(&rng, 190'000 * pass, 500 + 60 * pass, static_cast<std::uint8_t>(pass % 2), 45, 70, &events);
      }
      std::stable_sort(events.begin(), events.end(), is_earlier);
      const std::vector<Event> kept = Filter().run(events, window_us);
      const Share lamp = share_of(events, kept, [](const Event& e) { return e.y < 40; });
      const Share edge = share_of(events, kept, [](const Event& e) { return e.y >= 45; });
      CAPTURE(hz);
      CAPTURE(window_us);
      CHECK(lamp.dropped() >= 0.95);
      CHECK(edge.dropped() <= 0.05);
    }
  }
}

TEST_CASE("flicker: an edge that crosses a lamp keeps two thirds of its events") {
  Rng rng(6);
  std::vector<Event> lamp;
  add_lamp(&rng, 100, 2'000'000, 20, 5, 60, 40, 20, &lamp);
  std::vector<Event> edge;
  for (int pass = 2; pass < 12; ++pass) {
    add_edge(&rng, 150'000 * pass + 777 * pass, 500 + 60 * pass, static_cast<std::uint8_t>(pass % 2), 5, 40, &edge);
  }
  std::vector<Event> events = lamp;
  events.insert(events.end(), edge.begin(), edge.end());
  std::stable_sort(events.begin(), events.end(), is_earlier);
  // Which of two equal events was kept matters to nobody: the edge's share is what is more than of the lamp alone.
  std::stable_sort(lamp.begin(), lamp.end(), is_earlier);
  const std::size_t with_edge = Filter().run(events, 9000).size();
  const std::size_t alone = Filter().run(lamp, 9000).size();
  CHECK(static_cast<double>(with_edge - alone) > 0.66 * static_cast<double>(edge.size()));
}

TEST_CASE("flicker: a checkerboard that sweeps past at the mains' rate stays") {
  for (const int period_px : {8, 16, 32, 40}) {  // of two squares, so each pixel alternates at exactly 100 Hz
    Rng rng(7);
    std::vector<Event> events;
    for (std::uint16_t y = 0; y < kHeight; ++y) {
      for (std::uint16_t x = 0; x < kWidth; ++x) {
        for (int half = 0; half < 60; ++half) {
          const int row = y / (period_px / 2) % 2;
          const auto t_us = std::int64_t{half} * 5000 + x * 10'000 / period_px + rng.below(300);
          events.push_back({t_us, x, y, static_cast<std::uint8_t>((half + row) % 2)});
        }
      }
    }
    std::stable_sort(events.begin(), events.end(), is_earlier);
    CAPTURE(period_px);
    const std::vector<Event> kept = Filter().run(events, 9000);
    CHECK(kept.size() > events.size() * 95 / 100);
  }
}

TEST_CASE("flicker: edges that vibrate with the mains stay") {
  for (const bool is_slanted : {false, true}) {
    Rng rng(8);
    std::vector<Event> events;
    for (std::uint16_t y = 0; y < kHeight; ++y) {
      for (int half = 0; half < 200; ++half) {  // over two pixels to and fro
        for (const int step : {0, 1}) {
          const int x = 40 + (is_slanted ? y / 3 : 0) + (half % 2 == 0 ? step : 1 - step);
          const auto t_us = std::int64_t{half} * 5000 + step * 2000 + rng.below(500);
          events.push_back({t_us, static_cast<std::uint16_t>(x), y, static_cast<std::uint8_t>(half % 2)});
        }
      }
    }
    std::stable_sort(events.begin(), events.end(), is_earlier);
    CHECK(Filter().run(events, 9000) == events);
  }
}

TEST_CASE("flicker: what flickers at other rates, and noise, stay") {
  for (const double hz : {30.0, 60.0, 85.0, 144.0}) {
    Rng rng(9);
    std::vector<Event> events;
    add_lamp(&rng, hz, 500'000, 20, 5, 45, 25, 20, &events);
    std::stable_sort(events.begin(), events.end(), is_earlier);
    CAPTURE(hz);
    CHECK(Filter().run(events, 9000).size() > events.size() * 95 / 100);
  }
  Rng rng(10);
  std::vector<Event> events;
  for (int i = 0; i < 200'000; ++i) {  // 36 Hz per pixel
    const auto t_us = static_cast<std::int64_t>(rng.below(1'000'000));
    const auto x = static_cast<std::uint16_t>(rng.below(kWidth));
    const auto y = static_cast<std::uint16_t>(rng.below(kHeight));
    events.push_back({t_us, x, y, static_cast<std::uint8_t>(rng.below(2))});
  }
  std::stable_sort(events.begin(), events.end(), is_earlier);
  CHECK(Filter().run(events, 9000).size() > events.size() * 999 / 1000);
}

/// The definition, event by event, with times and counts in maps that forget nothing.
class Oracle {
 public:
  explicit Oracle(std::int64_t start_us) : start_us_(start_us) {}

  bool is_flicker(const Event& event) {
    bool stands_out = false;
    for (const int light : {0, 1}) {
      const std::int64_t slot = (event.t_us - start_us_) * 6 / (light == 0 ? 3750 : 3125);
      for (std::int64_t beside = 15; beside <= 17; ++beside) {
        int periods = 0;
        for (std::int64_t ago = 1; ago <= 8; ++ago) {
          periods += stood_out(light, event, slot / 16 * 16 - 16 * ago + (slot + beside) % 16) ? 1 : 0;
        }
        stands_out = stands_out || periods >= kMinPeriods;
      }
      ++counts_[key(light, event, slot)];
    }
    if (!stands_out) return false;
    const std::int64_t now = unit(event);
    std::pair<std::int64_t, bool>* const last = fired(event.x, event.y, now);
    if (last == nullptr) {
      if (now % 128 == 0) return false;
      fired_[{event.x, event.y}] = {now, false};
    } else if (now - last->first >= 2) {
      *last = {now, true};
    }
    if (!fired_[{event.x, event.y}].second) return false;
    int around = 0;
    for (const int dy : {-4, 0, 4}) {
      for (const int dx : {-4, 0, 4}) {
        const int x = event.x + dx >= 0 && event.x + dx < kWidth ? event.x + dx : event.x - dx;
        const int y = event.y + dy >= 0 && event.y + dy < kHeight ? event.y + dy : event.y - dy;
        around += fired(x, y, now) != nullptr ? 1 : 0;
      }
    }
    return around >= 4;
  }

 private:
  using Key = std::tuple<int, int, int, std::int64_t>;
  static Key key(int light, const Event& event, std::int64_t slot) {
    return {2 * light + event.polarity, event.x / 32, event.y / 32, slot};
  }
  [[nodiscard]] std::int64_t unit(const Event& event) const { return (event.t_us - start_us_) / 2048; }
  [[nodiscard]] int count(const Key& at) const {
    const auto found = counts_.find(at);
    return found == counts_.end() ? 0 : std::min(found->second, 255);
  }
  /// Of a period that is over.
  bool stood_out(int light, const Event& event, std::int64_t slot) {
    if (slot < 0) return false;
    const auto known = stood_out_.find(key(light, event, slot));
    if (known != stood_out_.end()) return known->second;
    return stood_out_[key(light, event, slot)] = judge(light, event, slot);
  }
  [[nodiscard]] bool judge(int light, const Event& event, std::int64_t slot) const {
    const auto count_at = [&](std::int64_t i) {
      return static_cast<double>(count(key(light, event, slot / 16 * 16 + (i + 32) % 16)));
    };
    double mean = 0;
    for (std::int64_t i = 0; i < 16; ++i) mean += count_at(i) / 16;
    if (count_at(slot) <= mean) return false;
    bool found = false;
    for (std::int64_t middle = slot % 16 - 2; middle <= slot % 16 + 2; ++middle) {
      double run = 0;
      for (std::int64_t i = middle - 2; i <= middle + 2; ++i) run += count_at(i);
      found = found || run > 1.75 * 5 * mean + 3;
    }
    return found;
  }
  /// When the pixel's last burst began, unless it is forgotten.
  std::pair<std::int64_t, bool>* fired(int x, int y, std::int64_t now) {
    const auto found = fired_.find({x, y});
    if (found == fired_.end() || now - found->second.first > 64) return nullptr;
    return &found->second;
  }

  std::int64_t start_us_;
  std::map<Key, int> counts_;
  std::map<Key, bool> stood_out_;
  std::map<std::pair<int, int>, std::pair<std::int64_t, bool>> fired_;
};

TEST_CASE("flicker: random events and lamps go as brute force says") {
  for (const std::uint64_t seed : {11U, 12U}) {
    Rng rng(seed);
    std::vector<Event> events;
    add_lamp(&rng, 100, 400'000, 0, 0, 20, 15, 3, &events);
    add_lamp(&rng, 120, 500'000, 60, 50, 80, 70, 2, &events);
    add_edge(&rng, 90'000, 2000, 1, 10, 50, &events);
    for (int i = 0; i < 10'000; ++i) {
      const auto t_us = static_cast<std::int64_t>(rng.below(500'000));
      const auto x = static_cast<std::uint16_t>(rng.below(kWidth));
      const auto y = static_cast<std::uint16_t>(rng.below(kHeight));
      events.push_back({t_us, x, y, static_cast<std::uint8_t>(rng.below(2))});
    }
    std::stable_sort(events.begin(), events.end(), is_earlier);
    for (Event& event : events) event.t_us -= 200'000;
    Oracle oracle(events[0].t_us);
    std::vector<Event> expected;
    std::size_t of_lamps = 0;
    for (const Event& event : events) {
      const bool goes = oracle.is_flicker(event);
      if (!goes) expected.push_back(event);
      of_lamps += goes ? 1U : 0U;
    }
    CHECK(of_lamps > events.size() / 4);
    CHECK(Filter().run(events, 9000, seed) == expected);
  }
}

TEST_CASE("flicker: pauses, steps back in time and restart() forget the lamp, disorder does not") {
  Rng rng(14);
  std::vector<Event> events;
  add_lamp(&rng, 100, 200'000, 20, 5, 60, 40, 20, &events);
  std::stable_sort(events.begin(), events.end(), is_earlier);
  Filter fresh;
  const std::vector<Event> kept = fresh.run(events, 9000);
  CHECK(kept.size() < events.size() / 2);
  CHECK(fresh.run(events, 9000) == kept);  // 200 ms back
  std::vector<Event> later = events;
  for (Event& event : later) event.t_us += 300'000;  // after a pause of 100 ms
  std::vector<Event> expected = kept;
  for (Event& event : expected) event.t_us += 300'000;
  CHECK(fresh.run(later, 9000) == expected);
  for (Event& event : later) event.t_us += 200'000;
  CHECK(fresh.run(later, 9000).size() < events.size() / 10);
  for (Event& event : later) event.t_us += 200'000;
  for (Event& event : expected) event.t_us += 400'000;
  fresh.filter().restart();
  CHECK(fresh.run(later, 9000) == expected);

  for (std::size_t i = 1; i < events.size(); i += 2) std::swap(events[i - 1], events[i]);
  CHECK(Filter().run(events, 9000).size() < events.size() / 2);
}

TEST_CASE("flicker: a step back within 8 ms stops the clock, no more") {
  Rng rng(15);
  std::vector<Event> events;
  add_lamp(&rng, 100, 200'000, 20, 5, 60, 40, 20, &events);
  std::stable_sort(events.begin(), events.end(), is_earlier);
  Filter filter;
  (void)filter.run(events, 9000);
  std::vector<Event> late{{events.back().t_us - 8192, 30, 20, 0}, {events.back().t_us, 31, 20, 0}};
  CHECK(filter.filter().drop(late, kMinPeriods) <= 2);
  std::vector<Event> more = events;
  for (Event& event : more) event.t_us += 200'000;
  CHECK(filter.run(more, 9000).size() < events.size() / 10);
}

TEST_CASE("flicker: memory is carved to the byte, and its size known") {
  for (std::uint16_t width = 1; width <= 97; width = static_cast<std::uint16_t>(width + 32)) {
    ArenaMeter meter;
    FlickerFilter filter;
    REQUIRE(filter.carve(meter, width, 40));
    CHECK(meter.peak() == width * 40U + 136U * ((width + 31U) / 32U) * 2U);
    GuardedArena exact(meter.peak());
    CHECK(filter.carve(exact.arena(), width, 40));
    CHECK(filter.holds(width, 40));
    CHECK_FALSE(filter.holds(static_cast<std::uint16_t>(width + 1), 40));
    CHECK_FALSE(filter.holds(width, 41));
    GuardedArena short_of_one(meter.peak() - 1);
    CHECK_FALSE(filter.carve(short_of_one.arena(), width, 40));
    CHECK_FALSE(filter.holds(width, 40));
  }
  CHECK_FALSE(FlickerFilter().holds(1, 1));
}

TEST_CASE("flicker: a sensor smaller than the ring, and times at either end, do no harm") {
  FlickerFilter filter;
  ArenaMeter meter;
  REQUIRE(filter.carve(meter, 3, 2));
  GuardedArena memory(meter.peak());
  REQUIRE(filter.carve(memory.arena(), 3, 2));
  std::vector<Event> events{{INT64_MIN, 0, 0, 1}, {0, 2, 1, 1}, {INT64_MAX, 1, 1, 0}, {INT64_MIN, 2, 0, 1}};
  CHECK(filter.drop(events, kMinPeriods) == 4);
  CHECK(filter.drop({}, kMinPeriods) == 0);
  std::vector<Event> lamp;
  for (int half = 0; half < 100; ++half) {
    for (std::int64_t i = 0; i < 12; ++i) {
      lamp.push_back({half * 5000 + i / 3, static_cast<std::uint16_t>(i % 3), static_cast<std::uint16_t>(i / 3 % 2),
                      static_cast<std::uint8_t>(half % 2)});
    }
  }
  CHECK(filter.drop(lamp, kMinPeriods) < lamp.size() / 4);
}

}  // namespace
}  // namespace lecalib::test
