// SPDX-License-Identifier: MIT
/// What the parts of `lecalib detect` share: the options, and the numbers that it reports.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "lecalib/events/noise_filter.hpp"
#include "lecalib/host/event_file.hpp"
#include "lecalib/pipeline/line_detector.hpp"
#include "window_source.hpp"

namespace lecalib::command {

struct DetectOptions {
  std::string events;
  std::string sensor;
  std::string out;
  std::string stats;
  std::string svg;
  std::optional<std::size_t> svg_window;
  WindowRange range;
  std::size_t max_events = 400'000;  // a line's place gains from more, and a host has the memory
  std::uint32_t max_rate_per_s = 0;  ///< 0: no limit
  std::string detector = "fast";
  double c_z_us_per_px = 0;  ///< 0: automatic
  bool filters_noise = false;

  [[nodiscard]] LineFinder find_lines() const { return detector == "fast" ? fast_detector : reference_detector; }
};

/// What happened over all windows.
struct DetectTotals {
  std::size_t lines = 0;
  std::size_t arena_bytes = 0;
  NoiseFilterStats noise;
  std::uint64_t noise_ns = 0;
  std::uint64_t detector_ns = 0;
  std::uint64_t stage_ns[kNumDetectorStages] = {};
  std::uint64_t guesses_dropped = 0;
  std::uint64_t lines_dropped = 0;

  void add(const DetectorStats& stats);
};

/// Finds the lines of the recording and writes the results. The options are known to make sense.
void detect_recording(const DetectOptions& options);

/// Counts, CPU time per event and stage, memory, and what was dropped.
std::string detect_stats_json(const host::EventFile& file, const WindowSource& windows, const DetectTotals& totals);

}  // namespace lecalib::command
