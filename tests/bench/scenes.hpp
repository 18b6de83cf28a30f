// SPDX-License-Identifier: MIT
/// Windows whose lines are known, and windows that are as costly as possible.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "lecalib/core/records.hpp"

namespace lecalib::bench {

struct Pixel {
  double x, y;
};
/// Points along a curve of the image, px.
using Curve = std::vector<Pixel>;

/// The image of a model line at both ends of a window.
struct TrueLine {
  Curve begin, end;
};

struct Scene {
  std::string name;
  std::uint16_t width = 640, height = 480;
  std::int64_t length_us = 50'000;  ///< the window begins at 0
  std::vector<Event> events;        ///< in order of time
  std::vector<TrueLine> lines;      ///< none: nobody knows

  [[nodiscard]] EventWindow window() const { return {0, length_us, {events.data(), events.size()}}; }
};

/// The event clusters of [Liu24] section 4.1.
struct ClusterOptions {
  std::size_t lines = 10;
  std::size_t events = 100'000;  ///< with noise
  double noise_share = 0.1;      ///< of the events
  double sigma_px = 1;           ///< of both coordinates
  double k1 = 0, k2 = 0;         ///< radial distortion
  std::uint64_t seed = 1;
};

/// Segments on one plane, 5 to 10 m away across the view of a pinhole camera (f = 400 px, 640x480), that turn about the
/// optical axis by 1 rad/s and move by (1, 1, 0) m/s for 50 ms. A line has one polarity and events in proportion to its
/// length, evenly in time. Pixels are whole.
Scene make_cluster(const ClusterOptions& options);

/// Events anywhere at any time.
Scene make_texture(std::size_t events);

/// Edges too short to be lines, 24 px, anywhere in any direction, that move by 5 px: seeds without end.
Scene make_short_edges(std::size_t events);

/// Every pixel in turn, row by row, as often as it takes.
Scene make_pixels_in_turn(std::size_t events);

/// Rows and columns of edges, 16 px apart, of alternating polarity, that move by 5 px in the diagonal.
Scene make_dense_grid(std::size_t events);

}  // namespace lecalib::bench
