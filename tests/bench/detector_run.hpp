// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "bench/quality.hpp"
#include "bench/scenes.hpp"
#include "lecalib/host/error.hpp"
#include "lecalib/pipeline/line_detector.hpp"

namespace lecalib::bench {

/// What detection costs and gives.
struct Measurement {
  double events = 0;
  double total_ns = 0;
  double stage_ns[kNumDetectorStages] = {};
  double bytes_per_event = 0;  ///< of the arena, by event of capacity
  Quality quality;
};

/// Bytes of the arena that a detector of this capacity needs.
std::size_t arena_bytes(LineFinder finder, std::size_t events, std::uint16_t width, std::uint16_t height);

/// Detects the lines of each scene. Times are CPU times, for each scene those of the fastest of `repeats` runs: what
/// else the machine does only adds. Ends the program when a detection fails.
/// @param scenes of one sensor
/// @param capacity events that the detector holds; it thins what is more
Measurement measure(const std::vector<Scene>& scenes, LineFinder finder, std::size_t capacity, int repeats);

/// A recording from its bytes to its lines.
struct Throughput {
  double events = 0, lines = 0, windows = 0;
  double read_ns = 0, decode_ns = 0, window_ns = 0, detect_ns = 0;  ///< CPU time
};

/// With windows that follow the motion, as `lecalib detect` does it.
/// @param sensor "640x480"; may be empty when the file states it
host::Result<Throughput> measure_recording(const std::string& path, const std::string& sensor, LineFinder finder);

}  // namespace lecalib::bench
