// SPDX-License-Identifier: MIT
/// How fast each format is decoded, and that what was written is read: random events through every format, and
/// recordings.
///
///     bench_decoders [--quick] [--events N] [RECORDING...]
///
/// CPU time of one thread without reading files, the best of five; where a recording's size is not stated none is
/// given. The exit code is 1 when events come back changed; speeds are for the reader.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "lecalib/host/cpu_clock.hpp"
#include "lecalib/host/event_writer.hpp"
#include "lecalib/host/recording_decoder.hpp"
#include "support/aedat4_encoder.hpp"
#include "support/random_events.hpp"
#include "support/record_encoder.hpp"

namespace {

using namespace lecalib;
using test::Bytes;
using test::operator+;
using test::to_bytes;

constexpr int kRuns = 5;
constexpr std::size_t kBytesPerCall = std::size_t{1} << 18U;
constexpr std::size_t kEventsPerCall = std::size_t{1} << 16U;

struct Outcome {
  std::uint64_t events = 0;
  double mev_per_s = 0;
  bool is_same = true;  ///< the events are those expected
};

bool is_equal(const Event& a, const Event& b) {
  return a.t_us == b.t_us && a.x == b.x && a.y == b.y && a.polarity == b.polarity;
}

/// Decodes all bytes; `expected` may be empty.
Outcome decode(const Bytes& bytes, SensorSize sensor, const std::vector<Event>& expected) {
  Outcome outcome;
  std::vector<Event> out(kEventsPerCall);
  for (int run = 0; run < kRuns; ++run) {
    host::RecordingDecoder decoder(sensor);
    std::uint64_t ns = 0;
    std::uint64_t events = 0;
    Status status = Status::ok;
    Span<const std::uint8_t> rest(bytes);
    for (bool is_over = false; !is_over && status == Status::ok;) {
      Span<const std::uint8_t> piece = rest.first(kBytesPerCall);
      rest = rest.subspan(piece.size());
      is_over = piece.empty();
      std::size_t count = 0;
      do {
        const std::uint64_t begin_ns = host::thread_cpu_ns();
        status = is_over ? decoder.finish(out, &count) : decoder.decode(&piece, out, &count);
        ns += host::thread_cpu_ns() - begin_ns;
        const auto at = static_cast<std::ptrdiff_t>(events);
        events += count;
        if (run > 0 || expected.empty()) continue;
        const bool fits = events <= expected.size();
        if (!fits || !std::equal(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(count), expected.begin() + at,
                                 &is_equal))
          outcome.is_same = false;
      } while (status == Status::ok && count > 0);
    }
    if (status != Status::ok || (!expected.empty() && events != expected.size())) outcome.is_same = false;
    outcome.events = events;
    outcome.mev_per_s = std::max(outcome.mev_per_s, 1e3 * static_cast<double>(events) / static_cast<double>(ns));
  }
  return outcome;
}

bool print(const char* name, const Bytes& bytes, SensorSize sensor, const std::vector<Event>& expected) {
  const Outcome outcome = decode(bytes, sensor, expected);
  std::printf("%-28s %10llu %8.2f %9.1f %9.1f  %s\n", name, static_cast<unsigned long long>(outcome.events),
              static_cast<double>(bytes.size()) / static_cast<double>(std::max<std::uint64_t>(1, outcome.events)),
              outcome.mev_per_s,
              outcome.mev_per_s * static_cast<double>(bytes.size()) /
                  static_cast<double>(std::max<std::uint64_t>(1, outcome.events)),
              !outcome.is_same   ? "WRONG"
              : expected.empty() ? ""
                                 : "same");
  std::fflush(stdout);
  return outcome.is_same;
}

Bytes packets_of(const std::vector<Event>& events, bool lz4) {
  constexpr std::size_t kPerPacket = 8192;
  Bytes bytes = test::aedat4_header(lz4 ? 1 : 0, test::aedat4_xml(346, 260));
  for (std::size_t at = 0; at < events.size(); at += kPerPacket) {
    const auto begin = events.begin() + static_cast<std::ptrdiff_t>(at);
    const auto end = events.begin() + static_cast<std::ptrdiff_t>(std::min(events.size(), at + kPerPacket));
    const Bytes content = test::aedat4_events({begin, end});
    bytes = std::move(bytes) + test::aedat4_packet(0, lz4 ? test::lz4_frame(content) : content);
  }
  return bytes;
}

bool run_random(std::size_t count) {
  constexpr SensorSize kSensor{346, 260};
  Rng rng(1);
  const std::vector<Event> events = test::random_events(&rng, count, 1000, 3, kSensor.width, kSensor.height);
  bool is_same = true;
  const auto run = [&](const char* name, const Bytes& bytes) {
    is_same = print(name, bytes, kSensor, events) && is_same;
  };
  const host::Result<std::string> evt3 = host::encode_evt3(events, kSensor.width, kSensor.height);
  run("EVT3", to_bytes(evt3.value()));
  run("EVT2", to_bytes("% evt 2.0\n% geometry 346x260\n% end\n") + test::encode_evt2(events));
  run("EVT2.1", to_bytes("% evt 2.1\n% geometry 346x260\n% end\n") + test::encode_evt21(events));
  run("DAT", to_bytes("% Data file\n% Version 2\n\x0c\x08") + test::encode_dat(events));
  run("AEDAT 2", to_bytes("#!AER-DAT2.0\r\n# AEChip: DAVIS346\r\n") + test::encode_davis(events, 346, 260));
  run("Event Stream", test::es_header(1, 346, 260) + test::encode_es(events, 260));
  run("AEDAT 4, not compressed", packets_of(events, false));
  std::vector<std::uint8_t> unpacked;
  const bool has_lz4 = host::decompress(host::Compression::lz4, test::lz4_frame({1}), 1, &unpacked) == nullptr;
  if (has_lz4) run("AEDAT 4, LZ4 that stores", packets_of(events, true));
  std::string csv;
  host::append_csv(events, &csv);
  run("text, microseconds", to_bytes(csv));
  return is_same;
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t count = 1'000'000;
  std::vector<std::string> recordings;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--quick") == 0) {
      count = 20'000;
    } else if (std::strcmp(argv[i], "--events") == 0 && i + 1 < argc) {
      count = std::strtoull(argv[++i], nullptr, 10);
    } else {
      recordings.emplace_back(argv[i]);
    }
  }
  std::printf("%-28s %10s %8s %9s %9s\n", "random events", "events", "B/event", "Mev/s", "MB/s");
  bool is_same = run_random(count);
  for (const std::string& path : recordings) {
    std::ifstream file(path, std::ios::binary);
    const Bytes bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    is_same = print(path.substr(path.size() > 28 ? path.size() - 28 : 0).c_str(), bytes, {}, {}) && is_same;
  }
  return is_same ? 0 : 1;
}
