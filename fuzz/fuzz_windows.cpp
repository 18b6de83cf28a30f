// SPDX-License-Identifier: MIT
// Events of any content and order, 16 bytes each after 4 bytes of options, through windows and noise filter.
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "lecalib/core/arena.hpp"
#include "lecalib/events/noise_filter.hpp"
#include "lecalib/events/window_builder.hpp"

using namespace lecalib;

namespace {

constexpr std::uint16_t kWidth = 20;
constexpr std::uint16_t kHeight = 10;

void check(bool condition) {
  if (!condition) std::abort();
}

std::size_t filter(const EventWindow& window, std::uint8_t option, NoiseFilterWorkspace* workspace,
                   Span<Event> storage) {
  NoiseFilterOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.flicker_periods = option % 9;
  options.hot_min_events = option % 4;
  options.min_neighbours = option / 4 % 4;
  options.refractory_us = option / 16;
  NoiseFilterStats stats;
  EventWindow filtered;
  check(filter_noise(window, options, workspace, storage, &filtered, &stats) == Status::ok);
  check(stats.events == stats.kept + stats.outside + stats.flicker + stats.hot + stats.refractory + stats.isolated);
  return filtered.events.size();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 4) return 0;
  Event storage[10];
  alignas(kArenaAlign) static std::byte bytes[1024];
  Arena arena({bytes, sizeof bytes});
  NoiseFilterWorkspace workspace;
  check(carve(arena, NoiseFilterCapacities{kWidth, kHeight}, &workspace));
  WindowBuilder builder;
  WindowOptions options;
  options.length_us = data[0];
  options.max_events = data[1];
  options.disorder_us = data[2];
  if (builder.init(options, storage) != Status::ok) return 0;

  std::uint64_t given = 0;
  std::uint64_t handed_out = 0;
  EventWindow window;
  const auto take = [&] {
    check(window.begin_us <= window.end_us && window.events.size() <= 10);
    handed_out += window.events.size();
    check(filter(window, data[3], &workspace, storage) <= window.events.size());
  };
  for (std::size_t at = 4; at + 16 <= size; at += 16) {
    Event event{};
    std::memcpy(&event.t_us, data + at, sizeof event.t_us);
    event.x = data[at + 8];
    event.y = data[at + 9];
    event.polarity = data[at + 10] % 2;
    Span<const Event> input(&event, 1);
    while (builder.push(&input, &window) == Status::ok) take();
    check(input.empty());
    ++given;
  }
  if (builder.finish(&window) == Status::ok) take();
  const WindowStats& stats = builder.stats();
  check(given == stats.events + stats.backward);
  check(stats.events == handed_out + stats.thinned);
  return 0;
}
