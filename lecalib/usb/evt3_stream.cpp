// SPDX-License-Identifier: MIT
#include "lecalib/usb/evt3_stream.hpp"

#include <utility>

namespace lecalib::usb {
namespace {

constexpr std::size_t kEventsPerStep = 4096;

/// EVT3 fills gaps with words. One wrong bit can make a gap of two minutes, many of them would never end; cameras that
/// run send something all the time.
constexpr std::int64_t kMaxGapUs = 10'000'000;

}  // namespace

Evt3Stream::Evt3Stream(Decoder decoder, SensorSize sensor, StreamSink* sink)
    : decoder_(std::move(decoder)), encoder_(sensor.width, sensor.height), sink_(sink), events_(kEventsPerStep) {}

void Evt3Stream::take(Span<const std::uint8_t> bytes) {
  constexpr std::size_t kWordBytes = sizeof(std::uint16_t);
  const std::size_t odd = bytes.size() % kWordBytes;
  Span<const std::uint8_t> input = bytes.first(bytes.size() - odd);
  std::size_t count = 0;
  do {
    const auto decode = [&](auto& decoder) { (void)decoder.decode(&input, events_, &count); };
    std::visit(decode, decoder_);
    encode(Span<Event>(events_).first(count));
  } while (count > 0);
  if (odd > 0) sink_->take(bytes.subspan(bytes.size() - odd));  // whoever takes words counts it
}

void Evt3Stream::encode(Span<Event> events) {
  for (Event& event : events) {
    event.t_us -= closed_us_;
    if (last_us_ && event.t_us > *last_us_ + kMaxGapUs) {
      closed_us_ += event.t_us - *last_us_;
      event.t_us = *last_us_;
    }
    last_us_ = event.t_us;
  }
  words_.clear();
  // The decoder gives events on the sensor, without large steps: all can be written.
  if (encoder_.append(events, &words_) || words_.empty()) return;
  sink_->take({reinterpret_cast<const std::uint8_t*>(words_.data()), words_.size()});
}

}  // namespace lecalib::usb
