// SPDX-License-Identifier: MIT
/// lecalib calibrate EVENTS.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/host/event_file.hpp"
#include "lecalib/host/file_io.hpp"
#include "lecalib/host/text.hpp"
#include "lecalib/math/so3.hpp"
#include "support/aedat4_encoder.hpp"
#include "support/json_file.hpp"
#include "support/run_command.hpp"
#include "support/shared_data.hpp"
#include "support/temporary_folder.hpp"

using namespace lecalib::test;
using namespace lecalib::host;

TEST_CASE("lecalib calibrate: a gyro tells the turns of a recording's windows, in the axes and on the clock it says") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const TemporaryFolder folder;
  const std::string recording = (*data / "sim" / "02_box_davis346_sweep").string();
  const auto truth = json_of(recording + "/truth.json");
  const auto times = truth["poses"]["t_us"].get<std::vector<double>>();
  const auto turns = truth["poses"]["q_wxyz"].get<std::vector<std::vector<double>>>();
  const auto rotation = [&](std::size_t i) {
    return Eigen::Quaterniond(turns[i][0], turns[i][1], turns[i][2], turns[i][3]).toRotationMatrix();
  };
  std::string gyro = "t_us,wx,wy,wz\n";
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    const lecalib::Vec3 rate =
        -lecalib::so3_log(rotation(i + 1) * rotation(i).transpose()) / (1e-6 * (times[i + 1] - times[i]));
    gyro += std::to_string(std::llround(0.5 * (times[i] + times[i + 1])));
    for (int k = 0; k < 3; ++k) gyro += "," + shortest(rate(k));
    gyro += "\n";
  }
  REQUIRE_FALSE(write_file(folder / "gyro.csv", gyro));
  const CommandRun run =
      run_lecalib({"calibrate", recording + "/events.raw", "--model", recording + "/model.txt", "--gyro",
                   folder / "gyro.csv", "--gyro-bias", "1e-4", "--gyro-noise", "1e-4", "--out", folder / "out"});
  CAPTURE(run.err);
  REQUIRE(run.exit_code == 0);
  const auto result = json_of(folder / "out/calibration.json");
  CHECK(result["diagnostics"]["counts"]["turns"].get<int>() + 4 >=
        result["diagnostics"]["counts"]["windows_matched"].get<int>());  // windows at the ends may lie outside
  // Turns of wrong axes, signs or times would contradict the lines by many sigma.
  const auto& camera = result["cameras"][0];
  for (const char* name : {"fx", "fy", "cx", "cy"}) {
    const double error = camera[name].get<double>() - truth["camera"][name].get<double>();
    CHECK(std::abs(error) < 4 * camera["sigma"][name].get<double>());
  }
  CHECK(camera["rms_px"].get<double>() < 1.0);
}

TEST_CASE("lecalib calibrate: a recording of a box gives its camera without a hint") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const TemporaryFolder folder;
  const std::string box = (*data / "sim/07_box_evk4_shake").string();
  const CommandRun run =
      run_lecalib({"calibrate", box + "/events.raw", "--model", box + "/model.txt", "--out", folder.path()});
  CHECK(run.err == "");
  REQUIRE(run.exit_code == 0);
  const auto json = json_of(folder / "calibration.json");
  const auto camera = json["cameras"].at(0);
  const auto truth = json_of(box + "/truth.json")["camera"];
  CHECK(camera["width"] == 1280);
  CHECK(camera["fx"].get<double>() == doctest::Approx(truth["fx"].get<double>()).epsilon(0.02));
  CHECK(camera["fy"].get<double>() == doctest::Approx(truth["fy"].get<double>()).epsilon(0.02));
  CHECK(json["views"].size() >= 10);
  CHECK(json["diagnostics"]["counts"]["windows_matched"] >= 5);
  CHECK(json["diagnostics"]["cpu_ms"]["match_and_solve"].get<double>() > 0);
}

TEST_CASE("lecalib calibrate: a box measured 2 cm wrong is refused: no sensor's pixels are so far from square") {
  const TemporaryFolder folder;
  const std::string events = (source_dir() / "examples/data/events.raw").string();
  const CommandRun run = run_lecalib({"calibrate", events, "--target", "box:0.40x0.30x0.27", "--out", folder.path()});
  CHECK(run.exit_code == 1);
  CHECK(run.err.find("check the model's dimensions") != std::string::npos);
  CHECK(json_of(folder / "calibration.json")["cameras"].empty());
}

TEST_CASE("lecalib calibrate: a recording without lines is refused with a reason") {
  const TemporaryFolder folder;
  lecalib::Rng rng(3);
  std::string noise = "t_us,x,y,p\n";
  for (int t = 0; t < 100'000; t += 20) {
    const std::uint32_t x = rng.below(320);
    const std::uint32_t y = rng.below(240);
    noise += std::to_string(t) + "," + std::to_string(x) + "," + std::to_string(y) + ",1\n";
  }
  REQUIRE_FALSE(write_file(folder / "noise.csv", noise));
  const CommandRun run = run_lecalib({"calibrate", folder / "noise.csv", "--target", "rectangle:0.297x0.21", "--sensor",
                                      "320x240", "--out", folder / "result"});
  CHECK(run.exit_code == 1);
  CHECK(run.out.empty());
  CHECK(run.err.rfind("lecalib: no camera (", 0) == 0);
  CHECK(std::count(run.err.begin(), run.err.end(), '\n') == 1);
  const auto json = json_of(folder / "result/calibration.json");
  CHECK(json["status"] != "ok");
  CHECK(json["cameras"].empty());
  CHECK(json["diagnostics"]["counts"]["events"] == 5000);
  CHECK(json["diagnostics"]["coverage"]["hints"][0] == "show_object");
  CHECK(run.err.find("bring the object into view") != std::string::npos);
}

TEST_CASE("lecalib calibrate: hints decide nothing that the lines tell otherwise") {
  const std::string events = (source_dir() / "examples/data/events.raw").string();
  const TemporaryFolder folder;
  const auto calibrate = [&](const std::vector<std::string>& hints) {
    std::vector<std::string> arguments = {"calibrate",          events,  "--target",
                                          "box:0.40x0.30x0.25", "--out", folder.path()};
    arguments.insert(arguments.end(), hints.begin(), hints.end());
    return run_lecalib(arguments);
  };
  REQUIRE(calibrate({}).exit_code == 0);
  const double blind = json_of(folder / "calibration.json")["cameras"][0]["fx"];
  const double sigma = json_of(folder / "calibration.json")["cameras"][0]["sigma"]["fx"];
  for (const std::vector<std::string>& hints :
       {std::vector<std::string>{"--focal", "310"}, {"--focal", "900"}, {"--hint-pose", "0,0,0,0,0,1"}}) {
    CAPTURE(hints[1]);
    if (calibrate(hints).exit_code != 0) continue;
    CHECK(json_of(folder / "calibration.json")["cameras"][0]["fx"] == doctest::Approx(blind).epsilon(sigma / blind));
  }
  CHECK(calibrate({"--focal", "99999"}).err.find("--focal") != std::string::npos);
  CHECK(calibrate({"--hint-pose", "0,0,0,0,0"}).err.find("RX,RY,RZ,TX,TY,TZ") != std::string::npos);
}

TEST_CASE("lecalib calibrate: a refusal says what the recording lacks") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const TemporaryFolder folder;
  for (const char* name : {"03_door_genx320_hover", "06_corridor_vga_hover"}) {  // before them, hardly turning
    CAPTURE(name);
    const auto recording = *data / "sim" / name;
    const CommandRun run = run_lecalib({"calibrate", (recording / "events.raw").string(), "--model",
                                        (recording / "model.txt").string(), "--out", folder.path()});
    CHECK(run.exit_code == 1);
    CHECK(run.err.find("tilt the object") != std::string::npos);
    CHECK(std::count(run.err.begin(), run.err.end(), '\n') == 1);
    const auto coverage = json_of(folder / "calibration.json")["diagnostics"]["coverage"];
    CHECK(coverage["tilt_deg"] < 20);  // as seen by a camera that is not determined
    CHECK(coverage["covered_share"] > 0.5);
  }
}

TEST_CASE("lecalib calibrate: a refusal names the model's lines that are not where the model has them") {
  const TemporaryFolder folder;
  const std::string events = (source_dir() / "examples/data/events.raw").string();
  const std::string near_edges =
      "0 0 0 0.32 0 0 front_bottom\n0 0 0 0 0.3 0 side_bottom\n0 0 0 0 0 0.25 corner\n"
      "0 0.3 0 0 0.3 0.25 side_back\n0 0 0.25 0.32 0 0.25 top_front\n0 0 0.25 0 0.3 0.25 top_side\n"
      "0 0.3 0.25 0.32 0.3 0.25 top_back\n";
  const std::string far_edges = "0.32 0 0 0.32 0 0.25 front_right\n0.32 0 0.25 0.32 0.3 0.25 top_right\n";
  REQUIRE_FALSE(write_file(folder / "short.txt", near_edges + far_edges));  // the box is 0.40 m long
  const CommandRun run = run_lecalib({"calibrate", events, "--model", folder / "short.txt"});
  CHECK(run.exit_code == 1);
  CHECK(run.err.find("hardly ever found: front_right top_right (") != std::string::npos);
  CHECK(std::count(run.err.begin(), run.err.end(), '\n') == 1);
}

TEST_CASE("lecalib calibrate: a model without a flat face is refused for what it lacks, not for the motion") {
  const TemporaryFolder folder;
  const std::string events = (source_dir() / "examples/data/events.raw").string();
  REQUIRE_FALSE(
      write_file(folder / "corner.txt", "0 0 0 0.4 0 0 a\n0 0 0 0 0.3 0 b\n0 0 0 0 0 0.25 c\n0.4 0 0 0.4 0 0.25 d\n"));
  const CommandRun run = run_lecalib({"calibrate", events, "--model", folder / "corner.txt"});
  CHECK(run.exit_code == 1);
  CHECK(run.err.find("no four of its lines enclose a flat face") != std::string::npos);
  CHECK(run.err.find("tilt") == std::string::npos);
}

TEST_CASE("lecalib calibrate: contradicting options are one line") {
  const std::vector<std::vector<std::string>> wrong = {
      {"calibrate"},
      {"calibrate", "--observations", "o.csv"},
      {"calibrate", "--observations", "o.csv", "--target", "rectangle:1x1"},
      {"calibrate", "--observations", "o.csv", "--target", "rectangle:1x1", "--model", "m.txt", "--sensor", "640x480"},
      {"calibrate", "--observations", "o.csv", "--target", "disc:1", "--sensor", "640x480"}};
  for (const auto& arguments : wrong) {
    const CommandRun run = run_lecalib(arguments);
    CHECK(run.exit_code != 0);
    CHECK(run.err.rfind("lecalib: ", 0) == 0);
    CHECK(std::count(run.err.begin(), run.err.end(), '\n') == 1);
  }
}

TEST_CASE("lecalib calibrate: the IMU in a recording is as good as a file of its readings") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const TemporaryFolder folder;
  const std::string recording = (*data / "sim" / "02_box_davis346_sweep").string();
  auto file = EventFile::open(recording + "/events.raw", {});
  REQUIRE(file.ok());
  Bytes bytes = aedat4_header(0, aedat4_xml(346, 260));
  std::int64_t next_us = 0;
  while (true) {
    const auto events = file.value().read();
    REQUIRE(events.ok());
    if (events.value().empty()) break;
    // A gyro that does not turn: a wrong reading shows more than a right one.
    std::vector<Aedat4Imu> samples;
    for (; next_us <= events.value()[events.value().size() - 1].t_us + 2000; next_us += 1000) {
      samples.push_back({next_us, {25, 0, -1, 0, 1, 2, 3}});
    }
    bytes = std::move(bytes) + aedat4_packet(2, aedat4_imu(samples)) +
            aedat4_packet(0, aedat4_events({events.value().begin(), events.value().end()}));
  }
  REQUIRE_FALSE(write_file(folder / "r.aedat4", std::string(bytes.begin(), bytes.end())));
  REQUIRE(run_lecalib({"convert", folder / "r.aedat4", folder / "e.csv", "--imu", folder / "imu.csv"}).exit_code == 0);
  const auto camera_with = [&](const std::string& gyro, const std::string& out) {
    (void)run_lecalib({"calibrate", folder / "r.aedat4", "--model", recording + "/model.txt", "--gyro", gyro,
                       "--gyro-bias", "0.1", "--out", folder / out});
    const auto result = json_of(folder / out + "/calibration.json");
    CHECK(result["diagnostics"]["counts"]["turns"].get<int>() > 10);
    return result["cameras"][0];
  };
  CHECK(camera_with("recording", "a") == camera_with(folder / "imu.csv", "b"));

  const CommandRun none =
      run_lecalib({"calibrate", recording + "/events.raw", "--model", recording + "/model.txt", "--gyro", "recording"});
  CHECK(none.exit_code == 1);
  CHECK(none.err.find("holds no IMU samples") != std::string::npos);
  const CommandRun two = run_lecalib({"calibrate", recording + "/events.raw", recording + "/events.raw", "--model",
                                      recording + "/model.txt", "--gyro", "recording"});
  CHECK(two.err.find("--gyro recording needs one recording as EVENTS") != std::string::npos);
}
