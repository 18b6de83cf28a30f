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
        z_(events.size() + 1),
        cell_start_(2 * cloud_cells(scene.width, scene.height) + 1) {
    CloudOptions options;
    options.width = scene.width;
    options.height = scene.height;
    const CloudWorkspace workspace{x_, y_, z_, cell_start_};
    REQUIRE(build_cloud(window_of(scene, events), options, workspace, &cloud, nullptr) == Status::ok);
  }
  CloudOf(const CloudOf&) = delete;
  CloudOf& operator=(const CloudOf&) = delete;

  EventCloud cloud;

 private:
  std::vector<float> x_, y_, z_;
  std::vector<std::uint32_t> cell_start_;
};

}  // namespace lecalib::test
