// SPDX-License-Identifier: MIT
#include "lecalib/host/observation_file.hpp"

#include <doctest/doctest.h>

using namespace lecalib::host;

namespace {

Model square() {
  const Result<Model> model = make_target("rectangle:1x1");
  return model.ok() ? model.value() : Model();
}

Result<Observations> parse(std::string_view text) { return parse_observations(text, "o.csv", square(), {640, 480}); }

std::string error_of(std::string_view text) {
  const Result<Observations> observations = parse(text);
  return observations.ok() ? "no error" : to_string(observations.error());
}

constexpr const char* kHeader = "view,line,u_px,v_px\n";

}  // namespace

TEST_CASE("observations are grouped by view in order of appearance") {
  const auto result = parse(
      "# measured by hand\r\n"
      "view,line,u_px,v_px,sigma_px\r\n"
      "001,top,1,2,0.5\r\n"
      "b,left, 3 ,4,0.25\r\n"
      "001,top,5,6,0.5\r\n"
      "\r\n"
      "b,left,7,8,0.25");
  REQUIRE(result.ok());
  const Observations& o = result.value();
  CHECK(o.has_sigma);
  CHECK(o.view_names == std::vector<std::string>{"001", "b"});
  REQUIRE(o.views.size() == 2);
  REQUIRE(o.points.size() == 4);
  CHECK(o.views[1].first == 2);
  CHECK(o.views[1].count == 2);
  CHECK(o.points[1].u_px == 5.0);
  CHECK(o.points[1].line == 2);
  CHECK(o.points[2].line == 3);
  CHECK(o.points[2].u_px == 3.0);
  CHECK(o.points[2].sigma_px == 0.25);
}

TEST_CASE("without sigma_px every point counts alike") {
  const auto result = parse(std::string(kHeader) + "0,top,1,2\n0,top,3,4\n");
  REQUIRE(result.ok());
  CHECK_FALSE(result.value().has_sigma);
  CHECK(result.value().points[0].sigma_px == kDefaultSigmaPx);
}

TEST_CASE("a column t_us gives each view its time, with and without sigma_px") {
  const auto result = parse("view,line,u_px,v_px,t_us\nb,top,1,2,500\na,top,1,2,20\nb,top,3,4,500\na,top,3,4,20\n");
  REQUIRE(result.ok());
  CHECK(result.value().has_times);
  CHECK_FALSE(result.value().has_sigma);
  CHECK(result.value().views[0].t_us == 500);
  CHECK(result.value().views[1].t_us == 20);
  const std::string head = "view,line,u_px,v_px,sigma_px,t_us\n";
  const auto both = parse(head + "b,top,1,2,0.5,7\nb,top,3,4,0.25,7\n");
  REQUIRE(both.ok());
  CHECK(both.value().has_sigma);
  CHECK(both.value().views[0].t_us == 7);
  CHECK(both.value().points[1].sigma_px == 0.25);
  CHECK(error_of(head + "b,top,1,2,1,7\nb,top,3,4,1,8\n") == "o.csv:3:13: the view had the time 7 before, found '8'");
  CHECK(error_of(head + "b,top,1,2,1,-7\n") == "o.csv:2:13: expected a whole number of microseconds, found '-7'");
  CHECK(error_of(head + "b,top,1,2,1,99999999999999999\n").find("whole number") != std::string::npos);
  CHECK(error_of("view,line,u_px,v_px,t_us,sigma_px\n").find("expected the header") != std::string::npos);
}

TEST_CASE("points a little beside the image are kept") {
  CHECK(error_of(std::string(kHeader) + "0,top,-20,2\n0,top,3,500\n") == "no error");
}

TEST_CASE("a broken table names its line, column and what was expected") {
  const std::string head(kHeader);
  const std::string good = head + "0,top,1,2\n0,top,3,4\n";
  CHECK(error_of("") == "o.csv: expected the header 'view,line,u_px,v_px[,sigma_px][,t_us]', found nothing");
  CHECK(error_of("0,top,1,2\n") ==
        "o.csv:1: expected the header 'view,line,u_px,v_px[,sigma_px][,t_us]', found '0,top,1,2'");
  CHECK(error_of(head) == "o.csv:1: expected rows below the header, found none");
  CHECK(error_of(good + "0,top,1\n") == "o.csv:4: expected 4 fields, found 3");
  CHECK(error_of(good + "0,top,1,2,3\n") == "o.csv:4: expected 4 fields, found 5");
  CHECK(error_of(good + "0,top,x,2\n") == "o.csv:4:7: expected a finite number of pixels, found 'x'");
  CHECK(error_of(good + "0,top,1,nan\n") == "o.csv:4:9: expected a finite number of pixels, found 'nan'");
  CHECK(error_of(good + "0,middle,1,2\n") == "o.csv:4:3: the model has no line 'middle'");
  CHECK(error_of(good + ",top,1,2\n") == "o.csv:4:1: expected a view's label, found nothing");
  CHECK(error_of(good + "0,top,801,2\n") == "o.csv:4:7: 801 px lies far outside of a sensor of 640x480");
  CHECK(error_of(good + "0,top,1,-121\n") == "o.csv:4:9: -121 px lies far outside of a sensor of 640x480");
  CHECK(error_of(good + "0,left,1,2\n") == "o.csv:4: the only point of its line in view '0', expected two or more");
  CHECK(error_of("view,line,u_px,v_px,sigma_px\n0,top,1,2,0\n") == "o.csv:2:11: expected sigma_px > 0, found '0'");
}

TEST_CASE("a sensor size is two whole numbers") {
  const auto size = parse_sensor("346x260");
  REQUIRE(size.ok());
  CHECK(size.value().width == 346);
  CHECK(size.value().height == 260);
  for (const char* bad : {"", "346", "346x", "0x260", "346x260x1", "-1x5", "99999x5", "346X260"}) {
    CAPTURE(bad);
    CHECK_FALSE(parse_sensor(bad).ok());
  }
}
