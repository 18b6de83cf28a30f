// SPDX-License-Identifier: MIT
// lecalib live against fake cameras: the program is the built one, its libusb the system's.
#include <doctest/doctest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <memory>
#include <string>

#include "support/box_stream.hpp"
#include "support/fake_evk4.hpp"
#include "support/fake_fx3.hpp"
#include "support/json_file.hpp"
#include "support/temporary_folder.hpp"
#include "usb/evk4_recorder.hpp"
#include "usb/mock_bench.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::json;

constexpr double kEventsPerS = 10e6;
constexpr double kMemoryNoise_mib = 32;  // of the hundreds that are sent; sanitizers keep some of what is freed

/// Writes the shipped recording of a box as an EVK4 would see it. @return its words
std::string write_box(const std::string& path) {
  const auto content = host::encode_evt3(box_events({1280, 720}), 1280, 720);
  REQUIRE(content.ok());
  REQUIRE_FALSE(host::write_file(path, content.value()));
  return body_of(path);
}

/// Memory of a process that is in use, MiB.
double resident_mib(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/statm");
  double total_pages = 0, pages = 0;
  file >> total_pages >> pages;
  return pages * 4096 / (1 << 20);
}

/// A bench whose camera sends a box over and over.
struct Box {
  /// @param events_per_s 0: as fast as it is taken
  Box(bool davis, double events_per_s) {
    fake = davis ? static_cast<FakeDevice*>(&bench.add(std::make_shared<FakeFx3>()))
                 : &bench.add(std::make_shared<FakeEvk4>());
    const SensorSize sensor = davis ? SensorSize{346, 260} : SensorSize{1280, 720};
    const std::vector<Event> events = box_events(sensor);
    events_per_round = davis ? repeat_as_davis(events, &fake->stream) : repeat_as_evt3(events, sensor, &fake->stream);
    bytes_per_round = fake->stream.recording.size();
    fake->stream.bytes_per_s =
        events_per_s * static_cast<double>(bytes_per_round) / static_cast<double>(events_per_round);
  }
  CommandRun live(std::vector<std::string> more) {
    std::vector<std::string> words = {"live", "--target", "box:0.4x0.3x0.25", "--out", folder / "out"};
    words.insert(words.end(), more.begin(), more.end());
    return bench.run(words);
  }
  /// At most one round more than were sent.
  [[nodiscard]] double events_sent() const {
    return static_cast<double>((bench.port(0).sent() / bytes_per_round + 1) * events_per_round);
  }
  [[nodiscard]] json result() const { return json_of(folder / "out/calibration.json"); }

  TemporaryFolder folder;
  MockBench bench;
  FakeDevice* fake = nullptr;
  std::size_t events_per_round = 0;
  std::size_t bytes_per_round = 0;
};

}  // namespace

TEST_CASE("lecalib live: of ten million events per second what is left out and what is lost is said") {
  for (const bool davis : {false, true}) {
    Box box(davis, kEventsPerS);
    const CommandRun run = box.live({"--seconds", "3"});
    const json diagnostics = box.result()["diagnostics"];
    const auto left_out = diagnostics["dropped"]["events_left_out"].get<double>();
    const auto buffers = diagnostics["dropped"]["buffers"].get<double>();
    const auto decoded = diagnostics["counts"]["events"].get<double>();
    MESSAGE(std::string(davis ? "DAVIS346: " : "EVK4: ")
            << decoded / 3e6 << " million events per second, left out " << 100 * left_out / decoded << " %, lost "
            << buffers << " buffers");
    CHECK(decoded <= box.events_sent());
    CHECK(left_out < decoded);
    CHECK(has(run.err, "left out") == (left_out + buffers > 0));
    CHECK(has(run.err, "buffers") == (buffers > 0));
    CHECK(diagnostics["counts"]["windows"].get<int>() > 10);
  }
}

TEST_CASE("lecalib live: a camera that is much too fast is followed, in steady memory, until Ctrl-C") {
  for (const bool davis : {false, true}) {
    Box box(davis, 0);
    Clock::time_point asked;
    double early_mib = 0, late_mib = 0;
    box.bench.meanwhile = [&](pid_t pid) {
      const double sent = box.events_sent();
      if (sent > 20e6 && sent < 40e6) early_mib = std::max(early_mib, resident_mib(pid));
      if (sent > 40e6) late_mib = std::max(late_mib, resident_mib(pid));
      if (sent > 80e6 && asked == Clock::time_point() && ::kill(pid, SIGINT) == 0) asked = Clock::now();
    };
    const CommandRun run = box.live({});
    const double ending_s = std::chrono::duration<double>(Clock::now() - asked).count();
    const json dropped = box.result()["diagnostics"]["dropped"];
    CHECK(dropped["events_left_out"].get<double>() > 0);
    CHECK_MESSAGE(has(run.err, "this machine did not keep up"), run.err);
    CHECK(has(run.err, "buffers") == (dropped["buffers"] != 0));
    CHECK(run.exit_code >= 0);
    MESSAGE(early_mib << " MiB, later " << late_mib << " MiB, ended " << ending_s << " s after Ctrl-C");
    CHECK(late_mib < early_mib + kMemoryNoise_mib);
    CHECK(box.bench.port(0).pending() == 0);
  }
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
  // On a slow machine the silence after the recording's end may be noticed before the seconds are over.
  CHECK(live.err.find(file.err) != std::string::npos);
  REQUIRE(file.exit_code == 0);
  REQUIRE(live.exit_code == 0);
  auto from_live = json_of(folder / "live/calibration.json");
  auto from_file = json_of(folder / "file/calibration.json");
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
  const auto json = json_of(recorder.folder / "out/calibration.json");
  CHECK(json["cameras"].empty());
}

TEST_CASE("lecalib live: Ctrl-C ends it soon, also while much waits to be worked on") {
  Recorder recorder(2'000'000);
  recorder.fake.stream.bytes_per_s = 20e6;
  Clock::time_point asked;
  recorder.bench.meanwhile = [&](pid_t pid) {
    const bool is_time = recorder.bench.port(0).sent() > 7'000'000;
    if (is_time && asked == Clock::time_point()) asked = ::kill(pid, SIGINT) == 0 ? Clock::now() : asked;
  };
  const CommandRun run = recorder.bench.run({"live", "--target", "box:0.4x0.3x0.25", "--out", recorder.folder / "out"});
  CHECK(std::chrono::duration<double>(Clock::now() - asked).count() < max_hang_s());
  CHECK(run.exit_code == 1);
  CHECK_MESSAGE(has(run.err, "no camera ("), run.err);
}

TEST_CASE("lecalib live: plugged in again it goes on with both parts") {
  Box box(false, 1e6);
  FakeStream& stream = box.fake->stream;
  stream.faults.unplug_at = 2 * stream.recording.size();
  box.bench.replug_after_ms = 300;
  const CommandRun run = box.live({"--seconds", "8", "--reconnect", "5"});
  CHECK(has(run.err, "the camera is back"));
  CHECK(run.exit_code >= 0);
  const json diagnostics = box.result()["diagnostics"];
  CHECK(diagnostics["counts"]["events"].get<std::size_t>() > 2 * box.events_per_round);
  CHECK(diagnostics["dropped"]["buffers"] == 0);
  CHECK(box.bench.port(0).pending() == 0);
}
