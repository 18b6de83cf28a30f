// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "lecalib/host/simulator_sensor.hpp"

using lecalib::Event;
using lecalib::host::EventSensor;
using lecalib::host::SensorOptions;

namespace {

constexpr double kTwoPi = 6.283185307179586;

/// A sensor without noise, mismatch or blind time, and so fast that the low-pass does not show.
SensorOptions ideal() {
  SensorOptions options;
  options.threshold_spread = options.threshold_noise = 0;
  options.bandwidth_hz = 1e6;
  options.refractory_us = options.noise_hz = options.hot_fraction = options.jitter_us = 0;
  return options;
}

/// One pixel that goes from radiance `from` to radiance `to` within duration_s, then rests for rest_s.
std::vector<Event> one_pixel(const SensorOptions& options, float from, float to, double duration_s, double rest_s = 0) {
  EventSensor sensor(1, 1, options, 1);
  std::vector<Event> events;
  const std::uint32_t changed[] = {0};
  const float begin[] = {from};
  const float end[] = {to};
  sensor.start(begin);
  sensor.advance(duration_s, end, changed, &events);
  if (rest_s > 0) sensor.advance(duration_s + rest_s, end, {}, &events);
  return events;
}

}  // namespace

TEST_CASE("EventSensor: a ramp of ln(brightness) fires once per threshold, at the closed form's times") {
  for (const bool rising : {true, false}) {
    const double threshold = 0.24, contrast = 1.3, duration_s = 0.1;
    const float low = 0.1F, high = static_cast<float>(0.1 * std::exp(contrast));
    const auto events = one_pixel(ideal(), rising ? low : high, rising ? high : low, duration_s);
    REQUIRE(events.size() == 5);
    for (std::size_t k = 0; k < events.size(); ++k) {
      CHECK(events[k].polarity == (rising ? 1 : 0));
      const double expected_us = 1e6 * duration_s * threshold * static_cast<double>(k + 1) / contrast;
      CHECK(static_cast<double>(events[k].t_us) == doctest::Approx(expected_us).epsilon(0.002));
    }
  }
}

TEST_CASE("EventSensor: a step shows the low-pass of the pixel's bandwidth, slower in the dark") {
  for (const float level : {0.5F, 0.125F}) {
    SensorOptions options = ideal();
    options.bandwidth_hz = 100;
    const double tau_s = 1.0 / (kTwoPi * options.bandwidth_hz * static_cast<double>(level) / 0.5);
    const double step = 0.5;
    const auto events =
        one_pixel(options, level, static_cast<float>(static_cast<double>(level) * std::exp(step)), 1e-6, 0.1);
    REQUIRE(events.size() == 2);
    // During the rest the brightness, hence the bandwidth, is that after the step.
    const double faster = std::exp(step);
    const double expected_us = -1e6 * tau_s / faster * std::log(1.0 - options.threshold / step);
    CHECK(static_cast<double>(events[0].t_us) == doctest::Approx(expected_us).epsilon(0.05));
  }
}

TEST_CASE("EventSensor: after an event the pixel is blind, then starts from what it sees") {
  SensorOptions options = ideal();
  options.refractory_us = 30'000;
  // 1.3 of ln in 0.1 s: events at 18.5 ms, then a threshold after 48.5 ms, then one after 97 ms.
  const auto events = one_pixel(options, 0.1F, static_cast<float>(0.1 * std::exp(1.3)), 0.1);
  REQUIRE(events.size() == 2);
  const double crossing_us = 1e5 * 0.24 / 1.3;
  CHECK(static_cast<double>(events[0].t_us) == doctest::Approx(crossing_us).epsilon(0.002));
  CHECK(static_cast<double>(events[1].t_us) == doctest::Approx(2 * crossing_us + 30'000).epsilon(0.002));
}

TEST_CASE("EventSensor: noise has the rate asked for, both polarities, and hot pixels stand out") {
  SensorOptions options = ideal();
  options.noise_hz = 5;
  options.hot_fraction = 0.002;
  EventSensor sensor(100, 50, options, 7);
  const std::vector<float> radiance(5000, 0.3F);
  sensor.start(radiance);
  std::vector<Event> events;
  for (int ms = 1; ms <= 1000; ++ms) sensor.advance(1e-3 * ms, radiance, {}, &events);
  const auto& stats = sensor.stats();
  CHECK(stats.scene_events == 0);
  CHECK(events.size() == stats.noise_events + stats.hot_events);
  CHECK(std::abs(static_cast<double>(stats.noise_events) - 25'000) < 4 * std::sqrt(25'000));
  CHECK(stats.hot_events >= 10 * 5);
  std::size_t on = 0;
  for (const Event& event : events) on += event.polarity;
  CHECK(std::abs(static_cast<double>(on) / static_cast<double>(events.size()) - 0.5) < 0.02);
}

TEST_CASE("EventSensor: time stamps scatter by the jitter and never fall below 0") {
  SensorOptions options = ideal();
  options.jitter_us = 200;
  const double crossing_us = 1e4 * 0.24 / 0.3;
  EventSensor sensor(2000, 1, options, 3);
  std::vector<std::uint32_t> changed;
  for (std::uint32_t i = 0; i < 2000; ++i) changed.push_back(i);
  sensor.start(std::vector<float>(2000, 0.1F));
  std::vector<Event> events;
  sensor.advance(0.01, std::vector<float>(2000, static_cast<float>(0.1 * std::exp(0.3))), changed, &events);
  REQUIRE(events.size() == 2000);
  double sum = 0;
  for (const Event& event : events) {
    const double error = static_cast<double>(event.t_us) + 0.5 - crossing_us;
    sum += error * error;
    CHECK(event.t_us >= 0);
  }
  CHECK(std::sqrt(sum / 2000) == doctest::Approx(200).epsilon(0.06));
}
