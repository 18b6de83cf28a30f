// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <nlohmann/json.hpp>

#include "lecalib/host/file_io.hpp"
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
  const auto json = nlohmann::json::parse(run.out);
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

TEST_CASE("lecalib info: a recording of a sensor agrees with another decoder") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const CommandRun run = run_lecalib({"info", "--json", (*data / "real/gen3_evt3/events.raw").string()});
  REQUIRE(run.exit_code == 0);
  const auto json = nlohmann::json::parse(run.out);  // expected.txt beside the recording
  CHECK(json["format"] == "EVT3");
  CHECK(json["events"] == 343474);
  CHECK(json["first_us"] == 7139845);
  CHECK(json["last_us"] == 9218023);
  CHECK(json["on_share"].get<double>() == doctest::Approx(125183.0 / 343474));
}
