// SPDX-License-Identifier: MIT
/// Events of straight edges that move across an image, and noise: a window whose lines are known.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "lecalib/core/records.hpp"
#include "lecalib/core/rng.hpp"

namespace lecalib::test {

/// An edge by its end points at the window's begin and end; in between they move evenly.
struct MovingEdge {
  Segment begin, end;
  std::uint8_t polarity = 1;
};

struct SceneOptions {
  std::uint16_t width = 346, height = 260;
  std::int64_t begin_us = 1000000, length_us = 10000;
  double events_per_px = 6;  ///< of edge and window
  double noise_px = 0.4;     ///< one sigma across the edge, before rounding to pixels
  std::size_t noise_events = 0;
};

/// A standard normal value as a sum of twelve uniform ones.
inline double normal(Rng* rng) {
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += rng->uniform();
  return sum;
}

inline void push_event(double t_us, double x, double y, std::uint8_t polarity, const SceneOptions& scene,
                       std::vector<Event>* events) {
  const double px = std::floor(x + 0.5);
  const double py = std::floor(y + 0.5);
  if (px < 0 || py < 0 || px >= scene.width || py >= scene.height) return;
  events->push_back({scene.begin_us + static_cast<std::int64_t>(t_us), static_cast<std::uint16_t>(px),
                     static_cast<std::uint16_t>(py), polarity});
}

/// The scene's events in order of time.
inline std::vector<Event> make_events(const std::vector<MovingEdge>& edges, const SceneOptions& scene,
                                      std::uint64_t seed = 1) {
  Rng rng(seed);
  std::vector<Event> events;
  for (const MovingEdge& edge : edges) {
    const Segment& a = edge.begin;
    const Segment& b = edge.end;
    const double length = std::hypot(double{a.x2} - double{a.x1}, double{a.y2} - double{a.y1});
    const double nx = -(double{a.y2} - double{a.y1}) / length;
    const double ny = (double{a.x2} - double{a.x1}) / length;
    const auto count = static_cast<std::size_t>(length * scene.events_per_px);
    for (std::size_t i = 0; i < count; ++i) {
      const double s = rng.uniform();
      const double t = rng.uniform();
      const double d = scene.noise_px * normal(&rng);
      const auto mix = [&](float a1, float a2, float b1, float b2) {
        return (1 - t) * ((1 - s) * double{a1} + s * double{a2}) + t * ((1 - s) * double{b1} + s * double{b2});
      };
      push_event(t * static_cast<double>(scene.length_us), mix(a.x1, a.x2, b.x1, b.x2) + d * nx,
                 mix(a.y1, a.y2, b.y1, b.y2) + d * ny, edge.polarity, scene, &events);
    }
  }
  for (std::size_t i = 0; i < scene.noise_events; ++i) {
    const double t = rng.uniform(0, static_cast<double>(scene.length_us));
    const double x = rng.uniform(0, scene.width - 1);
    const double y = rng.uniform(0, scene.height - 1);
    push_event(t, x, y, static_cast<std::uint8_t>(rng.below(2)), scene, &events);
  }
  std::stable_sort(events.begin(), events.end(), [](const Event& p, const Event& q) { return p.t_us < q.t_us; });
  return events;
}

inline EventWindow window_of(const SceneOptions& scene, const std::vector<Event>& events) {
  return {scene.begin_us, scene.begin_us + scene.length_us, {events.data(), events.size()}};
}

/// Mean distance of `found`'s end points from the line through `truth`, px; -1 when the two differ by more than 5
/// degrees or `found` covers less than half of `truth`.
inline double distance_between(const Segment& found, const Segment& truth) {
  const double tx = double{truth.x2} - double{truth.x1};
  const double ty = double{truth.y2} - double{truth.y1};
  const double length = std::hypot(tx, ty);
  const double fx = double{found.x2} - double{found.x1};
  const double fy = double{found.y2} - double{found.y1};
  if (std::fabs(fx * tx + fy * ty) < 0.996 * length * std::hypot(fx, fy)) return -1;
  const auto along = [&](float x, float y) {
    return ((double{x} - double{truth.x1}) * tx + (double{y} - double{truth.y1}) * ty) / length;
  };
  const auto across = [&](float x, float y) {
    return std::fabs((double{y} - double{truth.y1}) * tx - (double{x} - double{truth.x1}) * ty) / length;
  };
  const double low = std::min(along(found.x1, found.y1), along(found.x2, found.y2));
  const double high = std::max(along(found.x1, found.y1), along(found.x2, found.y2));
  if (std::min(high, length) - std::max(low, 0.0) < 0.5 * length) return -1;
  return 0.5 * (across(found.x1, found.y1) + across(found.x2, found.y2));
}

}  // namespace lecalib::test
