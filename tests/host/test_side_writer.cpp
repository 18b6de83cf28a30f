// SPDX-License-Identifier: MIT
#include "lecalib/host/side_writer.hpp"

#include <doctest/doctest.h>

#include <limits>

#include "lecalib/host/gyro_file.hpp"
#include "support/temporary_folder.hpp"

using namespace lecalib;
using namespace lecalib::host;
using namespace lecalib::test;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
const ImuSample kSamples[] = {{10, {0.5F, -0.25F, 1e-7F}, {0, -9.75F, 1}, 27.5F},
                              {10, {1, 2, 3}, {4, 5, 6}, 7},
                              {-3, {1, 2, 3}, {4, 5, 6}, 7},
                              {20, {1, 2, 3}, {4, 5, 6}, kNan}};

}  // namespace

TEST_CASE("side writer: IMU samples are rows that the reader of gyro files takes, in order of time") {
  const TemporaryFolder folder;
  auto writer = SideWriter::create(folder / "imu.csv", "");
  REQUIRE(writer.ok());
  REQUIRE_FALSE(writer.value().write(Span<const ImuSample>(kSamples).first(1), {}));
  REQUIRE_FALSE(writer.value().write(Span<const ImuSample>(kSamples).subspan(1), {}));
  REQUIRE_FALSE(writer.value().commit());
  CHECK(writer.value().imu_samples() == 2);
  CHECK(writer.value().imu_samples_left_out() == 2);
  const auto text = read_text_file(folder / "imu.csv");
  REQUIRE(text.ok());
  CHECK(text.value() ==
        "t_us,wx,wy,wz,ax,ay,az,temperature_c\n10,0.5,-0.25,1.0000000116860974e-07,0,-9.75,1,27.5\n"
        "20,1,2,3,4,5,6,nan\n");
  const auto gyro = parse_gyro(text.value(), "imu.csv");
  REQUIRE(gyro.ok());
  REQUIRE(gyro.value().size() == 2);
  CHECK(gyro.value()[0].rate[2] == static_cast<double>(1e-7F));
}

TEST_CASE("side writer: triggers are rows of time, channel and kind") {
  const TemporaryFolder folder;
  const TriggerEvent triggers[] = {{-5, 0, TriggerKind::falling},
                                   {7, 255, TriggerKind::rising},
                                   {7, 3, TriggerKind::pulse},
                                   {7, 8, TriggerKind::other}};
  auto writer = SideWriter::create("", folder / "t.csv");
  REQUIRE(writer.ok());
  REQUIRE_FALSE(writer.value().write(kSamples, triggers));
  REQUIRE_FALSE(writer.value().commit());
  CHECK(read_text_file(folder / "t.csv").value() ==
        "t_us,channel,kind\n-5,0,falling\n7,255,rising\n7,3,pulse\n7,8,other\n");
  CHECK(writer.value().triggers() == 4);
  CHECK(writer.value().imu_samples() == 0);
}

TEST_CASE("side writer: a folder that is missing is told") {
  const TemporaryFolder folder;
  CHECK_FALSE(SideWriter::create(folder / "none/imu.csv", "").ok());
  CHECK_FALSE(SideWriter::create("", folder / "none/t.csv").ok());
}
