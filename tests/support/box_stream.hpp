// SPDX-License-Identifier: MIT
/// What cameras send that look at a box, for ever: the shipped recording of a tenth of a second in a loop.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "lecalib/events/decoder.hpp"
#include "lecalib/host/event_file.hpp"
#include "lecalib/host/raw_writer.hpp"
#include "support/fake_stream.hpp"
#include "support/inivation_encoder.hpp"
#include "support/shared_data.hpp"

namespace lecalib::test {

/// The shipped recording as the middle of a sensor of this size or larger than 346x260 would see it.
inline std::vector<Event> box_events(SensorSize sensor) {
  auto file = host::EventFile::open((source_dir() / "examples/data/events.raw").string(), {});
  if (!file.ok()) throw std::runtime_error(file.error().message);
  const SensorSize own = file.value().sensor();
  std::vector<Event> all;
  for (auto events = file.value().read(); events.ok() && !events.value().empty(); events = file.value().read()) {
    for (Event event : events.value()) {
      event.x = static_cast<std::uint16_t>(event.x + (sensor.width - own.width) / 2);
      event.y = static_cast<std::uint16_t>(event.y + (sensor.height - own.height) / 2);
      all.push_back(event);
    }
  }
  return all;
}

/// The first events, so that they take a whole number of `unit_us`, from time 0 on. @return that number
inline unsigned trim_to_units(std::int64_t unit_us, std::vector<Event>* events) {
  const std::int64_t begin_us = events->front().t_us;
  const std::int64_t units = (events->back().t_us - begin_us) / unit_us;
  while (events->back().t_us >= begin_us + units * unit_us) events->pop_back();
  for (Event& event : *events) event.t_us -= begin_us;
  return static_cast<unsigned>(units);
}

/// @return events each time around
inline std::size_t repeat_as_evt3(std::vector<Event> events, SensorSize sensor, FakeStream* stream) {
  stream->evt3_highs = trim_to_units(4096, &events);
  std::string words;
  host::Evt3Encoder encoder(sensor.width, sensor.height);
  if (const auto error = encoder.append(events, &words)) throw std::runtime_error(error->message);
  stream->recording.assign(words.begin(), words.end());
  stream->repeats = true;
  return events.size();
}

/// As a DAVIS346 sends it, whose words tell how much time has passed. @return events each time around
inline std::size_t repeat_as_davis(std::vector<Event> events, FakeStream* stream) {
  constexpr std::int64_t kWrapUs = 32768;
  const unsigned wraps = trim_to_units(kWrapUs, &events);
  const auto done = static_cast<unsigned>(events.back().t_us / kWrapUs);
  stream->recording = encode_davis_usb(events) + usb_word(7, wraps - done);
  stream->repeats = true;
  return events.size();
}

}  // namespace lecalib::test
