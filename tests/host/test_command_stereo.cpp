// SPDX-License-Identifier: MIT
/// lecalib calibrate --right, and lecalib simulate --right-at.
#include <doctest/doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "lecalib/host/file_io.hpp"
#include "lecalib/host/raw_writer.hpp"
#include "lecalib/math/so3.hpp"
#include "support/box_stream.hpp"
#include "support/json_file.hpp"
#include "support/run_command.hpp"
#include "support/shared_data.hpp"
#include "support/temporary_folder.hpp"

using namespace lecalib::test;
using namespace lecalib::host;
using lecalib::Event;
using lecalib::Mat3;
using lecalib::RowMat3;
using lecalib::Vec3;

namespace {

constexpr const char* kShippedBox = "box:0.40x0.30x0.25";

Mat3 rotation_in(const nlohmann::json& list) {
  std::vector<double> flat;
  for (const auto& row : list) {
    if (row.is_array()) {
      for (const auto& value : row) flat.push_back(value.get<double>());
    } else {
      flat.push_back(row.get<double>());
    }
  }
  REQUIRE(flat.size() == 9);
  return Eigen::Map<const RowMat3>(flat.data());
}

Vec3 vector_in(const nlohmann::json& list) {
  const auto values = list.get<std::vector<double>>();
  REQUIRE(values.size() == 3);
  return {values[0], values[1], values[2]};
}

/// Writes what a sensor of this size, in whose middle the shipped recording lies, has seen.
void write_box(const std::string& path, lecalib::SensorSize sensor, std::int64_t later_us) {
  std::vector<Event> events = box_events(sensor);
  for (Event& event : events) event.t_us += later_us;
  const auto raw = encode_evt3(events, sensor.width, sensor.height);
  REQUIRE(raw.ok());
  REQUIRE_FALSE(write_file(path, raw.value()));
}

}  // namespace

TEST_CASE("lecalib calibrate --right: a camera beside itself stands where it stands") {
  const TemporaryFolder folder;
  write_box(folder / "left.raw", {346, 260}, 0);
  write_box(folder / "right.raw", {400, 300}, 0);
  const CommandRun run = run_lecalib({"calibrate", folder / "left.raw", "--right", folder / "right.raw", "--target",
                                      kShippedBox, "--out", folder / "out"});
  CAPTURE(run.err);
  REQUIRE(run.exit_code == 0);
  CHECK(run.out.find("baseline") != std::string::npos);
  const auto json = json_of(folder / "out/calibration.json");
  REQUIRE(json["cameras"].size() == 2);
  const auto& left = json["cameras"][0];
  const auto& right = json["cameras"][1];
  CHECK(left["name"] == "left");
  CHECK(right["width"] == 400);
  for (const char* focal : {"fx", "fy"}) {
    const double difference = left[focal].get<double>() - right[focal].get<double>();
    CHECK(std::abs(difference) <= 0.5 * left["sigma"][focal].get<double>());
  }
  CHECK(std::abs(right["cx"].get<double>() - left["cx"].get<double>() - 27) <= 0.5 * left["sigma"]["cx"].get<double>());
  CHECK(std::abs(right["cy"].get<double>() - left["cy"].get<double>() - 20) <= 0.5 * left["sigma"]["cy"].get<double>());
  const auto& stereo = json["stereo"];
  const Vec3 turn = lecalib::so3_log(rotation_in(stereo["R_right_left"]));
  const Vec3 shift = vector_in(stereo["T_right_left_m"]);
  const Vec3 turn_sigma = vector_in(stereo["sigma"]["rotation_rad"]);
  const Vec3 shift_sigma = vector_in(stereo["sigma"]["T_right_left_m"]);
  for (Eigen::Index i = 0; i < 3; ++i) {
    CHECK(std::abs(turn(i)) <= 2 * turn_sigma(i));
    CHECK(std::abs(shift(i)) <= 2 * shift_sigma(i));
  }
  CHECK(json["diagnostics"]["counts"]["pairs"].get<int>() >= 10);
}

TEST_CASE("lecalib calibrate --right: recordings of different times are refused, with the reason") {
  const TemporaryFolder folder;
  write_box(folder / "left.raw", {346, 260}, 0);
  write_box(folder / "right.raw", {346, 260}, 5'000'000);
  const CommandRun run = run_lecalib({"calibrate", folder / "left.raw", "--right", folder / "right.raw", "--target",
                                      kShippedBox, "--out", folder / "out"});
  CHECK(run.exit_code != 0);
  CHECK(run.err.find("never see the object at the same time") != std::string::npos);
  const auto json = json_of(folder / "out/calibration.json");
  CHECK(json["status"] == "no_match");
  CHECK(json["cameras"].empty());
  CHECK(json["stereo"].is_null());
  CHECK(json["views"].empty());
}

TEST_CASE("lecalib calibrate --right: says which camera has no answer, and what does not go together") {
  const TemporaryFolder folder;
  write_box(folder / "left.raw", {346, 260}, 0);
  REQUIRE_FALSE(write_file(folder / "empty.csv", "100,1,1,1\n200,2,1,0\n"));
  CommandRun run = run_lecalib({"calibrate", folder / "left.raw", "--right", folder / "empty.csv", "--sensor",
                                "346x260", "--target", kShippedBox});
  CHECK(run.exit_code != 0);
  CHECK(run.err.find("right camera: ") != std::string::npos);
  run = run_lecalib({"calibrate", "--right", folder / "left.raw", "--target", kShippedBox});
  CHECK(run.exit_code != 0);
  run = run_lecalib({"calibrate", folder / "left.raw", "--right", folder / "left.raw", "--target", kShippedBox,
                     "--gyro", "recording"});
  CHECK(run.exit_code != 0);
  CHECK(run.err.find("--gyro goes with one camera") != std::string::npos);
  run = run_lecalib({"calibrate", folder / "left.raw", "--right", folder / "left.raw", "--target", kShippedBox});
  CHECK(run.exit_code != 0);
  CHECK(run.err.find("is named as both cameras' recording") != std::string::npos);
}

TEST_CASE("lecalib calibrate --right: a simulated pair, against its truth") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const std::string pair = (*data / "sim/08_stereo_box_evk4_sweep").string();
  const TemporaryFolder folder;
  const CommandRun run = run_lecalib({"calibrate", pair + "/left/events.raw", "--right", pair + "/right/events.raw",
                                      "--model", pair + "/left/model.txt", "--out", folder / "out"});
  CAPTURE(run.err);
  REQUIRE(run.exit_code == 0);
  const auto json = json_of(folder / "out/calibration.json");
  const auto truth = json_of(pair + "/stereo.json");
  const char* const sides[] = {"left", "right"};
  for (std::size_t side = 0; side < 2; ++side) {
    const auto& camera = json["cameras"][side];
    const auto true_camera = json_of(pair + "/" + sides[side] + "/truth.json")["camera"];
    for (const char* name : {"fx", "fy", "cx", "cy", "k1"}) {
      const double error = camera[name].get<double>() - true_camera[name].get<double>();
      CHECK(std::abs(error) <= 4 * camera["sigma"][name].get<double>());
    }
  }
  const auto& stereo = json["stereo"];
  const Mat3 turn = rotation_in(stereo["R_right_left"]) * rotation_in(truth["R_right_left"]).transpose();
  const Vec3 off = vector_in(stereo["T_right_left_m"]) - vector_in(truth["t_right_left"]);
  const Vec3 turn_sigma = vector_in(stereo["sigma"]["rotation_rad"]);
  const Vec3 shift_sigma = vector_in(stereo["sigma"]["T_right_left_m"]);
  for (Eigen::Index i = 0; i < 3; ++i) {
    CHECK(std::abs(lecalib::so3_log(turn)(i)) <= 4 * turn_sigma(i));
    CHECK(std::abs(off(i)) <= 4 * shift_sigma(i));
  }
  const double baseline_m = truth["baseline_m"].get<double>();
  CHECK(std::abs(stereo["baseline_m"].get<double>() - baseline_m) <= 0.01 * baseline_m);
}

TEST_CASE("lecalib simulate --right-at: two recordings of one motion, and how the cameras stand") {
  const TemporaryFolder folder;
  const CommandRun run = run_lecalib({"simulate", "--target", "rectangle:0.3x0.2", "--sensor", "48x32", "--duration-s",
                                      "0.02", "--out", folder / "pair", "--right-at", "0.01,-0.05,0,-0.1,0.01,0"});
  CAPTURE(run.err);
  REQUIRE(run.exit_code == 0);
  const auto stereo = json_of(folder / "pair/stereo.json");
  const Mat3 R = rotation_in(stereo["R_right_left"]);
  const Vec3 t = vector_in(stereo["t_right_left"]);
  CHECK((lecalib::so3_log(R) - Vec3(0.01, -0.05, 0)).norm() <= 1e-9);
  CHECK((t - Vec3(-0.1, 0.01, 0)).norm() <= 1e-12);
  const auto left = json_of(folder / "pair/left/truth.json")["poses"];
  const auto right = json_of(folder / "pair/right/truth.json")["poses"];
  REQUIRE(left["t"].size() == right["t"].size());
  CHECK(left["t_us"] == right["t_us"]);
  for (std::size_t i = 0; i < left["t"].size(); ++i) {
    const Vec3 expected = R * vector_in(left["t"][i]) + t;
    CHECK((expected - vector_in(right["t"][i])).norm() <= 1e-5);  // poses are written with some digits
  }
  const auto events = [&folder](const char* side) {
    return read_text_file(folder / (std::string("pair/") + side + "/events.raw")).value();
  };
  CHECK(events("left") != events("right"));
}
