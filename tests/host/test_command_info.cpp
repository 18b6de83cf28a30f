// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include "lecalib/host/file_io.hpp"
#include "support/aedat4_encoder.hpp"
#include "support/json_file.hpp"
#include "support/record_encoder.hpp"
#include "support/run_command.hpp"
#include "support/shared_data.hpp"
#include "support/temporary_folder.hpp"

using namespace lecalib::test;

TEST_CASE("lecalib info: counts, times and size of a text") {
  const TemporaryFolder folder;
  REQUIRE_FALSE(lecalib::host::write_file(folder / "e.csv", "t_us,x,y,p\n1000,3,4,1\n2000,319,5,0\n501000,7,239,1\n"));
  const CommandRun run = run_lecalib({"info", "--json", "--sensor", "320x240", folder / "e.csv"});
  CHECK(run.exit_code == 0);
  CHECK(run.err.empty());
  const auto json = json_in(run.out);
  CHECK(json["format"] == "text");
  CHECK(json["width"] == 320);
  CHECK(json["events"] == 3);
  CHECK(json["first_us"] == 1000);
  CHECK(json["last_us"] == 501000);
  CHECK(json["events_per_s"] == 6.0);
  CHECK(json["on_share"].get<double>() == doctest::Approx(2.0 / 3));
  const CommandRun text = run_lecalib({"info", folder / "e.csv"});
  CHECK(text.exit_code == 0);
  CHECK(text.out.find("0.001000 to 0.501000 s") != std::string::npos);
}

TEST_CASE("lecalib info: from when to when triggers and IMU samples came") {
  const TemporaryFolder folder;
  const Bytes bytes = aedat4_header(0, aedat4_xml(346, 260)) + aedat4_packet(2, aedat4_imu({{5, {}}, {3, {}}})) +
                      aedat4_packet(0, aedat4_events({{1, 2, 3, 1}})) + aedat4_packet(3, aedat4_triggers(900'000, {1}));
  REQUIRE_FALSE(lecalib::host::write_file(folder / "e", std::string(bytes.begin(), bytes.end())));
  const auto json = json_in(run_lecalib({"info", "--json", folder / "e"}).out);
  CHECK(json["imu"]["first_us"] == 3);
  CHECK(json["imu"]["last_us"] == 5);
  CHECK(json["triggers"]["first_us"] == 900'000);
  CHECK(json["decoder"]["imu_samples"] == 2);
  const CommandRun text = run_lecalib({"info", folder / "e"});
  CHECK(text.out.find("IMU       0.000003 to 0.000005 s\n") != std::string::npos);
  CHECK(text.out.find("triggers  0.900000 to 0.900000 s\n") != std::string::npos);
}

TEST_CASE("lecalib info: a file of triggers alone, however many there are") {
  const TemporaryFolder folder;
  std::vector<lecalib::TriggerEvent> triggers;
  for (int i = 0; i < 300'000; ++i) triggers.push_back({50 * i, 0, lecalib::TriggerKind::rising});
  const Bytes bytes = to_bytes("% Data file containing Trigger events.\n% Version 2\n% end\n") + Bytes{14, 8} +
                      encode_dat_triggers(triggers);
  REQUIRE_FALSE(lecalib::host::write_file(folder / "t.dat", std::string(bytes.begin(), bytes.end())));
  const auto json = json_in(run_lecalib({"info", "--json", folder / "t.dat"}).out);
  CHECK(json["format"] == "DAT of triggers");
  CHECK(json["events"] == 0);
  CHECK(json["decoder"]["triggers"] == 300'000);
  CHECK(json["triggers"]["last_us"] == 50 * 299'999);
  const CommandRun text = run_lecalib({"info", folder / "t.dat"});
  CHECK(text.out.find("triggers  0.000000 to 14.999950 s\n") != std::string::npos);
  CHECK(text.out.find("sensor") == std::string::npos);
  const CommandRun wrong = run_lecalib({"detect", folder / "t.dat", "--out", folder / "lines.csv"});
  CHECK(wrong.exit_code == 1);
  CHECK(wrong.err == "lecalib: " + (folder / "t.dat") + ": holds no events, only triggers or IMU samples\n");
}

TEST_CASE("lecalib info: real recordings hold what is written beside them") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  struct Recording {
    const char* file;
    const char* format;
    int events;
    int width, height;
  };
  constexpr Recording kRecordings[] = {{"gen3_evt3/events.raw", "EVT3", 343'474, 640, 480},
                                       {"gen3_evt2/events.raw", "EVT2", 521'252, 640, 480},
                                       {"atis_dat/events.dat", "DAT", 4'407, 54, 61},
                                       {"davis240c_shapes/events.txt", "text", 20'000, 240, 180},
                                       {"davis240c_slider/events.txt", "text", 50'000, 240, 180},
                                       {"davis346_lab_aedat4/davis.aedat4", "AEDAT 4", 117'667, 346, 260},
                                       {"davis346_tags/events.csv.gz", "text", 571'266, 346, 260}};
  for (const Recording& recording : kRecordings) {
    CAPTURE(recording.file);
    const CommandRun run = run_lecalib({"info", "--json", (*data / "real" / recording.file).string()});
    const bool is_left_out =
        run.err.find("a build of lecalib with") != std::string::npos || run.err.find("found gzip") != std::string::npos;
    if (is_left_out) {
      MESSAGE("skipped: built without LZ4 or zlib");
      continue;
    }
    REQUIRE(run.exit_code == 0);
    const auto json = json_in(run.out);
    CHECK(json["format"] == recording.format);
    CHECK(json["events"] == recording.events);
    CHECK(json["width"] == recording.width);
    CHECK(json["height"] == recording.height);
    CHECK(json["decoder"]["outside"] == 0);
    CHECK(json["decoder"]["undefined_words"] == 0);
  }
  // expected.txt beside the recording, made by another decoder.
  const CommandRun run = run_lecalib({"info", "--json", (*data / "real/gen3_evt3/events.raw").string()});
  const auto json = json_in(run.out);
  CHECK(json["first_us"] == 7139845);
  CHECK(json["last_us"] == 9218023);
  CHECK(json["on_share"].get<double>() == doctest::Approx(125183.0 / 343474));
  CHECK(json["decoder"]["triggers"] > 0);
}
