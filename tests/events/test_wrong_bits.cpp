// SPDX-License-Identifier: MIT
// Recordings with one wrong bit, in every format that the stream decoder tells apart.
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "lecalib/events/event_stream.hpp"
#include "support/decode_pieces.hpp"
#include "support/random_events.hpp"
#include "support/record_encoder.hpp"

namespace lecalib::test {
namespace {

constexpr SensorSize kSize{128, 128};  // which all formats have room for

struct Recording {
  std::string name;
  Bytes bytes;
};

std::vector<Recording> recordings_of_all_formats() {
  Rng rng(5);
  const std::vector<Event> events = random_events(&rng, 25, 1000, 90, kSize.width, kSize.height);
  std::vector<Word> imu = evt2_imu(3, {1, -2, 3, -4, 5, -6});
  imu.insert(imu.begin(), {{8, 3}, {10, 0x101}});
  const std::vector<TriggerEvent> triggers = {{3, 1, TriggerKind::rising}, {8, 1, TriggerKind::falling}};
  std::string text;
  for (const Event& e : events) {
    text += std::to_string(e.t_us) + ',' + std::to_string(e.x) + ',' + std::to_string(e.y) + ',' +
            std::to_string(e.polarity) + '\n';
  }
  const std::string geometry = "% geometry 128x128\n% end\n";
  return {{"EVT2", to_bytes("% evt 2.0\n" + geometry) + evt2_bytes(imu) + encode_evt2(events)},
          {"EVT2.1", to_bytes("% evt 2.1\n" + geometry) + encode_evt21(events)},
          {"EVT2.1, legacy", to_bytes("% evt 2.1\n% endianness legacy\n" + geometry) + encode_evt21(events, true)},
          {"EVT3", to_bytes("% evt 3.0\n" + geometry) + encode_evt3(events)},
          {"DAT", to_bytes("% Data file\n% Version 2\n% Width 128\n% Height 128\n\x0c\x08") + encode_dat(events)},
          {"DAT 1", to_bytes("% Data file\n% Version 1\n\x0c\x08") + encode_dat(events, 1)},
          {"DAT of triggers", to_bytes("% Data file\n% Version 2\n\x0e\x08") + encode_dat_triggers(triggers)},
          {"AEDAT 2", to_bytes("#!AER-DAT2.0\r\n# AEChip: DAVIS128\r\n") + aedat2_imu(900, {1, 2, 3, 4, 5, 6, 7}) +
                          encode_davis(events, kSize.width, kSize.height)},
          {"AEDAT 2 of a DVS128", to_bytes("#!AER-DAT2.0\r\n# AEChip: DVS128\r\n") + encode_dvs128(events)},
          {"Event Stream", es_header(1, kSize.width, kSize.height) + encode_es(events, kSize.height)},
          {"text", to_bytes("t_us,x,y,p\n" + text)}};
}

/// What came out, as far as two ways of cutting the bytes can differ.
struct Outcome {
  std::uint64_t hash = 1469598103934665603ULL;
  Status status = Status::ok;
  DecoderStats stats;
  bool is_on_sensor = true;
};

bool is_same(const Outcome& a, const Outcome& b) {
  return a.hash == b.hash && a.status == b.status && a.stats.events == b.stats.events &&
         a.stats.outside == b.stats.outside && a.stats.unplaced == b.stats.unplaced &&
         a.stats.triggers == b.stats.triggers && a.stats.imu_samples == b.stats.imu_samples &&
         a.stats.other_words == b.stats.other_words && a.stats.undefined_words == b.stats.undefined_words;
}

Outcome decode_in_pieces_of(std::size_t piece_size, const Bytes& bytes) {
  Outcome outcome;
  EventStreamDecoder decoder(kSize);
  Event out[5];
  TriggerEvent triggers[1];
  ImuSample imu_samples[1];
  SideRecords side{FixedVector<TriggerEvent>(triggers), FixedVector<ImuSample>(imu_samples)};
  Span<const std::uint8_t> rest(bytes);
  for (bool is_over = false; !is_over && !is_error(outcome.status);) {
    Span<const std::uint8_t> piece = rest.first(piece_size);
    rest = rest.subspan(piece.size());
    is_over = piece.empty();
    std::size_t count = 0;
    do {
      outcome.status = is_over ? decoder.finish(out, &count, &side) : decoder.decode(&piece, out, &count, &side);
      for (const Event& event : Span<const Event>(out, count)) {
        const bool is_inside = !is_known(decoder.size()) || (event.x < decoder.width() && event.y < decoder.height());
        outcome.is_on_sensor = outcome.is_on_sensor && is_inside;
        const std::uint64_t place = event.x * 131072ULL + event.y * 2ULL + event.polarity;
        for (const std::uint64_t value : {static_cast<std::uint64_t>(event.t_us), place}) {
          outcome.hash = (outcome.hash ^ value) * 1099511628211ULL;
        }
      }
    } while (outcome.status == Status::ok && count > 0);
  }
  outcome.stats = decoder.stats();
  return outcome;
}

TEST_CASE("wrong bits: whichever it is, events stay on the sensor and do not depend on how the bytes are cut") {
  for (const Recording& recording : recordings_of_all_formats()) {
    CAPTURE(recording.name);
    const Outcome right = decode_in_pieces_of(recording.bytes.size(), recording.bytes);
    CHECK(right.status == Status::ok);
    CHECK(right.stats.events + right.stats.triggers > 0);
    std::size_t num_unlike = 0, num_outside = 0;
    for (std::size_t bit = 0; bit < 8 * recording.bytes.size(); ++bit) {
      Bytes wrong = recording.bytes;
      wrong[bit / 8] = static_cast<std::uint8_t>(wrong[bit / 8] ^ 1U << bit % 8);
      const Outcome whole = decode_in_pieces_of(wrong.size(), wrong);
      if (!is_same(whole, decode_in_pieces_of(1 + bit % 7, wrong))) ++num_unlike;
      if (!whole.is_on_sensor) ++num_outside;
    }
    CHECK(num_unlike == 0);
    CHECK(num_outside == 0);
  }
}

}  // namespace
}  // namespace lecalib::test
