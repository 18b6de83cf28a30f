// SPDX-License-Identifier: MIT
#pragma once

#include <doctest/doctest.h>

#include <vector>

#include "lecalib/match/line_matcher.hpp"
#include "synthetic_scene.hpp"

namespace lecalib::test {

inline std::size_t bytes_of(const LineMatcherCapacities& capacities) {
  ArenaMeter meter;
  LineMatcherWorkspace workspace;
  CHECK(carve(meter, capacities, &workspace));
  return meter.peak();
}

/// A matcher with memory of its own.
struct Bench {
  explicit Bench(const LineMatcherCapacities& c = {})
      : capacities(c), memory(bytes_of(c) / sizeof(std::max_align_t) + 1) {}

  Status init(const Scene& scene, const SceneOptions& options, const MatchHints& hints = {}, bool provisional = false) {
    arena = Arena({reinterpret_cast<std::byte*>(memory.data()), memory.size() * sizeof(std::max_align_t)});
    LineMatcherOptions matcher_options;
    matcher_options.width = options.camera.width;
    matcher_options.height = options.camera.height;
    matcher_options.hints = hints;
    matcher_options.provisional = provisional;
    return matcher.init(&arena, capacities, matcher_options, Span<const ModelLine>(options.model),
                        Span<const LineWindow>(scene.windows));
  }
  Status run() {
    Status status = Status::in_progress;
    for (int step = 0; step < 1000000 && status == Status::in_progress; ++step) status = matcher.step();
    return status;
  }

  LineMatcherCapacities capacities;
  std::vector<std::max_align_t> memory;
  Arena arena;
  LineMatcher matcher;
};

inline Camera camera_640() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = 520.0;
  camera.fy = 523.0;
  camera.cx = 338.0;  // 18.5 px beside the centre
  camera.cy = 228.0;
  camera.k1 = -0.2;
  camera.k2 = 0.04;
  return camera;
}

}  // namespace lecalib::test
