// SPDX-License-Identifier: MIT
/// lecalib calibrate --observations.
#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lecalib/host/file_io.hpp"
#include "lecalib/host/model_file.hpp"
#include "lecalib/host/text.hpp"
#include "support/json_file.hpp"
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
