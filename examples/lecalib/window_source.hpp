// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "lecalib/events/window_builder.hpp"
#include "lecalib/host/event_file.hpp"

namespace lecalib::command {

/// Which events of a recording are looked at, and how they are cut into windows.
struct WindowRange {
  std::optional<std::int64_t> window_us;  ///< length of the windows, > 0
  std::optional<std::int64_t> from_us;    ///< events from this time of the recording on
  std::optional<std::int64_t> to_us;      ///< events before this time, > from_us

  /// Both ends are given and no length: the range is the one window.
  [[nodiscard]] bool is_one_window() const { return from_us && to_us && !window_us; }
  /// The length is to follow the motion.
  [[nodiscard]] bool is_adaptive() const { return !window_us && !is_one_window(); }
};

/// Cuts the events of a file into windows.
class WindowSource {
 public:
  /// @param max_rate_per_s, storage  a window's events beyond what either allows are thinned; no limit to the rate: 0
  WindowSource(host::EventFile* file, const WindowRange& range, std::uint32_t max_rate_per_s, Span<Event> storage);

  /// @return false when there is no further window.
  bool next(EventWindow* window);

  /// Length of the windows that are still to begin.
  void set_length_us(std::int64_t length_us) { (void)builder_.set_length_us(length_us); }
  [[nodiscard]] const WindowStats& stats() const { return builder_.stats(); }
  /// Spent in cutting, without reading and decoding.
  [[nodiscard]] std::uint64_t cpu_ns() const { return cpu_ns_; }

 private:
  void read();

  host::EventFile* file_;
  WindowRange range_;
  WindowBuilder builder_;
  std::vector<Event> in_range_;
  Span<const Event> events_;
  bool at_end_ = false;
  std::uint64_t cpu_ns_ = 0;
};

}  // namespace lecalib::command
