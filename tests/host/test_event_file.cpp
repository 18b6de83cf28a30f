// SPDX-License-Identifier: MIT
#include "lecalib/host/event_file.hpp"

#include <doctest/doctest.h>

#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "support/shared_data.hpp"
#include "support/temporary_folder.hpp"

using namespace lecalib;
using namespace lecalib::host;
using lecalib::test::TemporaryFolder;

namespace {

std::string with_content(const TemporaryFolder& folder, const std::string& name, const std::string& content) {
  const std::string path = folder / name;
  REQUIRE_FALSE(write_file(path, content));
  return path;
}

/// All events, or the error's text.
std::string read_all(const std::string& path, SensorSize given, std::vector<Event>* events) {
  Result<EventFile> file = EventFile::open(path, given);
  if (!file.ok()) return to_string(file.error());
  while (true) {
    const Result<Span<const Event>> more = file.value().read();
    if (!more.ok()) return to_string(more.error());
    if (more.value().empty()) return "";
    events->insert(events->end(), more.value().begin(), more.value().end());
  }
}

std::string error_of(const std::string& path, SensorSize given = {}) {
  std::vector<Event> events;
  return read_all(path, given, &events);
}

}  // namespace

TEST_CASE("event file: every event of a text comes once and in order") {
  const TemporaryFolder folder;
  std::string text = "t_us,x,y,p\n";
  constexpr int kEvents = 200'000;  // several reads and several batches
  for (int i = 0; i < kEvents; ++i) {
    text += std::to_string(1000 + 3 * i) + "," + std::to_string(i % 640) + "," + std::to_string(i % 480) + "," +
            std::to_string(i % 2) + "\n";
  }
  const std::string path = with_content(folder, "events.csv", text);
  std::vector<Event> events;
  CHECK(read_all(path, {640, 480}, &events) == "");
  REQUIRE(events.size() == kEvents);
  bool same = true;
  for (int i = 0; i < kEvents; ++i) {
    const Event& e = events[static_cast<std::size_t>(i)];
    same = same && e.t_us == 1000 + 3 * i && e.x == i % 640 && e.y == i % 480 && e.polarity == i % 2;
  }
  CHECK(same);
}

TEST_CASE("event file: a size that nobody states is taken from the coordinates") {
  const TemporaryFolder folder;
  const auto size_of = [&](const std::string& text) {
    const auto file = EventFile::open(with_content(folder, "e.txt", text), {});
    REQUIRE(file.ok());
    CHECK(file.value().sensor_is_guess());
    return to_string(file.value().sensor());
  };
  CHECK(size_of("1 9 5 1\n2 3 19 0\n") == "10x20");
  CHECK(size_of("1 236 5 1\n2 3 179 0\n") == "240x180");  // a DAVIS240C whose last columns were silent
  const auto given = EventFile::open(folder / "e.txt", {300, 200});
  REQUIRE(given.ok());
  CHECK_FALSE(given.value().sensor_is_guess());
  CHECK(given.value().sensor().width == 300);
}

TEST_CASE("event file: a pipe is opened once, whatever is wrong with it") {
  const TemporaryFolder folder;
  const std::string pipe = folder / "pipe";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  const auto error_of_pipe = [&](const std::string& text, SensorSize given) {
    std::thread writer([&] { std::ofstream(pipe) << text; });
    const std::string error = error_of(pipe, given);
    writer.join();
    return error;
  };
  CHECK(error_of_pipe("1 9 5 1\n2 3 19 0\n", {}) == pipe + ": does not state the sensor's size: give --sensor WxH");
  CHECK(error_of_pipe("1 9 5 1\n2 3 19 0\n", {20, 20}) == "");
  CHECK(error_of_pipe("1 9 5 1\n2 3 19\n", {20, 20}) == pipe + ":2: expected polarity 0, 1 or -1");
}

TEST_CASE("event file: what is wrong is said with file and place") {
  const TemporaryFolder folder;
  const std::string broken = with_content(folder, "broken.txt", "0.1 1 2 1\n0.2 1 2 0\n0.3 one 2 1\n");
  CHECK(error_of(broken, {240, 180}).rfind(broken + ":3: expected ", 0) == 0);
  CHECK(error_of(broken, {240, 180}).find(", found '0.3 one 2 1'") != std::string::npos);
  const std::string cut = with_content(folder, "cut.txt", "0.1 1 2 1\n0.2 1");
  CHECK(error_of(cut, {240, 180}).rfind(cut + ":2: expected ", 0) == 0);
  const std::string empty = with_content(folder, "empty.raw", "");
  CHECK(error_of(empty) == empty + ": the file is empty");
  const std::string title = with_content(folder, "title.csv", "t_us,x,y,p\n");
  CHECK(error_of(title, {240, 180}) == title + ": holds no events");
  CHECK(error_of(folder.path()) == folder.path() + ": is a directory, expected a file");
  CHECK(error_of(folder / "none") == (folder / "none") + ": cannot open: no such file or directory");
  const std::string other = with_content(folder, "e.h5", "\x89HDF\r\n\x1a\n12345678");
  CHECK(error_of(other) == other +
                               ": expected Prophesee RAW (EVT2, EVT2.1, EVT3) or DAT, AEDAT 2 or 4, Event Stream 2 or "
                               "text, found HDF5: the README tells how to convert it");
}

TEST_CASE("event file: a wrong sensor size is an error, a few false coordinates are not") {
  const TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 10'000; ++i)
    text += std::to_string(i) + " " + std::to_string(i % 240) + " " + std::to_string(i % 180) + " 1\n";
  const std::string path = with_content(folder, "e.txt", text + "10001 9999 0 1\n");
  CHECK(error_of(path, {240, 180}) == "");
  CHECK(error_of(path, {128, 128}).find("events lie outside of a sensor of 128x128: is its size right?") !=
        std::string::npos);
}

TEST_CASE("event file: what gzip has packed is unpacked, in one member or several") {
  if (!GzipReader::is_available()) {
    MESSAGE("skipped: built without zlib");
    return;
  }
  // Two members, each "1 2 3 1\\n" in a stored block.
  const std::string header("\x1f\x8b\x08\0\0\0\0\0\0\x03", 10);
  const std::string block(
      "\x01\x08\0\xf7\xff"
      "1 2 3 1\n",
      13);
  const std::string check("\xb7\xc3\xd0\x97\x08\0\0\0", 8);
  const std::string member = header + block + check;
  const TemporaryFolder folder;
  std::vector<Event> events;
  CHECK(read_all(with_content(folder, "e.gz", member + member), {9, 9}, &events) == "");
  CHECK(events.size() == 2);
  const std::string cut = with_content(folder, "cut.gz", member + member.substr(0, 20));
  CHECK(error_of(cut, {9, 9}) ==
        cut + ": byte " + std::to_string(std::filesystem::file_size(cut)) + ": expected a whole gzip file");
  const std::string broken = with_content(folder, "broken.gz", header + block + "no check");
  CHECK(error_of(broken, {9, 9}) == broken + ": byte 27: expected a whole gzip file");  // behind the wrong check
}

TEST_CASE("event file: a size that contradicts the file's own is an error; a cut word has its byte") {
  const auto data = test::shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const std::string path = (*data / "real/gen3_evt3/events.raw").string();
  CHECK(error_of(path, {346, 260}) == path + ": the file is of a sensor of 640x480, not 346x260");

  std::ifstream stream(path, std::ios::binary);
  std::string bytes(100'001, '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  const TemporaryFolder folder;
  const std::string cut = with_content(folder, "cut.raw", bytes);
  CHECK(error_of(cut).rfind(cut + ": byte 10000", 0) == 0);
}
