// SPDX-License-Identifier: MIT
#include "lecalib/host/gyro_file.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

using namespace lecalib;
using namespace lecalib::host;

namespace {

std::string error_of(std::string_view text) {
  const auto samples = parse_gyro(text, "g.csv");
  return samples.ok() ? "no error" : to_string(samples.error());
}

}  // namespace

TEST_CASE("gyro file: rows are read in order of time") {
  const auto samples = parse_gyro("# from the camera\r\nt_us,wx,wy,wz\r\n-5, 0.5,-1e-3,2\r\n\r\n10,1,2,3", "g.csv");
  REQUIRE(samples.ok());
  REQUIRE(samples.value().size() == 2);
  CHECK(samples.value()[0].t_us == -5);
  CHECK(samples.value()[0].rate[0] == 0.5);
  CHECK(samples.value()[0].rate[1] == -1e-3);
  CHECK(samples.value()[1].rate[2] == 3.0);
}

TEST_CASE("gyro file: columns behind the rates are passed over, as many as the header names") {
  const auto samples = parse_gyro("t_us,wx,wy,wz,ax,note\n1,2,3,4,nan,x\n", "g.csv");
  REQUIRE(samples.ok());
  CHECK(samples.value()[0].rate[2] == 4.0);
  CHECK(error_of("t_us,wx,wy,wz,ax\n1,2,3,4\n") == "g.csv:2: expected 5 fields, found 4");
}

TEST_CASE("gyro file: what is broken names its place") {
  const std::string head = "t_us,wx,wy,wz\n";
  CHECK(error_of("") == "g.csv: expected the header 't_us,wx,wy,wz', found nothing");
  CHECK(error_of("1,2,3,4\n") == "g.csv:1: expected the header 't_us,wx,wy,wz', found '1,2,3,4'");
  CHECK(error_of(head) == "g.csv:1: expected rows below the header, found none");
  CHECK(error_of(head + "1,2,3\n") == "g.csv:2: expected 4 fields, found 3");
  CHECK(error_of(head + "1,2,x,4\n") == "g.csv:2:5: expected a finite number, found 'x'");
  CHECK(error_of(head + "1e300,2,3,4\n") == "g.csv:2:1: expected a finite number, found '1e300'");
  CHECK(error_of(head + "7,2,3,4\n7,2,3,4\n") == "g.csv:3:1: expected a time above the last one, found '7'");
}

TEST_CASE("gyro file: views are tied in pairs by time, none in two, where the gyro tells the turn") {
  std::vector<GyroSample> samples;
  for (int i = 0; i <= 100; ++i) samples.push_back({1000 * i, {0.0, 0.0, 1.0}});
  const View views[] = {{30000, 0, 0}, {10000, 0, 0}, {90000, 0, 0}, {50000, 0, 0}, {150000, 0, 0}, {95000, 0, 0}};
  const auto turns = pair_views({}, samples, views);
  REQUIRE(turns.size() == 2);  // the last pair ends beyond the samples
  CHECK(turns[0].view_a == 1);
  CHECK(turns[0].view_b == 0);
  CHECK(turns[1].view_a == 3);
  CHECK(turns[1].view_b == 2);
  const View at_once[] = {{10000, 0, 0}, {10000, 0, 0}};
  CHECK(pair_views({}, samples, at_once).empty());
  CHECK(pair_views({}, samples, {}).empty());
}
