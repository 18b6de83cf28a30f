// SPDX-License-Identifier: MIT
#include "lecalib/host/event_writer.hpp"

#include <doctest/doctest.h>

#include "lecalib/host/event_file.hpp"
#include "support/decode_pieces.hpp"
#include "support/random_events.hpp"
#include "support/temporary_folder.hpp"

using namespace lecalib;
using namespace lecalib::host;
using namespace lecalib::test;

namespace {

constexpr SensorSize kSensor{1280, 720};

/// Writes the events in pieces of up to 40,000 and reads them again.
std::vector<Event> written_and_read(const std::vector<Event>& events, OutputFormat format, const std::string& path) {
  Result<EventWriter> writer = EventWriter::create(path, format, kSensor);
  REQUIRE(writer.ok());
  Rng rng(3);
  for (Span<const Event> rest(events); !rest.empty();) {
    const Span<const Event> piece = rest.first(1 + rng.below(40'000));
    REQUIRE_FALSE(writer.value().write(piece));
    rest = rest.subspan(piece.size());
  }
  REQUIRE_FALSE(writer.value().commit());
  Result<EventFile> file = EventFile::open(path, kSensor);
  REQUIRE(file.ok());
  std::vector<Event> read;
  while (true) {
    const Result<Span<const Event>> more = file.value().read();
    REQUIRE(more.ok());
    if (more.value().empty()) return read;
    read.insert(read.end(), more.value().begin(), more.value().end());
  }
}

TEST_CASE("event writer: a million random events are read as they were written, in each format") {
  const TemporaryFolder folder;
  Rng rng(1);
  const std::vector<Event> events = random_events(&rng, 1'000'000, 12'345, 70, kSensor.width, kSensor.height);
  REQUIRE(events.back().t_us > std::int64_t{1} << 24);
  CHECK(written_and_read(events, OutputFormat::evt3, folder / "e.raw") == events);
  CHECK(written_and_read(events, OutputFormat::csv, folder / "e.csv") == events);
}

TEST_CASE("event writer: CSV keeps any time and any order") {
  const TemporaryFolder folder;
  const std::vector<Event> events = {
      {9'000'000'000'000'000'000, 1279, 719, 1}, {-5, 0, 0, 0}, {1'700'000'000'000'000, 3, 4, 1}, {0, 5, 6, 0}};
  CHECK(written_and_read(events, OutputFormat::csv, folder / "e.csv") == events);
}

TEST_CASE("event writer: the first event's time is kept modulo 2^24 by EVT3") {
  const TemporaryFolder folder;
  Rng rng(2);
  std::vector<Event> events = random_events(&rng, 1000, 5 * (std::int64_t{1} << 24) + 7, 100'000, 1280, 720);
  const std::vector<Event> read = written_and_read(events, OutputFormat::evt3, folder / "e.raw");
  for (Event& event : events) event.t_us -= 5 * (std::int64_t{1} << 24);
  CHECK(read == events);
}

TEST_CASE("event writer: a file appears whole or not at all") {
  const TemporaryFolder folder;
  const std::string path = folder / "e.raw";
  {
    Result<EventWriter> writer = EventWriter::create(path, OutputFormat::evt3, kSensor);
    REQUIRE(writer.ok());
    CHECK(folder.count() == 1);
    const auto error = writer.value().write(std::vector<Event>{{1, 1280, 0, 1}});
    REQUIRE(error);
    CHECK(error->message.find("event 0 lies outside") == 0);
  }
  CHECK(folder.count() == 0);
  CHECK_FALSE(EventWriter::create(path, OutputFormat::evt3, {4096, 10}).ok());
  CHECK_FALSE(EventWriter::create(folder.path(), OutputFormat::csv, kSensor).ok());
  CHECK(EventWriter::create("/dev/full", OutputFormat::csv, kSensor).error().message ==
        "cannot write: no space left on device");
}

TEST_CASE("event writer: the format's name and the file's tell the format") {
  CHECK(output_format_named("csv") == OutputFormat::csv);
  CHECK(output_format_named("evt3") == OutputFormat::evt3);
  CHECK_FALSE(output_format_named("raw"));
  CHECK(output_format_of_path("a/b.raw") == OutputFormat::evt3);
  CHECK(output_format_of_path("b.csv") == OutputFormat::csv);
  CHECK(output_format_of_path("b.txt") == OutputFormat::csv);
  CHECK_FALSE(output_format_of_path(".csv"));
  CHECK_FALSE(output_format_of_path("b.aedat4"));
}

}  // namespace
