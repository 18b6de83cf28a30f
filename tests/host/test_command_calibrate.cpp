// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/host/event_file.hpp"
#include "lecalib/host/file_io.hpp"
#include "lecalib/host/model_file.hpp"
#include "lecalib/host/text.hpp"
#include "lecalib/math/so3.hpp"
#include "support/aedat4_encoder.hpp"
#include "support/run_command.hpp"
#include "support/shared_data.hpp"
#include "support/temporary_folder.hpp"

using namespace lecalib::test;
using namespace lecalib::host;

namespace {

constexpr double kFocal = 400;
constexpr double kCentreX = 310;
constexpr double kCentreY = 245;

/// Three points on each edge of a box in each of four views of an ideal camera that turns about the box.
std::string box_observations(const Model& box) {
  std::string text = "view,line,u_px,v_px,sigma_px\n";
  for (int view = 0; view < 4; ++view) {
    const double yaw = 0.35 + 0.25 * view;
    const double tilt = 0.4 - 0.1 * view;
    for (std::size_t i = 0; i < box.lines.size(); ++i) {
      for (const double s : {0.1, 0.5, 0.9}) {
        double p[3];
        for (int k = 0; k < 3; ++k) p[k] = box.lines[i].p[k] * (1 - s) + box.lines[i].q[k] * s - 0.15;
        const double x = std::cos(yaw) * p[0] - std::sin(yaw) * p[2];
        const double depth = std::sin(yaw) * p[0] + std::cos(yaw) * p[2];
        const double y = std::cos(tilt) * p[1] - std::sin(tilt) * depth;
        const double z = std::sin(tilt) * p[1] + std::cos(tilt) * depth + 0.9;
        text += "v" + std::to_string(view) + "," + box.names[i] + "," + shortest(kFocal * x / z + kCentreX) + "," +
                shortest(kFocal * y / z + kCentreY) + ",0.05\n";
      }
    }
  }
  return text;
}

nlohmann::json json_of(const std::string& path) {
  const auto text = read_text_file(path);
  REQUIRE(text.ok());
  return nlohmann::json::parse(text.value());
}

}  // namespace

TEST_CASE("lecalib calibrate: points without noise give the camera they came from") {
  const TemporaryFolder folder;
  const auto box = make_target("box:0.4x0.3x0.25");
  REQUIRE(box.ok());
  REQUIRE_FALSE(write_file(folder / "o.csv", box_observations(box.value())));
  const CommandRun run = run_lecalib({"calibrate", "--observations", folder / "o.csv", "--target", "box:0.4x0.3x0.25",
                                      "--sensor", "640x480", "--out", folder / "new/result"});
  CHECK(run.err == "");
  REQUIRE(run.exit_code == 0);
  CHECK(run.out.find("fx") != std::string::npos);
  CHECK(run.out.find(folder / "new/result/calibration.yaml") != std::string::npos);
  const auto json = json_of(folder / "new/result/calibration.json");
  CHECK(json["status"] == "ok");
  const auto& camera = json["cameras"].at(0);
  CHECK(std::abs(camera["fx"].get<double>() - kFocal) < 1e-3);
  CHECK(std::abs(camera["fy"].get<double>() - kFocal) < 1e-3);
  CHECK(std::abs(camera["cx"].get<double>() - kCentreX) < 1e-3);
  CHECK(std::abs(camera["cy"].get<double>() - kCentreY) < 1e-3);
  CHECK(camera["sigma"]["fx"].get<double>() > 0);
  CHECK(camera["rms_px"].get<double>() < 1e-4);
  REQUIRE(json["views"].size() == 4);
  CHECK(json["views"][2]["name"] == "v2");
  CHECK(json["views"][2]["lines"] == 12);
  CHECK(json["diagnostics"]["counts"]["points"] == 4 * 12 * 3);
}

TEST_CASE("lecalib calibrate: --distortion names the model, and k3 goes only with those that have it") {
  const TemporaryFolder folder;
  const auto box = make_target("box:0.4x0.3x0.25");
  REQUIRE(box.ok());
  REQUIRE_FALSE(write_file(folder / "o.csv", box_observations(box.value())));
  const auto with = [&](std::initializer_list<std::string> more) {
    std::vector<std::string> all = {"calibrate", "--observations", folder / "o.csv", "--target",    "box:0.4x0.3x0.25",
                                    "--sensor",  "640x480",        "--out",          folder / "out"};
    all.insert(all.end(), more);
    return run_lecalib(all);
  };
  for (const char* model : {"brown", "polynomial", "division"}) {
    const CommandRun run = with({"--distortion", model});
    CHECK(run.err == "");
    REQUIRE(run.exit_code == 0);
    const auto camera = json_of(folder / "out/calibration.json")["cameras"].at(0);
    CHECK(camera["model"] == model);
    CHECK(std::abs(camera["fx"].get<double>() - kFocal) < 1e-3);
    CHECK(std::abs(camera["k1"].get<double>()) < 1e-4);
  }
  CHECK(with({"--distortion", "polynomial", "--free-k3"}).exit_code == 0);
  const CommandRun division = with({"--distortion", "division", "--free-k3"});
  CHECK(division.exit_code != 0);
  CHECK(division.err.find("--free-k3 does not go with --distortion division") != std::string::npos);
  CHECK(with({"--distortion", "fisheye"}).exit_code != 0);
}

TEST_CASE("lecalib calibrate: --gyro ties views in pairs, and needs their times") {
  const TemporaryFolder folder;
  const auto box = make_target("box:0.4x0.3x0.25");
  REQUIRE(box.ok());
  const std::string text = box_observations(box.value());
  std::string timed;  // views v0 to v3 at 0, 20, 40 and 60 ms
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    const std::string row = text.substr(begin, end - begin);
    timed += row + (begin == 0 ? ",t_us" : "," + std::to_string(20000 * (row[1] - '0'))) + "\n";
    begin = end + 1;
  }
  REQUIRE_FALSE(write_file(folder / "o.csv", text));
  REQUIRE_FALSE(write_file(folder / "timed.csv", timed));
  // R = Rx(tilt) Ry(-yaw) with a yaw that grows by 0.25 and a tilt that falls by 0.1 rad in 20 ms.
  std::string gyro = "t_us,wx,wy,wz\n";
  for (int t_ms = 0; t_ms <= 60; t_ms += 5) {
    const double tilt = 0.4 - 0.1 * t_ms / 20.0;
    const double yaw_rate = 12.5;
    gyro += std::to_string(1000 * t_ms) + "," + shortest(5.0) + "," + shortest(yaw_rate * std::cos(tilt)) + "," +
            shortest(yaw_rate * std::sin(tilt)) + "\n";
  }
  REQUIRE_FALSE(write_file(folder / "gyro.csv", gyro));
  const auto with = [&](const std::string& observations, std::initializer_list<std::string> more) {
    std::vector<std::string> all = {
        "calibrate", "--observations", folder / observations, "--target", "box:0.4x0.3x0.25", "--sensor",
        "640x480",   "--out",          folder / "out"};
    all.insert(all.end(), more);
    return run_lecalib(all);
  };
  REQUIRE(with("timed.csv", {}).exit_code == 0);
  const auto without = json_of(folder / "out/calibration.json");
  const CommandRun run = with("timed.csv", {"--gyro", folder / "gyro.csv", "--gyro-bias", "0.001"});
  CHECK(run.err == "");
  REQUIRE(run.exit_code == 0);
  const auto tied = json_of(folder / "out/calibration.json");
  CHECK(tied["diagnostics"]["counts"]["turns"] == 2);
  CHECK(tied["views"][1]["t_us"] == 20000);
  // Were the axes or signs of the gyro wrong, the camera would be far off.
  CHECK(std::abs(tied["cameras"][0]["fx"].get<double>() - kFocal) < 0.5);
  CHECK(tied["cameras"][0]["sigma"]["fx"].get<double>() <= without["cameras"][0]["sigma"]["fx"].get<double>());
  const CommandRun timeless = with("o.csv", {"--gyro", folder / "gyro.csv"});
  CHECK(timeless.exit_code != 0);
  CHECK(timeless.err.find("--gyro needs the times of the views: a column t_us") != std::string::npos);
  CHECK(with("timed.csv", {"--gyro", folder / "missing.csv"}).exit_code != 0);
  CHECK(with("timed.csv", {"--gyro", folder / "gyro.csv", "--gyro-noise", "-1"}).exit_code != 0);
}

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

TEST_CASE("lecalib calibrate: a line of another name is left out and told, and kept with --trust-lines") {
  const TemporaryFolder folder;
  const auto box = make_target("box:0.4x0.3x0.25");
  REQUIRE(box.ok());
  std::string text = box_observations(box.value());
  const std::string first = "v1," + box.value().names[0] + ",";
  std::string swapped;  // in view v1 the first edge's points are 60 px off
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin) + 1;
    std::string row = text.substr(begin, end - begin);
    if (row.compare(0, first.size(), first) == 0) {
      const std::size_t comma = row.find(',', first.size());
      const double u = std::stod(row.substr(first.size(), comma - first.size()));
      row = first + shortest(u + 60) + row.substr(comma);
    }
    swapped += row;
    begin = end;
  }
  REQUIRE_FALSE(write_file(folder / "o.csv", swapped));
  const std::vector<std::string> command = {"calibrate",        "--observations", folder / "o.csv", "--target",
                                            "box:0.4x0.3x0.25", "--sensor",       "640x480",        "--out"};
  const auto with = [&](std::initializer_list<std::string> more) {
    std::vector<std::string> all = command;
    all.insert(all.end(), more);
    return run_lecalib(all);
  };
  const CommandRun rejected = with({folder / "a"});
  REQUIRE(rejected.exit_code == 0);
  CHECK(rejected.out.find("left out, as they do not fit the others: 1 lines") != std::string::npos);
  CHECK(json_of(folder / "a/calibration.json")["diagnostics"]["counts"]["lines_left_out"] == 1);
  CHECK(std::abs(json_of(folder / "a/calibration.json")["cameras"].at(0)["fx"].get<double>() - kFocal) < 1e-3);
  (void)with({folder / "b", "--trust-lines"});
  CHECK(json_of(folder / "b/calibration.json")["diagnostics"]["counts"]["lines_left_out"] == 0);
  CHECK(with({folder / "c", "--max-focal-sigma", "1e-9"}).err.find("too uncertain") != std::string::npos);
  CHECK(with({folder / "d", "--max-focal-sigma", "-1"}).exit_code != 0);
}

TEST_CASE("lecalib calibrate: a real chessboard agrees with its published camera") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const TemporaryFolder folder;
  const std::string board = (*data / "real/gen3_chessboard").string();
  const CommandRun run = run_lecalib({"calibrate", "--observations", board + "/observations.csv", "--model",
                                      board + "/model.txt", "--sensor", "640x480", "--out", folder.path()});
  REQUIRE(run.exit_code == 0);
  const auto camera = json_of(folder / "calibration.json")["cameras"].at(0);
  CHECK(camera["fx"].get<double>() == doctest::Approx(327.485).epsilon(0.01));
  CHECK(camera["fy"].get<double>() == doctest::Approx(327.554).epsilon(0.01));
  CHECK(std::abs(camera["cx"].get<double>() - 318.535) < 2);
  CHECK(std::abs(camera["cy"].get<double>() - 230.964) < 2);
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
