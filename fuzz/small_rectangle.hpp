// SPDX-License-Identifier: MIT
// What the targets share that go from bytes to cameras: a small object, a calibrator that is soon full, a recording.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "lecalib/core/records.hpp"
#include "lecalib/events/event_stream.hpp"
#include "lecalib/pipeline/capacities.hpp"

namespace lecalib::fuzz {

inline constexpr Capacities kCapacities = [] {
  Capacities capacities;
  capacities.events_per_window = 2000;
  capacities.lines_per_window = 12;
  capacities.windows = 12;
  capacities.model_lines = 4;
  capacities.sensor_width = 64;
  capacities.sensor_height = 48;
  return capacities;
}();

// A rectangle, metres.
inline constexpr ModelLine kModel[] = {{{-0.15, -0.1, 0}, {0.15, -0.1, 0}},
                                       {{0.15, -0.1, 0}, {0.15, 0.1, 0}},
                                       {{0.15, 0.1, 0}, {-0.15, 0.1, 0}},
                                       {{-0.15, 0.1, 0}, {-0.15, -0.1, 0}}};

// More than the stages' own limits allow for so small a problem: beyond it something runs in circles.
inline constexpr int kManySteps = 1000000;

inline void check(bool condition) {
  if (!condition) std::abort();
}

/// Hands on the events of a recording, as far as it can be read.
template <class Push>
void push_recording(Span<const std::uint8_t> bytes, const Push& push) {
  EventStreamDecoder decoder;
  Event events[256];
  std::size_t count = 0;
  Status status = Status::ok;
  while (!bytes.empty() && !is_error(status)) {
    status = decoder.decode(&bytes, events, &count);
    push(Span<const Event>(events, count));
  }
  (void)decoder.finish(events, &count);
  push(Span<const Event>(events, count));
}

}  // namespace lecalib::fuzz
