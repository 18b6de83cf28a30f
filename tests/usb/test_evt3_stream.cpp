// SPDX-License-Identifier: MIT
#include "lecalib/usb/evt3_stream.hpp"

#include <doctest/doctest.h>

#include <utility>
#include <vector>

#include "lecalib/events/evt3_decoder.hpp"
#include "support/decode_pieces.hpp"
#include "support/inivation_encoder.hpp"
#include "support/random_events.hpp"

using namespace lecalib;
using namespace lecalib::usb;
using namespace lecalib::test;

namespace {

constexpr SensorSize kDavis{346, 260};

struct Collector : StreamSink {
  Bytes bytes;
  std::size_t odd = 0;
  std::vector<UsbStatus> ends;
  void take(Span<const std::uint8_t> part) override {
    odd += part.size() % 2;
    bytes.insert(bytes.end(), part.begin(), part.end() - static_cast<std::ptrdiff_t>(part.size() % 2));
  }
  void end(UsbStatus why) override { ends.push_back(why); }
};

/// What becomes of `bytes` that come in transfers of that size.
Collector convert(const Bytes& bytes, std::size_t transfer, Evt3Stream::Decoder decoder, SensorSize sensor) {
  Collector collector;
  Evt3Stream stream(std::move(decoder), sensor, &collector);
  Span<const std::uint8_t> rest(bytes);
  while (!rest.empty()) {
    stream.take(rest.first(transfer));
    rest = rest.subspan(std::min(transfer, rest.size()));
  }
  stream.end(UsbStatus::no_device);
  return collector;
}

}  // namespace

TEST_CASE("evt3_stream: the same events come out, however the transfers are cut") {
  Rng rng(21);
  const std::vector<Event> events = random_events(&rng, 20'000, 70, 900, kDavis.width, kDavis.height);
  const Bytes bytes = encode_davis_usb(events);
  for (const std::size_t transfer : {2U, 510U, 8192U, 131072U}) {
    const Collector collector = convert(bytes, transfer, DavisUsbDecoder(kDavis), kDavis);
    CHECK(decode_whole(Evt3Decoder(kDavis), collector.bytes).events == events);
    CHECK(collector.odd == 0);
    CHECK(collector.ends == std::vector<UsbStatus>{UsbStatus::no_device});
  }
  constexpr SensorSize kDvxplorer{640, 480};
  const std::vector<Event> more = random_events(&rng, 20'000, 70, 90, kDvxplorer.width, kDvxplorer.height);
  const Collector collector = convert(encode_dvxplorer_usb(more), 1000, DvxplorerUsbDecoder(kDvxplorer), kDvxplorer);
  CHECK(decode_whole(Evt3Decoder(kDvxplorer), collector.bytes).events == more);
}

TEST_CASE("evt3_stream: a stray byte behind a transfer's words is dropped where it can be counted") {
  const std::vector<Event> events = {{5, 1, 2, 1}, {6, 3, 4, 0}};
  Bytes first = encode_davis_usb({events[0]});
  first.push_back(0x5A);
  Collector collector;
  Evt3Stream stream(DavisUsbDecoder(kDavis), kDavis, &collector);
  stream.take(first);
  const Bytes second = usb_time(5, 6) + usb_word(1, 4) + usb_word(2, 3);
  stream.take(second);
  CHECK(decode_whole(Evt3Decoder(kDavis), collector.bytes).events == events);
  CHECK(collector.odd == 1);
}

TEST_CASE("evt3_stream: gaps that a running camera does not have cost no more than a few words") {
  Bytes bytes = usb_time(0, 5) + usb_word(1, 2);
  for (int i = 0; i < 1000; ++i) bytes = std::move(bytes) + usb_word(7, 4095) + usb_word(3, 1);
  const Collector collector = convert(bytes, 4096, DavisUsbDecoder(kDavis), kDavis);
  CHECK(collector.bytes.size() < 10'000);
  const Decoded decoded = decode_whole(Evt3Decoder(kDavis), collector.bytes);
  CHECK(decoded.events.size() == 1000);
  CHECK(decoded.stats.time_steps_back == 0);
}

TEST_CASE("evt3_stream: random words are taken") {
  Rng rng(22);
  Bytes bytes;
  for (int i = 0; i < 100'000; ++i) bytes.push_back(static_cast<std::uint8_t>(rng.next()));
  const Collector collector = convert(bytes, 4096, DavisUsbDecoder(kDavis), kDavis);
  CHECK(decode_whole(Evt3Decoder(kDavis), collector.bytes).events.size() > 10);
}
