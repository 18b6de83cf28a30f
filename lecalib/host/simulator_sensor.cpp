// SPDX-License-Identifier: MIT
#include "lecalib/host/simulator_sensor.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/host/exponential.hpp"
#include "lecalib/math/trigonometry.hpp"

namespace lecalib::host {
namespace {

constexpr double kSettled = 1e-3;           ///< of ln(brightness): a pixel this close to its input rests
constexpr double kMaxSubstep = 0.25e-3;     ///< s; between two of these the low-passed signal counts as straight
constexpr double kMinThreshold = 0.02;      ///< no mismatch or noise takes a threshold below this
constexpr double kBandwidthRadiance = 0.5;  ///< at which a pixel has SensorOptions::bandwidth_hz
constexpr double kDarkBandwidth = 0.1;      ///< part of the bandwidth that is left in the dark

}  // namespace

EventSensor::EventSensor(std::uint16_t width, std::uint16_t height, const SensorOptions& options, std::uint64_t seed)
    : width_(width), options_(options), rng_(seed), pixels_(std::size_t{width} * height) {
  for (Pixel& p : pixels_) {
    p.on = options.threshold + options.threshold_spread * normal();
    p.off = options.threshold + options.threshold_spread * normal();
    p.noise = options.threshold_noise * normal();
  }
  const auto hot =
      static_cast<std::size_t>(std::floor(options.hot_fraction * static_cast<double>(pixels_.size()) + 0.5));
  for (std::size_t i = 0; i < hot; ++i) {
    const std::uint32_t pixel = rng_.below(static_cast<std::uint32_t>(pixels_.size()));
    const double rate_hz = 10.0 * exponential(rng_.uniform(0.0, logarithm(150.0)));
    hot_.push_back({pixel, rate_hz, waiting_s(rate_hz)});
  }
  next_noise_s_ = waiting_s(options.noise_hz * static_cast<double>(pixels_.size()));
}

void EventSensor::start(Span<const float> radiance) {
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    Pixel& p = pixels_[i];
    p.log_before = p.log_now = p.signal = p.reference = logarithm(static_cast<double>(radiance[i]));
  }
}

void EventSensor::advance(double end_s, Span<const float> radiance, Span<const std::uint32_t> changed,
                          std::vector<Event>* events) {
  for (const std::uint32_t index : changed) {
    Pixel& p = pixels_[index];
    p.log_now = logarithm(static_cast<double>(radiance[index]));
    if (p.active || p.log_now == p.log_before) continue;
    p.active = true;
    active_.push_back(index);
  }
  std::size_t kept = 0;
  for (const std::uint32_t index : active_) {
    follow(index, end_s, events);
    Pixel& p = pixels_[index];
    p.log_before = p.log_now;
    p.active = std::abs(p.signal - p.log_now) > kSettled || p.ready_s > end_s;
    if (p.active) active_[kept++] = index;
  }
  active_.resize(kept);
  fire_noise(end_s, events);
  now_s_ = end_s;
}

/// The low-pass y' = (x - y) / tau has a closed form for an input that runs in a straight line, x = x0 + g t:
/// y(t) = x(t) - g tau + (y0 - x0 + g tau) exp(-t / tau).
void EventSensor::follow(std::uint32_t index, double end_s, std::vector<Event>* events) {
  Pixel& p = pixels_[index];
  const double dt = end_s - now_s_;
  const double brightness = exponential(0.5 * (p.log_before + p.log_now)) / kBandwidthRadiance;
  const double bandwidth_hz = options_.bandwidth_hz * std::max(brightness, kDarkBandwidth);
  const double tau = 1.0 / (2.0 * kPi * bandwidth_hz);
  const int substeps = std::max(1, static_cast<int>(std::ceil(dt / kMaxSubstep)));
  const double h = dt / substeps;
  const double decay = exponential(-h / tau);
  const double slope = (p.log_now - p.log_before) / dt;
  for (int i = 0; i < substeps; ++i) {
    const double input = p.log_before + slope * h * i;
    const double signal = input + slope * h - slope * tau + (p.signal - input + slope * tau) * decay;
    cross(index, now_s_ + h * i, now_s_ + h * (i + 1), signal, events);
    p.signal = signal;
  }
}

/// Events while the signal runs in a straight line from p.signal at begin_s to end_signal at end_s.
void EventSensor::cross(std::uint32_t index, double begin_s, double end_s, double end_signal,
                        std::vector<Event>* events) {
  Pixel& p = pixels_[index];
  const double rate = (end_signal - p.signal) / (end_s - begin_s);
  double at_s = begin_s;
  double signal = p.signal;
  for (;;) {
    if (p.ready_s > at_s) {
      if (p.ready_s >= end_s) return;
      signal += rate * (p.ready_s - at_s);
      at_s = p.ready_s;
      p.reference = signal;
    }
    const bool on = rate > 0;
    const double threshold = std::max(kMinThreshold, (on ? p.on : p.off) + p.noise);
    const double level = p.reference + (on ? threshold : -threshold);
    if (rate == 0 || (on ? end_signal < level : end_signal > level)) return;
    const double crossing_s = std::clamp(at_s + (level - signal) / rate, at_s, end_s);
    signal = level;
    at_s = crossing_s;
    p.reference = level;
    if (fire(index, crossing_s, on, events)) ++stats_.scene_events;
  }
}

void EventSensor::fire_noise(double end_s, std::vector<Event>* events) {
  const double rate_hz = options_.noise_hz * static_cast<double>(pixels_.size());
  for (; next_noise_s_ < end_s; next_noise_s_ += waiting_s(rate_hz)) {
    const std::uint32_t index = rng_.below(static_cast<std::uint32_t>(pixels_.size()));
    const bool on = rng_.below(2) == 1;
    if (!fire(index, next_noise_s_, on, events)) continue;
    pixels_[index].reference = pixels_[index].signal;
    ++stats_.noise_events;
  }
  for (HotPixel& hot : hot_) {
    for (; hot.next_s < end_s; hot.next_s += waiting_s(hot.rate_hz)) {
      const bool on = rng_.below(2) == 1;
      if (fire(hot.pixel, hot.next_s, on, events)) ++stats_.hot_events;
    }
  }
}

/// @return false when the pixel is blind
bool EventSensor::fire(std::uint32_t index, double t_s, bool on, std::vector<Event>* events) {
  Pixel& p = pixels_[index];
  if (p.ready_s > t_s) return false;
  p.ready_s = t_s + 1e-6 * options_.refractory_us;
  p.noise = options_.threshold_noise * normal();
  const double stamp_us = std::max(0.0, 1e6 * t_s + options_.jitter_us * normal());
  events->push_back({static_cast<std::int64_t>(stamp_us), static_cast<std::uint16_t>(index % width_),
                     static_cast<std::uint16_t>(index / width_), static_cast<std::uint8_t>(on ? 1 : 0)});
  return true;
}

/// Nearly Gaussian, sigma 1: the sum of four uniform numbers; never beyond 3.5.
double EventSensor::normal() {
  double sum = -2.0;
  for (int i = 0; i < 4; ++i) sum += rng_.uniform();
  return sum * 1.7320508075688772;
}

double EventSensor::waiting_s(double rate_hz) {
  const double u = 1.0 - rng_.uniform();
  return rate_hz > 0 ? -logarithm(u) / rate_hz : 1e300;
}

}  // namespace lecalib::host
