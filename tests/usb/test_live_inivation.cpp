// SPDX-License-Identifier: MIT
// lecalib devices, record and live against fake cameras of iniVation: the program is the built one, its libusb the
// system's.
#include <doctest/doctest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "lecalib/host/event_file.hpp"
#include "support/decode_pieces.hpp"
#include "support/fake_evk4.hpp"
#include "support/fake_fx3.hpp"
#include "support/inivation_encoder.hpp"
#include "support/json_file.hpp"
#include "support/random_events.hpp"
#include "support/temporary_folder.hpp"
#include "usb/mock_bench.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

using Kind = FakeFx3::Kind;

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::vector<Event> events_of(const std::string& path) {
  auto file = host::EventFile::open(path, {});
  REQUIRE(file.ok());
  std::vector<Event> events;
  while (true) {
    const auto part = file.value().read();
    REQUIRE(part.ok());
    if (part.value().empty()) return events;
    events.insert(events.end(), part.value().begin(), part.value().end());
  }
}

/// A bench with one camera that sends random events.
struct Recorder {
  explicit Recorder(Kind kind = Kind::davis346) : fake(bench.add(std::make_shared<FakeFx3>(kind))) {
    Rng rng(41);
    const bool is_davis = kind == Kind::davis346;
    events = random_events(&rng, 200'000, 70, 9, is_davis ? 346 : 640, is_davis ? 260 : 480);
    fake.stream.recording = is_davis ? encode_davis_usb(events) : encode_dvxplorer_usb(events);
  }
  CommandRun record(const std::string& seconds = "1") { return bench.run({"record", path(), "--seconds", seconds}); }
  [[nodiscard]] std::string path() const { return folder / "out.raw"; }

  TemporaryFolder folder;
  MockBench bench;
  FakeFx3& fake;
  std::vector<Event> events;
};

}  // namespace

TEST_CASE("lecalib devices: cameras of iniVation are listed with name, serial, speed and firmware") {
  MockBench bench;
  bench.add(std::make_shared<FakeFx3>(Kind::davis346));
  const CommandRun run = bench.run({"devices"});
  CHECK(run.err == "");
  CHECK(run.out == "iniVation DAVIS346  serial 00000104  5000 Mbit/s  firmware 9, logic 18.4\n");
}

TEST_CASE("lecalib record: the file of a DAVIS346 or DVXplorer holds every event, with stray bytes and halts between") {
  for (const Kind kind : {Kind::davis346, Kind::dvxplorer}) {
    Recorder recorder(kind);
    recorder.fake.stream.faults.max_transfer = 9998;
    recorder.fake.stream.faults.odd_every = 7;
    recorder.fake.stream.faults.stall_at = 100'000;
    const CommandRun run = recorder.record();
    CHECK(run.err == "");
    CHECK(run.exit_code == 0);
    CHECK(has(run.out, "1 halts of the camera were cleared\n"));
    const bool is_same = events_of(recorder.path()) == recorder.events;
    CHECK(is_same);
    CHECK(recorder.bench.port(0).pending() == 0);
    CHECK_FALSE(recorder.fake.is_streaming());
  }
}

TEST_CASE("lecalib record: a DAVIS346 that is unplugged ends it at once, and the file holds what came before") {
  Recorder recorder;
  recorder.fake.stream.bytes_per_s = 1e6;
  recorder.fake.stream.faults.unplug_at = 400'000;
  const CommandRun run = recorder.record("60");
  CHECK(run.exit_code == 1);
  CHECK(run.err == "lecalib: the camera was unplugged: " + recorder.path() + " holds what came before\n");
  CHECK(recorder.bench.seconds_since_unplugged() < max_hang_s());
  const std::vector<Event> before = events_of(recorder.path());
  CHECK(before.size() > 50'000);
  const bool is_same = std::equal(before.begin(), before.end(), recorder.events.begin());
  CHECK(is_same);
}

TEST_CASE("lecalib record: old firmware, a refused parameter and settings of other cameras are named") {
  {
    Recorder recorder;
    recorder.fake.logic = 17;
    CHECK(has(recorder.record().err, "cannot use the iniVation DAVIS346: its logic 17.4 is older than 18.1"));
    CHECK_FALSE(std::filesystem::exists(recorder.path()));
  }
  {
    Recorder recorder;
    recorder.fake.refused = {5, 24};
    CHECK(has(recorder.record().err, "parameter 5.24: the camera refused"));
  }
  Recorder recorder;
  const CommandRun run = recorder.bench.run({"record", recorder.path(), "--bias", "diff_on=3"});
  CHECK(has(run.err, "biases of this camera cannot be changed"));
}

TEST_CASE("lecalib record: of cameras of two makers one is chosen by its serial number") {
  Recorder recorder;
  recorder.bench.add([] {
    auto device = std::make_shared<FakeEvk4>();
    device->info.address = 9;
    return device;
  }());
  CHECK(has(recorder.record().err, "choose a camera with --serial: there are 00000104, 00050423"));
  const CommandRun run =
      recorder.bench.run({"record", recorder.path(), "--seconds", "1", "--serial", recorder.fake.info.serial});
  CHECK(run.exit_code == 0);
  const bool is_same = events_of(recorder.path()) == recorder.events;
  CHECK(is_same);
}

TEST_CASE("lecalib live: from a DAVIS346 the camera is the same, to the last bit, as from a file of the same events") {
  const TemporaryFolder folder;
  const CommandRun made = run_lecalib({"simulate", "--target", "box:0.40x0.30x0.25", "--sensor", "346x260", "--fov",
                                       "65", "--duration-s", "0.5", "--noise", "0.2", "--out", folder / "sim"});
  REQUIRE(made.exit_code == 0);
  const std::string recording = folder / "sim/events.raw";
  const std::string model = folder / "sim/model.txt";
  MockBench bench;
  FakeFx3& fake = bench.add(std::make_shared<FakeFx3>(Kind::davis346));
  fake.stream.recording = encode_davis_usb(events_of(recording));
  fake.stream.bytes_per_s = 5e6;
  fake.stream.faults.max_transfer = 8192;
  const CommandRun live = bench.run({"live", "--model", model, "--seconds", "2", "--out", folder / "live"});
  const CommandRun file = run_lecalib({"calibrate", recording, "--model", model, "--out", folder / "file"});
  CHECK(live.err == "");
  CHECK(live.exit_code == file.exit_code);
  const auto from_live = json_of(folder / "live/calibration.json");
  const auto from_file = json_of(folder / "file/calibration.json");
  CHECK(from_file["cameras"].size() == 1);
  const bool is_same = from_live["cameras"] == from_file["cameras"] && from_live["views"] == from_file["views"];
  CHECK(is_same);
  CHECK(from_live["diagnostics"]["counts"] == from_file["diagnostics"]["counts"]);
}
