// SPDX-License-Identifier: MIT
/// Events of a blurred step edge that moves across the pixels of an ideal event sensor, in closed form.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "lecalib/core/records.hpp"
#include "lecalib/core/rng.hpp"
#include "support/moving_edges.hpp"

namespace lecalib::test {

/// The edge's points are those with (x - centre) . normal = speed t, t = 0 at mid window; it is dark in the direction
/// of the normal.
struct StepEdge {
  double centre_x = 170, centre_y = 130;  ///< px, at mid window
  double angle = 0.3;                     ///< of the normal, rad
  double speed_px_per_s = 600;
  double half_length_px = 90;
  double contrast = 3;  ///< bright over dark
  double blur_px = 0.5;

  [[nodiscard]] double across(double x, double y) const {
    return (x - centre_x) * std::cos(angle) + (y - centre_y) * std::sin(angle);
  }
  [[nodiscard]] double along(double x, double y) const {
    return (y - centre_y) * std::cos(angle) - (x - centre_x) * std::sin(angle);
  }
  /// ln of the intensity at a distance in front of the edge, towards the dark.
  [[nodiscard]] double log_intensity(double distance_px) const {
    const double bright = 0.5 * std::erfc(distance_px / (blur_px * std::sqrt(2.0)));
    return std::log(1 + (contrast - 1) * bright);
  }
  /// Where ln of the intensity has a value between those of the two sides.
  [[nodiscard]] double distance_of(double log_value) const {
    double low = -6 * blur_px;
    double high = 6 * blur_px;
    for (int i = 0; i < 30; ++i) {
      const double middle = 0.5 * (low + high);
      (log_intensity(middle) > log_value ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }
};

/// Each pixel fires when ln(intensity) has changed by `threshold` since its last event. That was of the other polarity,
/// at a level that lies anywhere within one threshold of where the intensity has settled since.
inline std::vector<Event> events_of(const StepEdge& edge, const SceneOptions& scene, double threshold,
                                    std::uint64_t seed = 1) {
  Rng rng(seed);
  std::vector<Event> events;
  const double half_s = 0.5e-6 * static_cast<double>(scene.length_us);
  const bool on = edge.speed_px_per_s > 0;  // the bright side comes
  const double from = on ? 0.0 : std::log(edge.contrast);
  const double reach_px = std::fabs(edge.speed_px_per_s) * half_s + 6 * edge.blur_px;
  for (int y = 0; y < scene.height; ++y) {
    for (int x = 0; x < scene.width; ++x) {
      if (std::fabs(edge.along(x, y)) > edge.half_length_px || std::fabs(edge.across(x, y)) > reach_px) continue;
      const double left_over = threshold * rng.uniform();
      for (int k = 1;; ++k) {
        const double step = left_over + k * threshold;
        if (step >= std::log(edge.contrast)) break;
        // The pixel is `distance` in front of the edge when it fires.
        const double distance = edge.distance_of(on ? from + step : from - step);
        const double t = (edge.across(x, y) - distance) / edge.speed_px_per_s;
        if (std::fabs(t) >= half_s) continue;
        push_event((t + half_s) * 1e6, x, y, on ? 1 : 0, scene, &events);
      }
    }
  }
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.t_us < b.t_us; });
  return events;
}

}  // namespace lecalib::test
