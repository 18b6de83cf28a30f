// SPDX-License-Identifier: MIT
/// From brightness to events: the pixels of an event camera.
#pragma once

#include <cstdint>
#include <vector>

#include "lecalib/core/records.hpp"
#include "lecalib/core/rng.hpp"

namespace lecalib::host {

/// Defaults are near a DAVIS346 in a lit room. "ln" is the natural logarithm of brightness.
struct SensorOptions {
  double threshold = 0.24;         ///< change of ln that makes an event, [0.05, 2]
  double threshold_spread = 0.03;  ///< one sigma between pixels, ln, [0, 1]
  double threshold_noise = 0.04;   ///< one sigma from event to event, ln, [0, 1]
  double bandwidth_hz = 400;       ///< of a pixel that sees a radiance of 0.5, [1, 1e6]; in the dark down to a tenth
  double refractory_us = 400;      ///< blind time after an event, [0, 1e6]
  double noise_hz = 1.4;           ///< events without cause, per pixel, [0, 1000]
  double hot_fraction = 5e-4;      ///< part of the pixels that fire without end, at 10 to 1500 Hz, [0, 0.1]
  double jitter_us = 30;           ///< one sigma of the time stamps, [0, 1e4]
};

struct SensorStats {
  std::uint64_t scene_events = 0;
  std::uint64_t noise_events = 0;
  std::uint64_t hot_events = 0;
};

/// Each pixel: ln(brightness), a first-order low-pass, a comparator on the change since the last event. Events are put
/// in between two frames where the low-passed signal crosses the threshold. Times are seconds from the sensor's start.
class EventSensor {
 public:
  EventSensor(std::uint16_t width, std::uint16_t height, const SensorOptions& options, std::uint64_t seed);

  /// Takes the first frame at time 0: all pixels at rest.
  void start(Span<const float> radiance);

  /// Goes on to the frame at end_s; ln(brightness) runs in a straight line from one frame to the next.
  /// @param changed the pixels whose radiance differs from the last frame's, each at most once
  /// @param events gets this step's events, not in order; t_us may leave the step by the jitter, but is never negative
  void advance(double end_s, Span<const float> radiance, Span<const std::uint32_t> changed, std::vector<Event>* events);

  [[nodiscard]] const SensorStats& stats() const { return stats_; }

 private:
  struct Pixel {
    double ready_s = -1;  ///< end of the blind time
    double log_before = 0, log_now = 0;
    double signal = 0;     ///< low-passed
    double reference = 0;  ///< the signal at the last event
    double on = 0, off = 0;
    double noise = 0;  ///< on this event's threshold
    bool active = false;
  };
  struct HotPixel {
    std::uint32_t pixel;
    double rate_hz, next_s;
  };

  void follow(std::uint32_t index, double end_s, std::vector<Event>* events);
  void cross(std::uint32_t index, double begin_s, double end_s, double end_signal, std::vector<Event>* events);
  void fire_noise(double end_s, std::vector<Event>* events);
  bool fire(std::uint32_t index, double t_s, bool on, std::vector<Event>* events);
  double normal();
  double waiting_s(double rate_hz);

  std::uint16_t width_;
  SensorOptions options_;
  Rng rng_;
  std::vector<Pixel> pixels_;
  std::vector<std::uint32_t> active_;
  std::vector<HotPixel> hot_;
  double now_s_ = 0;
  double next_noise_s_ = 0;
  SensorStats stats_;
};

}  // namespace lecalib::host
