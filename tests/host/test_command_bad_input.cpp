// SPDX-License-Identifier: MIT
/// Whatever is wrong with the input: one line on stderr that names file and place, an exit code, no file half written.
#include <doctest/doctest.h>

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "lecalib/host/file_io.hpp"
#include "support/json_file.hpp"
#include "support/run_command.hpp"
#include "support/temporary_folder.hpp"

using namespace lecalib::test;
using lecalib::host::read_text_file;
using lecalib::host::write_file;

namespace {

constexpr const char* kEvents = "0.001 1 2 1\n0.002 3 4 0\n0.003 239 179 1\n";
constexpr const char* kModel =
    "0 0 0 1 0 0 bottom\n"
    "1 0 0 1 1 0 right\n"
    "1 1 0 0 1 0 top\n"
    "0 1 0 0 0 0 left\n";

/// The line on stderr, without the program's name.
std::string complaint(const CommandRun& run) {
  CHECK(run.exit_code == 1);
  CHECK(run.out.empty());
  CHECK(run.err.rfind("lecalib: ", 0) == 0);
  CHECK(std::count(run.err.begin(), run.err.end(), '\n') == 1);
  return run.err.size() > 10 ? run.err.substr(9, run.err.size() - 10) : "";
}

std::string made(const TemporaryFolder& folder, const std::string& name, const std::string& content) {
  REQUIRE_FALSE(write_file(folder / name, content));
  return folder / name;
}

bool begins(const std::string& text, const std::string& start) { return text.rfind(start, 0) == 0; }

}  // namespace

TEST_CASE("bad input: events that cannot be read") {
  const TemporaryFolder in;
  const TemporaryFolder out;
  const auto detect = [&](const std::string& events) {
    const std::string text = complaint(run_lecalib({"detect", events, "--sensor", "240x180", "--out", out / "lines.csv",
                                                    "--stats", out / "stats.json", "--svg", out / "w.svg"}));
    CHECK(out.count() == 0);
    return text;
  };
  const std::string empty = made(in, "empty.raw", "");
  CHECK(detect(empty) == empty + ": the file is empty");
  const std::string broken = made(in, "broken.txt", std::string(kEvents) + "0.004 5 six 1\n");
  CHECK(begins(detect(broken), broken + ":4: expected "));
  const std::string cut_text = made(in, "cut.txt", std::string(kEvents) + "0.004 5");
  CHECK(begins(detect(cut_text), cut_text + ":4: expected "));
  const std::string header = "% evt 3.0\n% format EVT3;height=180;width=240\n% end\n";
  const std::string cut_raw = made(in, "cut.raw", header + std::string("\x01\x80\x02\x60\x03\x00\x04\x20\x05", 9));
  CHECK(begins(detect(cut_raw), cut_raw + ": byte "));
  CHECK(detect(in.path()) == in.path() + ": is a directory, expected a file");
  CHECK(detect(in / "none") == (in / "none") + ": cannot open: no such file or directory");
}

TEST_CASE("bad input: a sensor size that cannot be right") {
  const TemporaryFolder folder;
  std::string text;
  for (int i = 0; i < 1000; ++i) text += std::to_string(i) + " " + std::to_string(i % 240) + " 9 1\n";
  const std::string events = made(folder, "e.txt", text);
  const std::string outside =
      complaint(run_lecalib({"detect", events, "--sensor", "100x100", "--out", folder / "l.csv"}));
  CHECK(begins(outside, events + ": "));
  CHECK(outside.find("outside of a sensor of 100x100") != std::string::npos);
  const std::string raw = made(
      folder, "e.raw",
      "% evt 3.0\n% format EVT3;height=180;width=240\n% end\n" + std::string("\x01\x80\x02\x60\x03\x00\x04\x20", 8));
  CHECK(complaint(run_lecalib({"info", raw, "--sensor", "640x480"})) ==
        raw + ": the file is of a sensor of 240x180, not 640x480");
  CHECK(folder.count() == 2);
}

TEST_CASE("bad input: a sensor too small or too large to find lines on") {
  const TemporaryFolder folder;
  const std::string wide = made(folder, "wide.txt", "1 4096 5 1\n2 3 19 0\n");
  CHECK(complaint(run_lecalib({"detect", wide, "--out", folder / "l.csv"})) ==
        wide + ": lines are found on sensors of 2x2 to 4096x4096 px, this one has 4097x20");
  const std::string point = made(folder, "point.txt", "1 0 0 1\n2 0 0 0\n");
  CHECK(complaint(run_lecalib({"calibrate", point, "--target", "box:1x1x1"})) ==
        point + ": lines are found on sensors of 2x2 to 4096x4096 px, this one has 1x1");
}

TEST_CASE("bad input: a file's own name does not break the line") {
  const TemporaryFolder folder;
  CHECK(complaint(run_lecalib({"info", folder / "a\n\x1b[31mb"})) ==
        (folder / "a??[31mb") + ": cannot open: no such file or directory");
}

TEST_CASE("bad input: the recording or the target is named as a result") {
  const TemporaryFolder folder;
  const std::string events = made(folder, "e.txt", kEvents);
  const std::string model = made(folder, "model.txt", kModel);
  CHECK(complaint(run_lecalib({"detect", events, "--sensor", "240x180", "--out", folder / "./e.txt"})) != "");
  CHECK(complaint(run_lecalib({"detect", events, "--sensor", "240x180", "--out", events})) ==
        events + ": is the recording, expected another name for the result");
  CHECK(complaint(run_lecalib({"simulate", "--target", "file:" + model, "--sensor", "64x48", "--duration-s", "0.01",
                               "--out", folder.path()})) ==
        model + ": is the target's own file, expected another folder for the recording");
  CHECK(read_text_file(events).value() == kEvents);
  CHECK(read_text_file(model).value() == kModel);
  CHECK(folder.count() == 2);
}

TEST_CASE("bad input: a model of more lines than the search takes") {
  const TemporaryFolder folder;
  const std::string events = made(folder, "e.txt", kEvents);
  CHECK(complaint(run_lecalib({"calibrate", events, "--sensor", "240x180", "--target", "checkerboard:99x99:0.01"})) ==
        "checkerboard:99x99:0.01: expected at most 128 lines to search a recording for, the model has 202");
}

TEST_CASE("bad input: a folder to write to that does not exist") {
  const TemporaryFolder folder;
  const std::string events = made(folder, "e.txt", kEvents);
  CHECK(complaint(run_lecalib({"detect", events, "--sensor", "240x180", "--out", folder / "no/lines.csv"})) ==
        (folder / "no/lines.csv") + ": cannot write: no such file or directory");
  CHECK(folder.count() == 1);
}

TEST_CASE("bad input: no permission") {
  const TemporaryFolder folder;
  const std::string events = made(folder, "e.txt", kEvents);
  REQUIRE(::chmod(folder.path().c_str(), 0755) == 0);
  REQUIRE(::chmod(events.c_str(), 0000) == 0);
  const RunAs who = ::getuid() == 0 ? RunAs::nobody : RunAs::me;
  const CommandRun run = run_lecalib({"info", events}, who);
  if (run.exit_code == kCannotRun) {
    MESSAGE("skipped: nobody may run the program in this folder");
    return;
  }
  CHECK(complaint(run) == events + ": cannot open: permission denied");
}

TEST_CASE("bad input: a model or observations that cannot be used say so in calibration.json too") {
  const TemporaryFolder in;
  const TemporaryFolder out;
  const std::string model = made(in, "model.txt", kModel);
  const std::string observations = made(in, "o.csv", "view,line,u_px,v_px\n0,top,1,2\n0,top,30,4\n");
  REQUIRE_FALSE(write_file(out / "calibration.yaml", "of an earlier run"));
  const auto calibrate = [&](const std::string& model_file, const std::string& observation_file) {
    const std::string text = complaint(run_lecalib({"calibrate", "--observations", observation_file, "--model",
                                                    model_file, "--sensor", "640x480", "--out", out.path()}));
    CHECK(out.count() == 1);
    const auto json = json_of(out / "calibration.json");
    CHECK(json["status"] != "ok");
    CHECK(json["cameras"].empty());
    CHECK(json["diagnostics"]["reason"].get<std::string>().size() > 10);
    return text;
  };
  const std::string one = made(in, "one.txt", "0 0 0 1 0 0 bottom\n");
  CHECK(calibrate(one, observations) == one + ":1: expected at least 4 lines in the model, found 1");
  const std::string nan = made(in, "nan.txt", std::string(kModel) + "0 0 nan 1 1 1 depth\n");
  CHECK(calibrate(nan, observations) == nan + ":5:5: expected a finite number of metres, found 'nan'");
  const std::string broken = made(in, "broken.csv", "view,line,u_px,v_px\n0,top,1,2\n0,top,thirty,4\n");
  CHECK(calibrate(model, broken) == broken + ":3:7: expected a finite number of pixels, found 'thirty'");
  CHECK(calibrate(model, in / "none.csv") == (in / "none.csv") + ": cannot open: no such file or directory");
  CHECK(begins(calibrate(model, observations), "no camera (too_few_lines): "));
}
