// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "lecalib/core/rng.hpp"
#include "lecalib/host/file_io.hpp"
#include "lecalib/host/text.hpp"
#include "support/json_file.hpp"
#include "support/run_command.hpp"
#include "support/shared_data.hpp"
#include "support/temporary_folder.hpp"

using namespace lecalib::test;
using namespace lecalib::host;

namespace {

constexpr double kEdgeAtBegin = 80;  // x of the edge at t = 0, px
constexpr double kSpeed = 400;       // px/s
constexpr int kDurationUs = 50'000;

/// A vertical edge from y = 40 to 200 that moves to the right, and some noise; 320 x 240.
std::string moving_edge() {
  lecalib::Rng rng(1);
  std::string text = "t_us,x,y,p\n";
  for (int t = 0; t < kDurationUs; t += 10) {
    const bool is_noise = rng.below(20) == 0;
    const double x = kEdgeAtBegin + kSpeed * 1e-6 * t + rng.uniform(-0.5, 0.5);
    const std::uint32_t edge_y = 40 + rng.below(161);
    const std::uint32_t noise_x = rng.below(320);
    const std::uint32_t noise_y = rng.below(240);
    text += std::to_string(t) + "," + std::to_string(is_noise ? noise_x : static_cast<std::uint32_t>(x + 0.5)) + "," +
            std::to_string(is_noise ? noise_y : edge_y) + ",1\n";
  }
  return text;
}

struct Row {
  double t_us;
  std::string end;
  std::string line;
  double x1, y1, x2, y2, sigma_px, events, polarity;
};

std::vector<Row> rows_of(const std::string& path) {
  const auto text = read_text_file(path);
  REQUIRE(text.ok());
  LineReader reader(text.value());
  std::string_view line;
  REQUIRE(reader.next(&line));
  CHECK(line == "t_us,end,line,x1,y1,x2,y2,sigma_px,events,polarity");
  std::vector<Row> rows;
  while (reader.next(&line)) {
    const auto f = split(line, ',');
    REQUIRE(f.size() == 10);
    const auto number = [&](std::size_t i) { return parse_number(f[i].text).value(); };
    rows.push_back({number(0), std::string(f[1].text), std::string(f[2].text), number(3), number(4), number(5),
                    number(6), number(7), number(8), number(9)});
  }
  return rows;
}

}  // namespace

TEST_CASE("lecalib detect: a moving edge is one line at both ends of each window") {
  const TemporaryFolder folder;
  REQUIRE_FALSE(write_file(folder / "e.csv", moving_edge()));
  const CommandRun run =
      run_lecalib({"detect", folder / "e.csv", "--sensor", "320x240", "--window-us", "25000", "--out",
                   folder / "lines.csv", "--stats", folder / "stats.json", "--svg", folder / "w.svg"});
  CHECK(run.err == "");
  REQUIRE(run.exit_code == 0);
  const auto rows = rows_of(folder / "lines.csv");
  REQUIRE(rows.size() == 4);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    CHECK(row.end == (i % 2 == 0 ? "begin" : "end"));
    CHECK(row.line == std::to_string(i / 2));
    CHECK(std::abs(row.t_us - 25'000 * static_cast<double>((i + 1) / 2)) < 500);
    const double x = kEdgeAtBegin + kSpeed * 1e-6 * row.t_us;
    CHECK(std::abs(row.x1 - x) < 0.5);
    CHECK(std::abs(row.x2 - x) < 0.5);
    CHECK(std::abs(row.y1 - row.y2) > 140);
    CHECK(row.polarity == 1);
    CHECK(row.sigma_px > 0);
    CHECK(row.events > 1500);
  }
  const auto stats = json_of(folder / "stats.json");
  CHECK(stats["events"] == kDurationUs / 10);
  CHECK(stats["windows"] == 2);
  CHECK(stats["lines"] == 2);
  CHECK(stats["arena_bytes"] > 100'000);
  for (const char* reason : {"thinned", "hot", "refractory", "isolated"}) CHECK(stats["dropped"][reason] == 0);
  double sum = 0;
  for (const auto& [stage, ns] : stats["cpu_ns_per_event"].items())
    sum += stage == "total" || stage == "decode" ? 0 : ns.get<double>();
  CHECK(stats["cpu_ns_per_event"]["total"].get<double>() >= sum);
  const auto svg = read_text_file(folder / "w.svg");
  REQUIRE(svg.ok());
  CHECK(svg.value().find("</svg>") != std::string::npos);
}

TEST_CASE("lecalib detect: a range with both ends and no length is one window") {
  const TemporaryFolder folder;
  REQUIRE_FALSE(write_file(folder / "e.csv", moving_edge()));
  const CommandRun run = run_lecalib({"detect", folder / "e.csv", "--sensor", "320x240", "--from-us", "10000",
                                      "--to-us", "30000", "--out", folder / "lines.csv"});
  REQUIRE(run.exit_code == 0);
  const auto rows = rows_of(folder / "lines.csv");
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].t_us == 10'000);
  CHECK(rows[1].t_us == 30'000);
  CHECK(std::abs(rows[0].x1 - 84) < 0.5);
  CHECK(std::abs(rows[1].x1 - 92) < 0.5);
}

TEST_CASE("lecalib detect: events beyond a window's capacity are thinned and counted") {
  const TemporaryFolder folder;
  REQUIRE_FALSE(write_file(folder / "e.csv", moving_edge()));
  const CommandRun run =
      run_lecalib({"detect", folder / "e.csv", "--sensor", "320x240", "--window-us", "50000", "--max-events", "2000",
                   "--out", folder / "lines.csv", "--stats", folder / "stats.json"});
  REQUIRE(run.exit_code == 0);
  CHECK(rows_of(folder / "lines.csv").size() == 2);
  const auto stats = json_of(folder / "stats.json");
  CHECK(stats["events"] == kDurationUs / 10);
  CHECK(stats["dropped"]["thinned"].get<int>() >= kDurationUs / 10 - 2000);
}

TEST_CASE("lecalib detect: the noise filter takes out what has no neighbours and counts it") {
  const TemporaryFolder folder;
  REQUIRE_FALSE(write_file(folder / "e.csv", moving_edge()));
  const auto detect = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"detect",      folder / "e.csv", "--sensor", "320x240",
                                          "--window-us", "25000",          "--out",    folder / "lines.csv",
                                          "--stats",     folder / "s.json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    REQUIRE(run_lecalib(arguments).exit_code == 0);
    CHECK(rows_of(folder / "lines.csv").size() == 4);
    return json_of(folder / "s.json");
  };
  const auto with = detect({"--noise-filter"});
  const auto without = detect({"--no-noise-filter"});
  CHECK(without["dropped"]["isolated"] == 0);
  CHECK(without["cpu_ns_per_event"]["noise"] == 0);
  // Every 20th event lies anywhere; few of those have a neighbour.
  CHECK(with["events"] == kDurationUs / 10);
  CHECK(with["dropped"]["isolated"].get<int>() > 150);
  CHECK(with["dropped"]["isolated"].get<int>() < 300);
  CHECK(with["cpu_ns_per_event"]["noise"] > 0);
  CHECK(with["cpu_ns_per_event"]["total"].get<double>() >
        with["cpu_ns_per_event"]["noise"].get<double>() + with["cpu_ns_per_event"]["cloud"].get<double>());
  CHECK(with["arena_bytes"].get<int>() - without["arena_bytes"].get<int>() >= 320 * 240);
}

TEST_CASE("lecalib detect: both detectors find the edge whatever c_z is within reason") {
  const TemporaryFolder folder;
  REQUIRE_FALSE(write_file(folder / "e.csv", moving_edge()));
  for (const char* detector : {"fast", "reference"}) {
    for (const char* c_z : {"0", "2500", "5000"}) {
      CAPTURE(detector);
      CAPTURE(c_z);
      const CommandRun run = run_lecalib({"detect", folder / "e.csv", "--sensor", "320x240", "--window-us", "25000",
                                          "--detector", detector, "--c-z", c_z, "--out", folder / "lines.csv"});
      REQUIRE(run.exit_code == 0);
      const auto rows = rows_of(folder / "lines.csv");
      REQUIRE(rows.size() == 4);
      for (const Row& row : rows) CHECK(std::abs(row.x1 - kEdgeAtBegin - kSpeed * 1e-6 * row.t_us) < 0.5);
    }
  }
}

TEST_CASE("lecalib detect: c_z reaches the detector, and one out of range is refused by name") {
  const TemporaryFolder folder;
  REQUIRE_FALSE(write_file(folder / "e.csv", moving_edge()));
  const auto detect = [&](const char* c_z) {
    return run_lecalib({"detect", folder / "e.csv", "--sensor", "320x240", "--window-us", "25000", "--detector",
                        "reference", "--c-z", c_z, "--out", folder / "lines.csv"});
  };
  // So flat a cloud has no speed: the plane of the edge is none.
  REQUIRE(detect("1000000").exit_code == 0);
  CHECK(rows_of(folder / "lines.csv").size() < 4);
  for (const char* wrong : {"-1", "0.5", "1e9", "nan", "", "5000us"}) {
    const CommandRun run = detect(wrong);
    CHECK(run.exit_code != 0);
    CHECK(run.err.rfind(
              std::string("lecalib: --c-z: expected 0 (automatic) or 1 to 1000000 us per px, found '") + wrong + "'",
              0) == 0);
  }
}

TEST_CASE("lecalib detect: options that make no sense write nothing") {
  const TemporaryFolder folder;
  REQUIRE_FALSE(write_file(folder / "e.csv", moving_edge()));
  const std::vector<std::vector<std::string>> wrong = {{"--from-us", "5", "--to-us", "5"},
                                                       {"--window-us", "0"},
                                                       {"--window-us", ""},
                                                       {"--to-us", "99999999999999999999"},
                                                       {"--from-us", "-9223372036854775808", "--to-us", "1"},
                                                       {"--from-us", "90000000"},
                                                       {"--svg", folder / "w.svg", "--svg-window", "999"},
                                                       {"--svg", folder / "w.svg", "--svg-window", "-1"},
                                                       {"--svg", folder / "lines.csv"},
                                                       {"--stats", folder / "e.csv"},
                                                       {"--detector", "magic"},
                                                       {"--c-z", "-5000"},
                                                       {"--noise-filter", "--no-noise-filter"},
                                                       {"--sensor", "0x5"}};
  for (const auto& more : wrong) {
    CAPTURE(more[0]);
    std::vector<std::string> arguments = {"detect", folder / "e.csv", "--out", folder / "lines.csv"};
    if (more[0] != "--sensor") arguments.insert(arguments.end(), {"--sensor", "320x240"});
    arguments.insert(arguments.end(), more.begin(), more.end());
    const CommandRun run = run_lecalib(arguments);
    CHECK(run.exit_code != 0);
    CHECK(run.err.rfind("lecalib: ", 0) == 0);
    CHECK(folder.count() == 1);
  }
}

TEST_CASE("lecalib detect: the polygons of a real recording carry lines") {
  const auto data = shared_data();
  if (!data) {
    MESSAGE("skipped: no shared data");
    return;
  }
  const TemporaryFolder folder;
  const CommandRun run = run_lecalib({"detect", (*data / "real/davis240c_shapes/events.txt").string(), "--sensor",
                                      "240x180", "--out", folder / "lines.csv"});
  REQUIRE(run.exit_code == 0);
  CHECK(rows_of(folder / "lines.csv").size() >= 40);
}
