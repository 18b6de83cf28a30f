// SPDX-License-Identifier: MIT
// lecalib devices, record and live against fake cameras: the program is the built one, its libusb the system's.
#include <doctest/doctest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/host/event_file.hpp"
#include "lecalib/host/file_io.hpp"
#include "lecalib/host/raw_writer.hpp"
#include "support/fake_evk4.hpp"
#include "support/shared_data.hpp"
#include "support/temporary_folder.hpp"
#include "usb/mock_bench.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

constexpr double kMaxHang_s = 2;

std::string content(const std::string& path) {
  const auto text = host::read_text_file(path);
  REQUIRE(text.ok());
  return text.value();
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// What stands behind the header.
std::string body_of(const std::string& path) {
  const std::string all = content(path);
  const std::string end = "% end\n";
  const std::size_t at = all.find(end);
  REQUIRE(at != std::string::npos);
  return all.substr(at + end.size());
}

std::string text_of(const DeviceBytes& bytes) { return {bytes.begin(), bytes.end()}; }

/// EVT3 words of events at random.
DeviceBytes random_words(std::size_t events) {
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

/// The shipped recording of a box as the middle of a larger sensor would see it. Writes it as a file.
/// @return its words
std::string write_box(const std::string& path) {
  constexpr int kShiftX = (1280 - 346) / 2;
  constexpr int kShiftY = (720 - 260) / 2;
  auto file = host::EventFile::open((source_dir() / "examples/data/events.raw").string(), {});
  REQUIRE(file.ok());
  std::vector<Event> all;
  for (auto events = file.value().read(); events.ok() && !events.value().empty(); events = file.value().read()) {
    for (Event event : events.value()) {
      event.x = static_cast<std::uint16_t>(event.x + kShiftX);
      event.y = static_cast<std::uint16_t>(event.y + kShiftY);
      all.push_back(event);
    }
  }
  const auto content = host::encode_evt3(all, 1280, 720);
  REQUIRE(content.ok());
  REQUIRE_FALSE(host::write_file(path, content.value()));
  return body_of(path);
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

void check_whole(Recorder* recorder) {
  const CommandRun run = recorder->record();
  CHECK(run.err == "");
  CHECK(run.exit_code == 0);
  CHECK(body_of(recorder->path()) == recorder->sent(0));
  CHECK(recorder->bench.port(0).pending() == 0);
}

}  // namespace

TEST_CASE("lecalib devices: a camera is listed with name, serial, speed and firmware") {
  MockBench bench;
  bench.add(std::make_shared<FakeEvk4>());
  const CommandRun run = bench.run({"devices"});
  CHECK(run.err == "");
  CHECK(run.exit_code == 0);
  CHECK(run.out == "Prophesee EVK4  serial 00050423  5000 Mbit/s  firmware 3.9.0\n");
}

TEST_CASE("lecalib devices: what cannot be used is listed with what to do; without any camera it fails") {
  MockBench bench;
  CHECK(bench.run({"devices"}).err == "lecalib: no camera is plugged in\n");
  FakeEvk4& loader = bench.add([] {
    auto device = std::make_shared<FakeEvk4>();
    device->info.product = 0x00F3;
    device->info.address = 7;
    return device;
  }());
  CHECK(loader.info.address == 7);
  const CommandRun none = bench.run({"devices"});
  CHECK(none.exit_code == 1);
  CHECK(has(none.out, "no firmware"));
  auto busy = std::make_shared<FakeEvk4>();
  busy->info.address = 8;
  MockPort::System system;
  system.is_busy = true;
  bench.add(busy, system);
  CHECK(has(bench.run({"devices"}).out, "another program uses the camera"));
}

TEST_CASE("lecalib record: the file holds every byte that the camera sent, and can be read") {
  Recorder recorder(2'000'000);
  check_whole(&recorder);
  const CommandRun info = run_lecalib({"info", recorder.path()});
  CHECK(has(info.out, "events    2000000\n"));
  CHECK(has(info.out, "1280x720"));
}

TEST_CASE("lecalib record: short transfers with stray bytes change nothing") {
  Recorder recorder;
  recorder.fake.stream.faults.max_transfer = 9998;
  recorder.fake.stream.faults.odd_every = 7;
  check_whole(&recorder);
}

TEST_CASE("lecalib record: without scatter and gather nothing changes") {
  MockPort::System system;
  system.has_scatter_gather = false;
  Recorder recorder(300000, system);
  check_whole(&recorder);
}

TEST_CASE("lecalib record: little memory for transfers makes them fewer, then smaller, and too little is said") {
  for (const std::size_t limit : {std::size_t{1} << 20, std::size_t{200'000}}) {
    MockPort::System system;
    system.max_bytes = limit;
    Recorder recorder(300000, system);
    check_whole(&recorder);
  }
  MockPort::System system;
  system.max_bytes = 5000;
  Recorder recorder(1000, system);
  const CommandRun run = recorder.record();
  CHECK(run.exit_code == 1);
  CHECK(has(run.err, "usbfs_memory_mb"));
}

TEST_CASE("lecalib record: a halted endpoint and failed transfers are overcome and counted") {
  Recorder recorder;
  recorder.fake.stream.faults.stall_at = 400'000;
  recorder.fake.stream.faults.stalls = 2;
  recorder.fake.stream.faults.failure_at = 800'000;
  const CommandRun run = recorder.record();
  CHECK(run.exit_code == 0);
  CHECK(body_of(recorder.path()) == recorder.sent(0));
  CHECK(has(run.out, "2 halts of the camera were cleared\n"));
  CHECK(has(run.out, "1 transfers failed and were repeated\n"));
}

TEST_CASE("lecalib record: an overrun transfer is lost and counted, the rest is there") {
  Recorder recorder;
  recorder.fake.stream.faults.max_transfer = 10'000;
  recorder.fake.stream.faults.overflow_at = 500'000;
  const CommandRun run = recorder.record();
  CHECK(run.exit_code == 0);
  CHECK(has(run.out, "1 transfers lost: the camera sent more than it was asked for\n"));
  CHECK(body_of(recorder.path()) == recorder.sent(0, 500'000) + recorder.sent(510'000));
}

TEST_CASE("lecalib record: a camera that halts for good ends it soon with a message") {
  Recorder recorder;
  recorder.fake.stream.faults.stall_at = 400'000;
  recorder.fake.stream.faults.stalls = 1000;
  const CommandRun run = recorder.record({"--seconds", "60"});
  CHECK(run.exit_code == 1);
  CHECK(has(run.err, "refused (stall)"));
  CHECK(body_of(recorder.path()) == recorder.sent(0, 400'000));
}

TEST_CASE("lecalib record: a camera that falls silent ends it with a message") {
  Recorder recorder;
  recorder.fake.stream.faults.silence_at = 300'000;
  const CommandRun run = recorder.record({"--seconds", "60"});
  CHECK(run.exit_code == 1);
  CHECK(has(run.err, "sends nothing any more"));
  CHECK(body_of(recorder.path()) == recorder.sent(0, 300'000));
}

TEST_CASE("lecalib record: unplugged it ends at once, and the file holds what came before") {
  Recorder recorder;
  recorder.fake.stream.bytes_per_s = 1e6;
  recorder.fake.stream.faults.unplug_at = 600'000;
  const CommandRun run = recorder.record({"--seconds", "60"});
  CHECK(run.exit_code == 1);
  CHECK(run.err == "lecalib: the camera was unplugged: " + recorder.path() + " holds what came before\n");
  CHECK(recorder.bench.seconds_since_unplugged() < kMaxHang_s);
  CHECK(body_of(recorder.path()) == recorder.sent(0, 600'000));
}

TEST_CASE("lecalib record: plugged in again it goes on in a second file") {
  Recorder recorder;
  recorder.fake.stream.bytes_per_s = 5e6;
  recorder.fake.stream.faults.unplug_at = 600'000;
  recorder.bench.replug_after_ms = 300;
  const CommandRun run = recorder.record({"--seconds", "8", "--reconnect", "5"});
  CHECK(has(run.err, "waiting 5 s"));
  CHECK(has(run.err, "the camera is back"));
  CHECK(run.exit_code == 0);
  CHECK(body_of(recorder.path()) == recorder.sent(0, 600'000));
  CHECK(body_of(recorder.folder / "out-2.raw") == recorder.sent(600'000));
}

TEST_CASE("lecalib record: Ctrl-C ends it with a whole file") {
  Recorder recorder;
  recorder.fake.stream.bytes_per_s = 1e6;
  bool is_sent = false;
  recorder.bench.meanwhile = [&](pid_t pid) {
    if (!is_sent && std::filesystem::exists(recorder.path()) && std::filesystem::file_size(recorder.path()) > 200'000) {
      is_sent = ::kill(pid, SIGINT) == 0;
    }
  };
  const CommandRun run = recorder.record({});
  CHECK(run.exit_code == 0);
  CHECK(run.err == "");
  const std::string body = body_of(recorder.path());
  CHECK(body.size() >= 190'000);
  CHECK(body == recorder.sent(0, body.size()));
  CHECK(recorder.bench.port(0).pending() == 0);
}

TEST_CASE("lecalib record: killed at any time it leaves a file that opens") {
  Recorder recorder;
  recorder.fake.stream.bytes_per_s = 2e6;
  recorder.fake.stream.faults.max_transfer = 7000;
  recorder.bench.meanwhile = [&](pid_t pid) {
    if (std::filesystem::exists(recorder.path()) && std::filesystem::file_size(recorder.path()) > 200'000) {
      (void)::kill(pid, SIGKILL);
    }
  };
  CHECK(recorder.record({}).exit_code == -1);
  const std::string body = body_of(recorder.path());
  CHECK(body.size() % 2 == 0);
  CHECK(body == recorder.sent(0, body.size()));
  CHECK(run_lecalib({"info", recorder.path()}).exit_code == 0);
}

TEST_CASE("lecalib record: a full disk is reported and ends it") {
  Recorder recorder;
  const CommandRun run = recorder.bench.run({"record", "/dev/full", "--seconds", "60"});
  CHECK(run.exit_code == 1);
  CHECK(has(run.err, "no space left"));
  CHECK_FALSE(recorder.fake.is_streaming());
}

TEST_CASE("lecalib record: a camera that may not be opened is a message with the rule that lets it") {
  if (::geteuid() != 0) {
    MESSAGE("skipped: only root can run the program as somebody else");
    return;
  }
  MockPort::System system;
  system.is_private = true;
  Recorder recorder(1000, system);
  const CommandRun run = recorder.bench.run({"record", "/dev/null"}, RunAs::nobody);
  if (run.exit_code == kCannotRun) {
    MESSAGE("skipped: nobody may not enter the build folder");
    return;
  }
  CHECK(run.exit_code == 1);
  CHECK_MESSAGE(has(run.err, "70-lecalib.rules"), run.err);
}

TEST_CASE("lecalib record: old firmware, a refused register and a mute camera are named") {
  {
    Recorder recorder;
    recorder.fake.firmware = 0x030700;
    CHECK(has(recorder.record().err, "firmware 3.7.0 is older than 3.8.0"));
    CHECK_FALSE(std::filesystem::exists(recorder.path()));
  }
  {
    Recorder recorder;
    recorder.fake.refused_register = 0x7008;
    CHECK(has(recorder.record().err, "register 0x7008: the camera refused (error 5)"));
  }
  {
    Recorder recorder;
    recorder.fake.mute_property = 0x72;
    CHECK(has(recorder.record().err, "did not answer in time"));
  }
}

TEST_CASE("lecalib record: of two cameras one is chosen by its serial number") {
  Recorder recorder;
  FakeEvk4& other = recorder.bench.add([] {
    auto device = std::make_shared<FakeEvk4>();
    device->info.address = 9;
    device->serial = 0xBEEF;
    return device;
  }());
  other.stream.recording = random_words(1000);
  const std::string unclear = recorder.record().err;
  CHECK_MESSAGE(has(unclear, "choose a camera with --serial: there are 00050423, 0000beef"), unclear);
  CHECK(recorder.record({"--seconds", "1", "--serial", "BEEF"}).exit_code == 1);
  CHECK(recorder.record({"--seconds", "1", "--serial", "0000BEEF"}).exit_code == 0);
  CHECK(body_of(recorder.path()) == text_of(other.stream.recording));
}

TEST_CASE("lecalib record: options that cannot be read are said before the camera is touched") {
  Recorder recorder;
  CHECK(has(recorder.record({"--bias", "diff_on"}).err, "expected NAME=OFFSET"));
  CHECK(has(recorder.record({"--roi", "1,2,3"}).err, "expected X,Y,WIDTH,HEIGHT"));
  CHECK(has(recorder.record({"--bias", "hpf=-3"}).err, "0 to 255"));
  CHECK(recorder.fake.writes.empty());
}

TEST_CASE("lecalib live: the camera is the same, to the last bit, as from a file of the same bytes") {
  const TemporaryFolder folder;
  const std::string path = folder / "box.raw";
  const std::string body = write_box(path);
  MockBench bench;
  FakeEvk4& fake = bench.add(std::make_shared<FakeEvk4>());
  fake.stream.recording.assign(body.begin(), body.end());
  fake.stream.bytes_per_s = 10e6;
  fake.stream.faults.max_transfer = 16'382;
  const std::string model = (source_dir() / "examples/data/model.txt").string();
  const CommandRun live = bench.run({"live", "--model", model, "--seconds", "2", "--out", folder / "live"});
  const CommandRun file = run_lecalib({"calibrate", path, "--model", model, "--out", folder / "file"});
  CHECK(live.err == file.err);
  REQUIRE(file.exit_code == 0);
  REQUIRE(live.exit_code == 0);
  auto from_live = nlohmann::json::parse(content(folder / "live/calibration.json"));
  auto from_file = nlohmann::json::parse(content(folder / "file/calibration.json"));
  const bool same_camera = from_live["cameras"] == from_file["cameras"];
  CHECK(same_camera);
  const bool same_views = from_live["views"] == from_file["views"];
  CHECK(same_views);
  CHECK(from_live["diagnostics"]["counts"] == from_file["diagnostics"]["counts"]);
  CHECK(from_live["diagnostics"]["dropped"]["buffers"] == 0);
  const bool same_yaml = content(folder / "live/calibration.yaml") == content(folder / "file/calibration.yaml");
  CHECK(same_yaml);
}

TEST_CASE("lecalib live: unplugged or sent garbage it ends with what came before, or says why there is no camera") {
  Recorder recorder;
  recorder.fake.stream.bytes_per_s = 2e6;
  recorder.fake.stream.faults.unplug_at = 600'000;
  Rng rng(8);
  for (std::uint8_t& byte : recorder.fake.stream.recording) {
    if (rng.uniform() < 0.02) byte = static_cast<std::uint8_t>(256 * rng.uniform());
  }
  const CommandRun run =
      recorder.bench.run({"live", "--target", "box:0.4x0.3x0.25", "--seconds", "60", "--out", recorder.folder / "out"});
  CHECK(run.exit_code == 1);
  CHECK_MESSAGE(has(run.err, "the camera was unplugged: calibrated from what came before\n"), run.err);
  CHECK_MESSAGE(has(run.err, "no camera ("), run.err);
  const auto json = nlohmann::json::parse(content(recorder.folder / "out/calibration.json"));
  CHECK(json["cameras"].empty());
}

TEST_CASE("lecalib live: Ctrl-C ends it soon, also while much waits to be worked on") {
  using Clock = std::chrono::steady_clock;
  Recorder recorder(2'000'000);
  recorder.fake.stream.bytes_per_s = 20e6;
  Clock::time_point asked;
  recorder.bench.meanwhile = [&](pid_t pid) {
    const bool is_time = recorder.bench.port(0).sent() > 3'000'000;
    if (is_time && asked == Clock::time_point()) asked = ::kill(pid, SIGINT) == 0 ? Clock::now() : asked;
  };
  const CommandRun run = recorder.bench.run({"live", "--target", "box:0.4x0.3x0.25", "--out", recorder.folder / "out"});
  CHECK(std::chrono::duration<double>(Clock::now() - asked).count() < kMaxHang_s);
  CHECK(run.exit_code == 1);
  CHECK_MESSAGE(has(run.err, "no camera ("), run.err);
}
