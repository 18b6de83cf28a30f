// SPDX-License-Identifier: MIT
/// A fake EVK4 on a MockBench for `lecalib record`, and what its files hold.
#pragma once

#include <doctest/doctest.h>

#include <memory>
#include <string>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/host/file_io.hpp"
#include "lecalib/host/raw_writer.hpp"
#include "support/fake_evk4.hpp"
#include "support/temporary_folder.hpp"
#include "usb/mock_bench.hpp"

namespace lecalib::test {

inline std::string content(const std::string& path) {
  const auto text = host::read_text_file(path);
  REQUIRE(text.ok());
  return text.value();
}

inline bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// What stands behind the header.
inline std::string body_of(const std::string& path) {
  const std::string all = content(path);
  const std::string end = "% end\n";
  const std::size_t at = all.find(end);
  REQUIRE(at != std::string::npos);
  return all.substr(at + end.size());
}

inline std::string text_of(const DeviceBytes& bytes) { return {bytes.begin(), bytes.end()}; }

/// EVT3 words of events at random.
inline DeviceBytes random_words(std::size_t events) {
  Rng rng(3);
  std::vector<Event> all;
  for (std::size_t i = 0; i < events; ++i) {
    const auto x = static_cast<std::uint16_t>(1280 * rng.uniform());
    const auto y = static_cast<std::uint16_t>(720 * rng.uniform());
    all.push_back({static_cast<std::int64_t>(i), x, y, static_cast<std::uint8_t>(i % 2)});
  }
  host::Evt3Encoder encoder(1280, 720);
  std::string words;
  REQUIRE_FALSE(encoder.append(all, &words));
  return {words.begin(), words.end()};
}

/// A bench with one camera that sends random words.
struct Recorder {
  explicit Recorder(std::size_t events = 300000, MockPort::System system = {})
      : fake(bench.add(std::make_shared<FakeEvk4>(), system)) {
    fake.stream.recording = random_words(events);
  }
  CommandRun record(std::vector<std::string> more = {"--seconds", "1"}) {
    std::vector<std::string> words = {"record", path()};
    words.insert(words.end(), more.begin(), more.end());
    return bench.run(words);
  }
  [[nodiscard]] std::string path() const { return folder / "out.raw"; }
  [[nodiscard]] std::string sent(std::size_t from, std::size_t size = std::string::npos) const {
    return text_of(fake.stream.recording).substr(from, size);
  }

  TemporaryFolder folder;
  MockBench bench;
  FakeEvk4& fake;
};

}  // namespace lecalib::test
