// SPDX-License-Identifier: MIT
#pragma once

#include <doctest/doctest.h>

#include <vector>

#include "lecalib/planes/cloud.hpp"
#include "support/moving_edges.hpp"

namespace lecalib::test {

/// The cloud of a scene's events, with its memory.
class CloudOf {
 public:
  CloudOf(const SceneOptions& scene, const std::vector<Event>& events)
      : x_(events.size() + 1),
        y_(events.size() + 1),
        t_(events.size() + 1),
        cell_start_(2 * cloud_cells(scene.width, scene.height) + 1) {
    CloudOptions options;
    options.width = scene.width;
    options.height = scene.height;
    const CloudWorkspace workspace{x_, y_, t_, cell_start_};
    REQUIRE(build_cloud(window_of(scene, events), options, workspace, &cloud, nullptr) == Status::ok);
  }
  CloudOf(const CloudOf&) = delete;
  CloudOf& operator=(const CloudOf&) = delete;

  EventCloud cloud;

 private:
  std::vector<std::uint16_t> x_, y_, t_;
  std::vector<std::uint32_t> cell_start_;
};

}  // namespace lecalib::test
