// SPDX-License-Identifier: MIT
// lecalib devices and record against fake cameras: the program is the built one, its libusb the system's.
#include <doctest/doctest.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "support/box_stream.hpp"
#include "support/fake_fx3.hpp"
#include "usb/evk4_recorder.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

/// A file system of its own in a folder, while it lives.
struct SmallDisk {
  SmallDisk(std::string folder, std::size_t bytes) : path(std::move(folder)) {
    const std::string size = "size=" + std::to_string(bytes);
    is_there = ::mount("tmpfs", path.c_str(), "tmpfs", 0, size.c_str()) == 0;
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  ~SmallDisk() {
    if (is_there) (void)::umount(path.c_str());
  }
  std::string path;
  bool is_there = false;
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

TEST_CASE("lecalib devices: what cannot be used is listed with what to do, without any camera it fails") {
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

TEST_CASE("lecalib record: of ten million events per second none is lost, or what is lost is said") {
  for (const bool davis : {false, true}) {
    const TemporaryFolder folder;
    MockBench bench;
    FakeDevice& fake = davis ? static_cast<FakeDevice&>(bench.add(std::make_shared<FakeFx3>()))
                             : bench.add(std::make_shared<FakeEvk4>());
    const SensorSize sensor = davis ? SensorSize{346, 260} : SensorSize{1280, 720};
    const std::vector<Event> events = box_events(sensor);
    const std::size_t count =
        davis ? repeat_as_davis(events, &fake.stream) : repeat_as_evt3(events, sensor, &fake.stream);
    const double bytes_per_event = static_cast<double>(fake.stream.recording.size()) / static_cast<double>(count);
    fake.stream.bytes_per_s = 10e6 * bytes_per_event;
    const CommandRun run = bench.run({"record", folder / "out.raw", "--seconds", "3"});
    CHECK(run.exit_code == 0);
    const auto sent = static_cast<double>(bench.port(0).sent()) / bytes_per_event;
    MESSAGE(std::string(davis ? "DAVIS346: " : "EVK4: ")
            << 1e-6 * sent / 3 << " million events per second sent; " << run.out);
    if (!has(run.out, "lost")) {
      const CommandRun info = run_lecalib({"info", "--json", folder / "out.raw"});
      const std::string key = "\"events\": ";
      REQUIRE(has(info.out, key));
      const double recorded = std::stod(info.out.substr(info.out.find(key) + key.size()));
      CHECK(recorded > 0.9 * sent);  // what was under way when it ended is not there
    }
    CHECK(bench.port(0).pending() == 0);
  }
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
  CHECK(recorder.bench.seconds_since_unplugged() < max_hang_s());
  CHECK(body_of(recorder.path()) == recorder.sent(0, 600'000));
}

TEST_CASE("lecalib record: plugged in again it goes on in a second file") {
  Recorder recorder;
  recorder.fake.stream.bytes_per_s = 2e6;
  recorder.fake.stream.repeats = true;
  recorder.fake.stream.faults.unplug_at = 600'000;
  recorder.bench.replug_after_ms = 300;
  const std::string second = recorder.folder / "out-2.raw";
  const std::string rest = recorder.sent(600'000);
  bool is_asked = false;
  recorder.bench.meanwhile = [&](pid_t pid) {
    if (!is_asked && std::filesystem::exists(second) && std::filesystem::file_size(second) > rest.size() + 1000) {
      is_asked = ::kill(pid, SIGINT) == 0;
    }
  };
  const CommandRun run = recorder.record({"--seconds", "60", "--reconnect", "5"});
  CHECK(has(run.err, "waiting 5 s"));
  CHECK(has(run.err, "the camera is back"));
  CHECK(run.exit_code == 0);
  CHECK(body_of(recorder.path()) == recorder.sent(0, 600'000));
  const bool is_same = body_of(second).substr(0, rest.size()) == rest;
  CHECK(is_same);
}

TEST_CASE("lecalib record: unplugged for good, or while it starts, it is said soon") {
  {
    Recorder recorder;
    recorder.fake.stream.bytes_per_s = 1e6;
    recorder.fake.stream.faults.unplug_at = 600'000;
    const CommandRun run = recorder.record({"--reconnect", "1"});
    CHECK(run.exit_code == 1);
    CHECK(has(run.err, "the camera was unplugged: " + recorder.path() + " holds what came before\n"));
    CHECK(recorder.bench.seconds_since_unplugged() < 1 + max_hang_s());
    CHECK(body_of(recorder.path()) == recorder.sent(0, 600'000));
  }
  Recorder recorder;
  recorder.fake.unplugging_register = 0x7008;
  const CommandRun run = recorder.record({});
  CHECK(run.exit_code == 1);
  CHECK(has(run.err, "register 0x7008: the camera was unplugged"));
  CHECK(recorder.bench.seconds_since_unplugged() < max_hang_s());
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

TEST_CASE("lecalib record: killed at any time it leaves a file that opens, up to its last whole word") {
  for (const std::uintmax_t size : {0U, 3'000U, 200'000U, 900'000U}) {
    Recorder recorder;
    recorder.fake.stream.bytes_per_s = 2e6;
    recorder.fake.stream.faults.max_transfer = 7000;
    recorder.bench.meanwhile = [&](pid_t pid) {
      if (std::filesystem::exists(recorder.path()) && std::filesystem::file_size(recorder.path()) > size) {
        (void)::kill(pid, SIGKILL);
      }
    };
    CHECK(recorder.record({}).exit_code == -1);
    const std::string body = body_of(recorder.path());
    CHECK(body.size() % 2 == 0);
    CHECK(body == recorder.sent(0, body.size()));
    CHECK(run_lecalib({"info", recorder.path()}).exit_code == (body.empty() ? 1 : 0));
  }
}

TEST_CASE("lecalib record: without room from the begin it says so and stops the camera") {
  Recorder recorder;
  const CommandRun run = recorder.bench.run({"record", "/dev/full", "--seconds", "60"});
  CHECK(run.exit_code == 1);
  CHECK(has(run.err, "/dev/full"));
  CHECK(has(run.err, "no space left"));
  CHECK_FALSE(recorder.fake.is_streaming());
}

TEST_CASE("lecalib record: a disk that becomes full, or a limit to files, is said by name, what is there opens") {
  constexpr std::size_t kRoom = 300'001;  // not whole words
  for (const bool is_disk : {true, false}) {
    Recorder recorder;
    recorder.fake.stream.bytes_per_s = 2e6;
    std::optional<SmallDisk> disk;
    if (is_disk) disk.emplace(recorder.folder / "", kRoom);
    if (is_disk && !disk->is_there) {
      MESSAGE("skipped: only root can make a small disk");
      continue;
    }
    bool is_limited = is_disk;
    recorder.bench.meanwhile = [&](pid_t pid) {
      const rlimit limit{kRoom, kRoom};
      if (!is_limited) is_limited = ::prlimit(pid, RLIMIT_FSIZE, &limit, nullptr) == 0;
    };
    const CommandRun run = recorder.record({"--seconds", "60"});
    CHECK(run.exit_code == 1);
    CHECK_MESSAGE(has(run.err, recorder.path()), run.err);
    CHECK_MESSAGE(has(run.err, is_disk ? "no space left" : "too large"), run.err);
    CHECK_FALSE(recorder.fake.is_streaming());
    const std::string body = body_of(recorder.path());
    CHECK(body.size() > 200'000);
    CHECK(body.size() % 2 == 0);
    CHECK(body == recorder.sent(0, body.size()));
    CHECK(run_lecalib({"info", recorder.path()}).exit_code == 0);
  }
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
