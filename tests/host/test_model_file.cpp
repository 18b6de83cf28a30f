// SPDX-License-Identifier: MIT
#include "lecalib/host/model_file.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

using namespace lecalib::host;

namespace {

constexpr const char* kSquare =
    "# metres\r\n"
    "0 0 0  1 0 0  bottom\r\n"
    "\r\n"
    "1 0 0\t1 1 0  right   # the right one\r\n"
    "1 1 0  0 1 0  top\r\n"
    "0 1 0  0 0 0  left";

std::string error_of(std::string_view text) {
  const Result<Model> model = parse_model(text, "m.txt");
  return model.ok() ? "no error" : to_string(model.error());
}

double length(const lecalib::ModelLine& line) {
  return std::hypot(line.q[0] - line.p[0], line.q[1] - line.p[1], line.q[2] - line.p[2]);
}

}  // namespace

TEST_CASE("a model is read with comments, blank lines, tabs and CRLF") {
  const Result<Model> model = parse_model(kSquare, "m.txt");
  REQUIRE(model.ok());
  REQUIRE(model.value().lines.size() == 4);
  CHECK(model.value().names == std::vector<std::string>{"bottom", "right", "top", "left"});
  CHECK(model.value().lines[1].p[0] == 1.0);
  CHECK(model.value().lines[1].q[1] == 1.0);
}

TEST_CASE("a broken model names its line, column and what was expected") {
  const std::string good(kSquare);
  CHECK(error_of(good + "\n1 2 3") == "m.txt:7:1: expected 'x1 y1 z1 x2 y2 z2 name' (7 fields), found 3");
  CHECK(error_of(good + "\n1 2 3 4 5 6 a b") == "m.txt:7:1: expected 'x1 y1 z1 x2 y2 z2 name' (7 fields), found 8");
  CHECK(error_of(good + "\n1 2 nan 4 5 6 a") == "m.txt:7:5: expected a finite number of metres, found 'nan'");
  CHECK(error_of(good + "\n1 2 3 4 inf 6 a") == "m.txt:7:9: expected a finite number of metres, found 'inf'");
  CHECK(error_of(good + "\n1 2 3 4 5,0 6 a") == "m.txt:7:9: expected a finite number of metres, found '5,0'");
  CHECK(error_of(good + "\n1 2 3 1 2 3 a") == "m.txt:7:1: expected two end points 1e-6 m or more apart");
  CHECK(error_of(good + "\n1 2 3 1 2 3.0000009 a") == "m.txt:7:1: expected two end points 1e-6 m or more apart");
  CHECK(error_of(good + "\n1e6 0 0 -1e6 0 0 a") == "no error");
  CHECK(error_of(good + "\n1.1e6 0 0 1 0 0 a") == "m.txt:7:1: expected metres between -1e6 and 1e6, found '1.1e6'");
  CHECK(error_of(good + "\n0 0 0 1 0 -1e300 a") == "m.txt:7:11: expected metres between -1e6 and 1e6, found '-1e300'");
  CHECK(error_of(good + "\n1 2 3 4 5 6 top") == "m.txt:7:13: the name 'top' is already used in line 5");
  CHECK(error_of("0 0 0 1 0 0 only\n") == "m.txt:1: expected at least 4 lines in the model, found 1");
  CHECK(error_of("# nothing\n") == "m.txt:1: expected at least 4 lines in the model, found 0");
}

TEST_CASE("a missing model and a folder are plain errors") {
  const Result<Model> missing = read_model("/nonexistent/model.txt");
  REQUIRE_FALSE(missing.ok());
  CHECK(to_string(missing.error()) == "/nonexistent/model.txt: cannot open: no such file or directory");
  const Result<Model> folder = make_target("file:/");
  REQUIRE_FALSE(folder.ok());
  CHECK(to_string(folder.error()) == "/: is a directory, expected a file");
}

TEST_CASE("a rectangle is four joined edges") {
  const Result<Model> model = make_target("rectangle:0.297x0.210");
  REQUIRE(model.ok());
  const auto& lines = model.value().lines;
  REQUIRE(lines.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) {
    for (int k = 0; k < 3; ++k) CHECK(lines[i].q[k] == lines[(i + 1) % 4].p[k]);
    CHECK(length(lines[i]) == doctest::Approx(i % 2 == 0 ? 0.297 : 0.210));
  }
}

TEST_CASE("a box has twelve different edges, four of each length") {
  const Result<Model> model = make_target("box:0.40x0.30x0.25");
  REQUIRE(model.ok());
  const auto& lines = model.value().lines;
  REQUIRE(lines.size() == 12);
  const double sizes[3] = {0.40, 0.30, 0.25};
  std::set<std::array<double, 6>> different;
  for (std::size_t i = 0; i < 12; ++i) {
    CHECK(length(lines[i]) == doctest::Approx(sizes[i / 4]));
    CHECK(lines[i].q[i / 4] - lines[i].p[i / 4] == doctest::Approx(sizes[i / 4]));
    different.insert({lines[i].p[0], lines[i].p[1], lines[i].p[2], lines[i].q[0], lines[i].q[1], lines[i].q[2]});
  }
  CHECK(different.size() == 12);
  CHECK(std::set<std::string>(model.value().names.begin(), model.value().names.end()).size() == 12);
  CHECK(model.value().names[2] == "x_y0_z1");
  CHECK(lines[2].p[2] == 0.25);
}

TEST_CASE("a checkerboard's lines run through its inner corners to the rim") {
  const Result<Model> model = make_target("checkerboard:9x6:0.030");
  REQUIRE(model.ok());
  const auto& lines = model.value().lines;
  REQUIRE(lines.size() == 9 + 6 + 4);
  CHECK(model.value().names[8] == "col8");
  CHECK(lines[8].p[0] == doctest::Approx(8 * 0.030));
  CHECK(length(lines[8]) == doctest::Approx(7 * 0.030));
  CHECK(model.value().names[14] == "row5");
  CHECK(lines[14].p[1] == doctest::Approx(5 * 0.030));
  CHECK(length(lines[14]) == doctest::Approx(10 * 0.030));
  CHECK(std::count_if(lines.begin(), lines.end(), [](const auto& l) { return l.p[2] != 0 || l.q[2] != 0; }) == 0);
}

TEST_CASE("target descriptions that make no sense say what was expected") {
  for (const char* spec :
       {"", "rectangle", "rectangle:", "rectangle:0.3", "rectangle:0.3x-0.2", "rectangle:0.3x0.2x0.1", "rectangle:axb",
        "box:1x2", "box:1x2x0", "box:1x2x1e-7", "rectangle:1x1e300", "checkerboard:9x6", "checkerboard:1x6:0.03",
        "checkerboard:9x6:0", "checkerboard:9.5x6:0.03", "checkerboard:9x6:0.03:1", "checkerboard:99999x6:0.03",
        "file:", "circle:3"}) {
    CAPTURE(spec);
    const Result<Model> model = make_target(spec);
    REQUIRE_FALSE(model.ok());
    CHECK(to_string(model.error()).find(": expected ") != std::string::npos);
  }
}
