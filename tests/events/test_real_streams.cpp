// SPDX-License-Identifier: MIT
/// Recordings of real cameras and of the independent simulator, through the decoder that tells formats apart.
#include <doctest/doctest.h>

#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "lecalib/events/event_stream.hpp"
#include "support/decode_pieces.hpp"
#include "support/opened_stream.hpp"
#include "support/shared_data.hpp"

namespace lecalib::test {
namespace {

std::map<std::string, std::int64_t> sums_of(const std::vector<Event>& events) {
  std::map<std::string, std::int64_t> sums;
  sums["events"] = static_cast<std::int64_t>(events.size());
  sums["first_t_us"] = events.front().t_us;
  sums["last_t_us"] = events.back().t_us;
  for (const Event& event : events) {
    sums["on"] += event.polarity;
    sums["sum_x"] += event.x;
    sums["sum_y"] += event.y;
  }
  return sums;
}

TEST_CASE("stream: a real EVT3 recording gives what an independent decoder found") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const auto folder = *data / "real" / "gen3_evt3";
  std::map<std::string, std::int64_t> expected;
  std::ifstream file(folder / "expected.txt");
  std::string name;
  std::int64_t value = 0;
  while (file >> name >> value) expected[name] = value;
  REQUIRE(expected.size() == 6);

  const Bytes bytes = read_bytes(folder / "events.raw");
  const Decoded decoded = decode_whole(EventStreamDecoder(), bytes, 4096);
  CHECK(decoded.status == Status::ok);
  CHECK(sums_of(decoded.events) == expected);
  CHECK(decoded.stats.other_words > 0);
  CHECK(decoded.stats.undefined_words == 0);

  std::vector<Span<const std::uint8_t>> odd_pieces;
  for (std::size_t i = 0; i < bytes.size(); i += 997)
    odd_pieces.push_back(Span<const std::uint8_t>(bytes).subspan(i, 997));
  CHECK(decode_pieces(EventStreamDecoder(), odd_pieces, 61) == decoded);
}

TEST_CASE("stream: a real EVT2 recording without end of header and geometry") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const Opened opened = open(read_bytes(*data / "real" / "gen3_evt2" / "events.raw"));
  CHECK(opened.format == EventFormat::evt2);
  CHECK_FALSE(is_known(opened.stated));
  CHECK(opened.decoded.status == Status::ok);
  CHECK(opened.decoded.events.size() == 521'252);
  CHECK(opened.decoded.events.front().t_us / 100'000 == 9137);
  CHECK(opened.decoded.events.back().t_us - opened.decoded.events.front().t_us < 97'000);
}

TEST_CASE("stream: real text recordings") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const Decoded shapes =
      decode_whole(EventStreamDecoder(), read_bytes(*data / "real" / "davis240c_shapes" / "events.txt"));
  CHECK(shapes.status == Status::ok);
  CHECK(shapes.events.size() == 20'000);
  CHECK(shapes.events.front() == Event{2'097'134, 162, 27, 0});
  CHECK(open(read_bytes(*data / "real" / "davis346_tags" / "events.csv.gz")).format_name == "gzip");
  CHECK(open(read_bytes(*data / "real" / "davis346_lab_aedat4" / "davis.aedat4")).format_name == "AEDAT 4");
}

TEST_CASE("stream: a real DAT recording that does not state its size") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const Opened opened = open(read_bytes(*data / "real" / "atis_dat" / "events.dat"));
  CHECK(opened.format == EventFormat::dat);
  CHECK_FALSE(is_known(opened.stated));
  CHECK(opened.decoded.status == Status::ok);
  CHECK(opened.decoded.events.size() == 4'407);
  CHECK(opened.decoded.stats.time_steps_back == 0);
  CHECK(opened.decoded.events.back().t_us <= 100'000);
}

TEST_CASE("stream: a simulated recording that crosses the roll-over of 24 bits") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const Decoded decoded =
      decode_whole(EventStreamDecoder(), read_bytes(*data / "sim" / "06_corridor_vga_hover" / "events.raw"), 4096);
  CHECK(decoded.status == Status::ok);
  CHECK(decoded.stats.time_wraps == 1);
  CHECK(decoded.stats.time_steps_back == 0);
  CHECK(decoded.events.back().t_us - decoded.events.front().t_us < 500'000);
}

}  // namespace
}  // namespace lecalib::test
