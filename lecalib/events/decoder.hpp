// SPDX-License-Identifier: MIT
/// What all decoders share: the contract of decode() and finish(), sizes, counters, errors.
///
///     Status decode(Span<const std::uint8_t>* input, Span<Event> out, std::size_t* count,
///                   SideRecords* side = nullptr);
///     Status finish(Span<Event> out, std::size_t* count, SideRecords* side = nullptr);
///
/// decode() takes bytes from the front of *input and writes events to out[0, *count). It returns when `out` is full or
/// `*input` is used up; where the input is cut into pieces changes nothing. After the last byte finish() gives what is
/// still held back. Call each until it returns an error or *count is 0:
///
///     do {
///       status = decoder.decode(&input, out, &count);
///       use(out.first(count));
///     } while (status == Status::ok && count > 0);
///
/// Triggers and IMU samples of the same bytes are appended to *side, if there is one; what finds no room is counted by
/// its vectors' dropped(). The caller empties them.
///
/// The first error sticks: later calls return it again, with no events. The events given beside an error, and before
/// it, are valid. An empty `out` is Status::invalid_argument, which does not stick. Nothing is allocated.
#pragma once

#include <cstdint>

#include "lecalib/core/fixed_vector.hpp"
#include "lecalib/core/records.hpp"
#include "lecalib/core/status.hpp"

namespace lecalib {

/// Pixels of the sensor; 0 x 0 when not known.
struct SensorSize {
  std::uint16_t width = 0;
  std::uint16_t height = 0;
};

constexpr bool is_known(SensorSize size) noexcept { return size.width > 0 && size.height > 0; }

/// Room for what a camera sends beside events.
struct SideRecords {
  FixedVector<TriggerEvent> triggers;
  FixedVector<ImuSample> imu_samples;
};

/// What a decoder met. Events that are not given out are counted by their reason.
struct DecoderStats {
  std::uint64_t events = 0;   ///< given out
  std::uint64_t outside = 0;  ///< dropped: not on the sensor
  /// Dropped: before the first time stamp or, in EVT3, the first row address; triggers and IMU samples too.
  std::uint64_t unplaced = 0;
  std::uint64_t triggers = 0;     ///< edges of external signals and the like, with or without room for them
  std::uint64_t imu_samples = 0;  ///< measurements of the camera's inertial sensor, with or without room for them
  /// Skipped: what the format defines and is none of these; parts of IMU samples that are not whole.
  std::uint64_t other_words = 0;
  std::uint64_t undefined_words = 0;  ///< skipped: types the format does not define
  std::uint64_t time_wraps = 0;       ///< roll-overs of the sensor's clock
  std::uint64_t time_resets = 0;      ///< the sensor's clock began anew; times go on from there
  std::uint64_t time_steps_back = 0;  ///< times that lie before the last one and are no roll-over
};

/// Sums up what several decoders met.
constexpr void add_counts(const DecoderStats& more, DecoderStats* total) noexcept {
  total->events += more.events;
  total->outside += more.outside;
  total->unplaced += more.unplaced;
  total->triggers += more.triggers;
  total->imu_samples += more.imu_samples;
  total->other_words += more.other_words;
  total->undefined_words += more.undefined_words;
  total->time_wraps += more.time_wraps;
  total->time_resets += more.time_resets;
  total->time_steps_back += more.time_steps_back;
}

/// Why and where decoding stopped.
struct DecodeError {
  const char* expected = "";  ///< what would have been right, e.g. "polarity 0, 1 or -1"; "" without error
  std::uint64_t offset = 0;   ///< of the byte in question, from 0
  std::uint64_t line = 0;     ///< of a text, from 1; 0 in binary input
};

}  // namespace lecalib
