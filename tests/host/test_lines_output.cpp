// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cstdio>
#include <vector>

#include "lecalib/host/lines_csv.hpp"
#include "lecalib/host/window_svg.hpp"

using namespace lecalib;
using namespace lecalib::host;

namespace {

std::size_t count(const std::string& text, const std::string& piece) {
  std::size_t found = 0;
  for (std::size_t at = text.find(piece); at != std::string::npos; at = text.find(piece, at + 1)) ++found;
  return found;
}

EventLine example() {
  EventLine line{};
  line.begin = {10.0F, 20.0F, 110.0F, 20.0F};
  line.end = {11.5F, 24.25F, 111.5F, 24.0F};
  line.bend_px = 3.0F;
  line.sigma_begin_px = 0.05F;
  line.sigma_end_px = 0.25F;
  line.events = 321;
  line.polarity = -1;
  return line;
}

}  // namespace

TEST_CASE("each line gives a row per window end, paired by its id") {
  std::vector<EventLine> lines = {example(), example()};
  lines[0].bend_px = lines[1].bend_px = -kMaxRowBendPx;
  LinesCsv csv({240, 180});
  csv.add({1000, 6000, {lines.data(), 1}});
  csv.add({6000, 11000, lines});
  CHECK(csv.num_lines() == 3);
  CHECK(count(csv.text(), "\n") == 1 + 2 * 3);
  CHECK(csv.text().rfind("t_us,end,line,x1,y1,x2,y2,sigma_px,events,polarity\n"
                         "1000,begin,0,10.0000,20.0000,110.0000,20.0000,0.0500,321,-1\n"
                         "6000,end,0,11.5000,24.2500,111.5000,24.0000,0.2500,321,-1\n"
                         "6000,begin,1,",
                         0) == 0);
}

TEST_CASE("a line that leaves its chord is written in pieces along its bend") {
  const std::vector<EventLine> lines = {example()};
  LinesCsv csv({240, 180});
  csv.add({1000, 6000, lines});
  CHECK(csv.num_lines() == 1);
  // At 0.645 = sqrt(1.25 / 3) of its length the line lies 4 * 0.645 * 0.355 * 3 px = 2.746 px below its chord.
  CHECK(csv.text() ==
        "t_us,end,line,x1,y1,x2,y2,sigma_px,events,polarity\n"
        "1000,begin,0,10.0000,20.0000,74.5497,22.7460,0.0500,207,-1\n"
        "6000,end,0,11.5000,24.2500,76.0566,26.8346,0.2500,207,-1\n"
        "1000,begin,1,74.5497,22.7460,110.0000,20.0000,0.0500,113,-1\n"
        "6000,end,1,76.0566,26.8346,111.5000,24.0000,0.2500,113,-1\n");
}

TEST_CASE("of a line with much bend one row still takes more than half, unless it were no line") {
  EventLine line = example();
  line.begin.x2 = 510.0F;
  for (const float bend_px : {8.0F, 15.0F, 17.5F, 30.0F}) {
    CAPTURE(bend_px);
    line.bend_px = bend_px;
    LinesCsv csv({1280, 720});
    csv.add({1000, 6000, {&line, 1}});
    double first_x2 = 0;
    REQUIRE(std::sscanf(csv.text().c_str(), "%*s 1000,begin,0,%*f,%*f,%lf", &first_x2) == 1);
    const double share = (first_x2 - 10) / 500;
    // The part's own bend is share^2 of the whole.
    CHECK(share * share * static_cast<double>(bend_px) < 5.001);
    CHECK((share > 0.5) == (bend_px < 20));
  }
}

TEST_CASE("the row that stands for a bent line begins at its outer end, and the rows together are the line") {
  const EventLine line = example();  // from x = 10 to 110, 3 px of bend
  for (const bool is_second_outer : {false, true}) {
    LinesCsv csv(is_second_outer ? SensorSize{80, 40} : SensorSize{240, 180});
    csv.add({1000, 6000, {&line, 1}});
    double x1[2];
    double x2[2];
    REQUIRE(std::sscanf(csv.text().c_str(), "%*s 1000,begin,0,%lf,%*f,%lf,%*s 6000,end,0,%*s 1000,begin,1,%lf,%*f,%lf",
                        &x1[0], &x2[0], &x1[1], &x2[1]) == 4);
    CHECK(x2[0] - x1[0] > 0.5 * 100);
    CHECK((is_second_outer ? x2[0] : x1[0]) == (is_second_outer ? 110 : 10));
    CHECK((is_second_outer ? x1[1] : x2[1]) == (is_second_outer ? 10 : 110));
    CHECK((is_second_outer ? x2[1] : x1[1]) == (is_second_outer ? x1[0] : x2[0]));
  }
}

TEST_CASE("a picture holds each pixel once and the bend of the lines") {
  std::vector<Event> events;
  for (std::uint16_t x = 5; x < 9; ++x) events.push_back({0, x, 7, 1});
  events.push_back({1, 6, 7, 1});  // again
  events.push_back({2, 2, 3, 0});
  events.push_back({3, 999, 3, 0});  // beside the sensor
  const std::vector<EventLine> lines = {example()};
  const std::string svg = draw_window({0, 10, events}, {0, 10, lines}, {240, 180}, "a < b & c");
  CHECK(count(svg, "M5 7h4\"") == 1);
  CHECK(count(svg, "M2 3h1\"") == 1);
  CHECK(count(svg, "999") == 0);
  // The middle of the chord is (60, 20); its normal (-dy, dx) points down; the control point is twice the bend away.
  CHECK(count(svg, "M10.00 20.00Q60.00 26.00 110.00 20.00") == 1);
  CHECK(count(svg, "a &lt; b &amp; c") == 1);
}

TEST_CASE("a picture shows the events of a line in a colour of its own, before others of the same pixel") {
  // Where the line stands at the begin: OFF, bent to y = 23 in its middle.
  const std::vector<Event> events = {{0, 60, 23, 0}, {0, 61, 23, 0}, {9, 60, 23, 1}, {9, 90, 90, 0}};
  const std::vector<EventLine> lines = {example()};
  const std::string svg = draw_window({0, 10, events}, {0, 10, lines}, {240, 180}, "");
  CHECK(count(svg, "M60 23h2\" fill=\"none\" stroke=\"#3a9147\"") == 1);
  CHECK(count(svg, "M60 23") == 1);
  const std::string none = draw_window({0, 10, events}, {0, 10, {}}, {240, 180}, "");
  CHECK(count(none, "#3a9147") == 0);
  CHECK(count(none, "M60 23h1") == 1);
}

TEST_CASE("a picture's size is bounded by the sensor, however many events and lines there are") {
  std::vector<Event> events;
  for (int i = 0; i < 50'000; ++i) {
    events.push_back({i % 10, static_cast<std::uint16_t>(i % 20), static_cast<std::uint16_t>(i / 20 % 20),
                      static_cast<std::uint8_t>(i / 7 % 2)});
  }
  EventLine line{};
  line.begin = line.end = {0, 0, 19, 19};
  const std::vector<EventLine> lines(100, line);
  const std::string svg = draw_window({0, 10, events}, {0, 10, lines}, {20, 20}, "");
  CHECK(svg.size() < 20 * 20 * 10 + 100 * 100 + 2000);
}
