// SPDX-License-Identifier: MIT
// A camera of iniVation that sends anything: what becomes of it are words of EVT3 with events on the sensor, and not
// many more of them than came.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "lecalib/events/evt3_decoder.hpp"
#include "lecalib/usb/evt3_stream.hpp"

namespace {

using namespace lecalib;

constexpr SensorSize kSensor{346, 260};
/// Words that fill the longest gap, 10 s.
constexpr std::size_t kWordsPerWord = 2500;

class Sink : public usb::StreamSink {
 public:
  void take(Span<const std::uint8_t> bytes) override { words_.insert(words_.end(), bytes.begin(), bytes.end()); }
  void end(usb::UsbStatus /*why*/) override {}
  [[nodiscard]] std::vector<std::uint8_t>& words() { return words_; }

 private:
  std::vector<std::uint8_t> words_;
};

void require(bool sound) {
  if (!sound) __builtin_trap();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::size_t whole = std::min<std::size_t>(size, 4096) / 2 * 2;
  Sink sink;
  usb::Evt3Stream stream(DavisUsbDecoder(kSensor), kSensor, &sink);
  for (std::size_t at = 0; at < whole; at += 256) stream.take({data + at, std::min<std::size_t>(256, whole - at)});
  require(sink.words().size() <= kWordsPerWord * whole);
  Evt3Decoder decoder;
  std::vector<Event> events(1024);
  Span<const std::uint8_t> input(sink.words());
  std::size_t count = 0;
  do {
    require(decoder.decode(&input, events, &count) == Status::ok);
    for (std::size_t i = 0; i < count; ++i) require(events[i].x < kSensor.width && events[i].y < kSensor.height);
  } while (count > 0);
  require(decoder.stats().undefined_words == 0 && decoder.stats().unplaced == 0);
  return 0;
}
