// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <filesystem>

#include "lecalib/host/file_io.hpp"
#include "support/aedat4_encoder.hpp"
#include "support/record_encoder.hpp"
#include "support/run_command.hpp"
#include "support/temporary_folder.hpp"

using namespace lecalib::test;

namespace {

constexpr char kRows[] = "t_us,x,y,p\n1000,3,4,1\n2000,319,5,0\n501000,7,239,1\n";

std::string content(const std::string& path) { return lecalib::host::read_text_file(path).value(); }

std::string with_content(const TemporaryFolder& folder, const std::string& name, const std::string& text) {
  REQUIRE_FALSE(lecalib::host::write_file(folder / name, text));
  return folder / name;
}

}  // namespace

TEST_CASE("lecalib convert: CSV to RAW and back gives the same bytes") {
  const TemporaryFolder folder;
  const std::string csv = with_content(folder, "e.csv", kRows);
  const CommandRun there = run_lecalib({"convert", csv, folder / "e.raw", "--sensor", "320x240"});
  CHECK(there.exit_code == 0);
  CHECK(there.out == "3 events written to " + (folder / "e.raw") + "\n");
  CHECK(there.err.empty());
  CHECK(content(folder / "e.raw").find("% geometry 320x240\n") != std::string::npos);
  CHECK(run_lecalib({"convert", folder / "e.raw", folder / "back", "--format", "csv"}).exit_code == 0);
  CHECK(content(folder / "back") == kRows);
}

TEST_CASE("lecalib convert: to a pipe only the events go") {
  const TemporaryFolder folder;
  const std::string csv = with_content(folder, "e.csv", kRows);
  const CommandRun run = run_lecalib({"convert", csv, "/dev/stdout", "--format", "csv"});
  CHECK(run.exit_code == 0);
  CHECK(run.out == kRows);
  CHECK(run.err == "3 events written to /dev/stdout\n");
  CHECK(std::filesystem::is_symlink("/dev/stdout"));
}

TEST_CASE("lecalib convert: IMU samples and triggers go to files of their own") {
  const TemporaryFolder folder;
  const Bytes bytes = aedat4_header(0, aedat4_xml(346, 260)) + aedat4_packet(0, aedat4_events({{1, 2, 3, 1}})) +
                      aedat4_packet(2, aedat4_imu({{5, {}}, {6, {}}, {6, {}}})) +
                      aedat4_packet(3, aedat4_triggers(9, {1}));
  const std::string recording = with_content(folder, "e.aedat4", std::string(bytes.begin(), bytes.end()));
  const CommandRun run = run_lecalib(
      {"convert", recording, folder / "e.csv", "--imu", folder / "imu.csv", "--triggers", folder / "t.csv"});
  CHECK(run.exit_code == 0);
  CHECK(run.out.find("2 IMU samples written to " + (folder / "imu.csv") + "\n") != std::string::npos);
  CHECK(run.out.find("1 IMU samples left out, no later than the one before\n") != std::string::npos);
  CHECK(run.out.find("1 triggers written to " + (folder / "t.csv") + "\n") != std::string::npos);
  CHECK(content(folder / "imu.csv").find("\n6,-0,0,-0,") != std::string::npos);
  CHECK(content(folder / "t.csv") == "t_us,channel,kind\n9,1,rising\n");

  const CommandRun twice = run_lecalib({"convert", recording, folder / "e.csv", "--imu", folder / "e.csv"});
  CHECK(twice.exit_code == 1);
  CHECK(twice.err.find("is written twice") != std::string::npos);
  const CommandRun itself = run_lecalib({"convert", recording, folder / "f.csv", "--triggers", recording});
  CHECK(itself.err.find("is the recording itself") != std::string::npos);
  CHECK(content(recording).size() == bytes.size());
}

TEST_CASE("lecalib convert: a DAT file of triggers alone becomes rows of triggers") {
  const TemporaryFolder folder;
  const std::vector<lecalib::TriggerEvent> triggers = {{5, 1, lecalib::TriggerKind::rising},
                                                       {7, 1, lecalib::TriggerKind::falling}};
  const Bytes bytes =
      to_bytes("% Data file containing Trigger events.\n% Version 2\n% end\n\x0e\x08") + encode_dat_triggers(triggers);
  const std::string recording = with_content(folder, "t.dat", std::string(bytes.begin(), bytes.end()));
  const CommandRun run = run_lecalib({"convert", recording, folder / "e.csv", "--triggers", folder / "t.csv"});
  CHECK(run.exit_code == 0);
  CHECK(run.out.find("0 events written to ") == 0);
  CHECK(content(folder / "t.csv") == "t_us,channel,kind\n5,1,rising\n7,1,falling\n");
  CHECK(run_lecalib({"convert", recording, folder / "f.csv"}).err.find("holds no events, only") != std::string::npos);
  const CommandRun raw = run_lecalib({"convert", recording, folder / "e.raw", "--triggers", folder / "u.csv"});
  CHECK(raw.err.find("holds no events, only") != std::string::npos);
}

TEST_CASE("lecalib convert: IMU samples of EVT2 come out, and calibrate does not take their unknown range for known") {
  const TemporaryFolder folder;
  std::vector<Word> words = evt2_imu(1, {0, 16384, 0, 0, -8192, 0});
  words.insert(words.begin(), {8, 1});
  const Bytes bytes = to_bytes("% evt 2.0\n% geometry 640x480\n% end\n") + evt2_bytes(words) +
                      encode_evt2({{200, 1, 2, 1}, {300, 1, 2, 0}});
  const std::string recording = with_content(folder, "e.raw", std::string(bytes.begin(), bytes.end()));
  CHECK(run_lecalib({"convert", recording, folder / "e.csv", "--imu", folder / "imu.csv"}).exit_code == 0);
  const std::string imu = content(folder / "imu.csv");
  CHECK_MESSAGE(imu.find("\n65,-0,8.7266") != std::string::npos, imu);
  CHECK_MESSAGE(imu.find(",-9.80665") != std::string::npos, imu);
  const CommandRun run = run_lecalib(
      {"calibrate", recording, "--target", "box:0.4x0.3x0.25", "--gyro", "recording", "--out", folder / "out"});
  CHECK(run.exit_code == 1);
  CHECK_MESSAGE(run.err.find("EVT2 does not tell the range of its gyro") != std::string::npos, run.err);
}

TEST_CASE("lecalib convert: what a format leaves out is said") {
  const TemporaryFolder folder;
  const Bytes bytes = to_bytes("% Data file\n% Version 2\n\x0c\x08") +
                      encode_dat({{20'000'000, 5, 6, 1}, {20'000'009, 400, 6, 1}, {20'000'010, 7, 8, 0}});
  const std::string dat = with_content(folder, "e.dat", std::string(bytes.begin(), bytes.end()));
  const CommandRun run = run_lecalib({"convert", dat, folder / "e.raw", "--sensor", "304x240"});
  CHECK(run.exit_code == 0);
  CHECK(run.out.find("2 events written to ") == 0);
  CHECK(run.out.find("1 events beside the sensor or without a time left out\n") != std::string::npos);
  CHECK(run.out.find("less by 16777216 us") != std::string::npos);
  const CommandRun guessed = run_lecalib({"convert", dat, folder / "e.raw"});
  CHECK(guessed.out.find("sensor of 401x9 by the largest coordinates") != std::string::npos);
}

TEST_CASE("lecalib convert: the recording itself is never overwritten, nor anything after an error") {
  const TemporaryFolder folder;
  const std::string csv = with_content(folder, "e.csv", kRows);
  std::filesystem::create_symlink(csv, folder / "link.csv");
  for (const std::string& out : {csv, folder / "link.csv", folder / "./e.csv"}) {
    const CommandRun run = run_lecalib({"convert", csv, out});
    CHECK(run.exit_code == 1);
    CHECK(run.err.find("is the recording itself") != std::string::npos);
    CHECK(content(csv) == kRows);
  }
  const std::string other = with_content(folder, "other.raw", "keep");
  const std::string broken = with_content(folder, "broken.csv", "1,2,3,1\n2,2,3,7\n");
  CHECK(run_lecalib({"convert", broken, other, "--sensor", "10x10"}).exit_code == 1);
  const std::string old = with_content(folder, "old.csv", "1,2,3,1\n-2,2,3,1\n");
  const CommandRun negative = run_lecalib({"convert", old, other, "--sensor", "10x10"});
  CHECK(negative.exit_code == 1);
  CHECK(negative.err == "lecalib: " + old + ": event 1 is older than 0, which EVT3 cannot hold\n");
  CHECK(content(other) == "keep");
  const CommandRun nameless = run_lecalib({"convert", csv, folder / "e.aedat"});
  CHECK(nameless.exit_code == 1);
  CHECK(nameless.err.find("tells no format") != std::string::npos);
  CHECK(run_lecalib({"convert", csv, folder / "e", "--format", "dat"}).exit_code > 1);
  CHECK(folder.count() == 5);
}
