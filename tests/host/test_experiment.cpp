// SPDX-License-Identifier: MIT
#include "lecalib/host/experiment.hpp"

#include <doctest/doctest.h>

#include <initializer_list>

#include "lecalib/host/experiment_report.hpp"
#include "lecalib/host/text.hpp"

using namespace lecalib;
using namespace lecalib::host;

namespace {

ExperimentOptions small(Protocol protocol, bool ablation, std::vector<std::string> names) {
  ExperimentOptions options;
  options.trials = 4;
  options.protocols = {protocol};
  options.ablation = ablation;
  options.sweeps = std::move(names);
  return options;
}

/// A result with made-up medians: every error of a stage is `level` of it, in both scenes.
TrialsSummary made_up(double refined, double limit) {
  TrialsSummary summary;
  summary.trials = 8;
  for (SceneSummary& scene : summary.scenes) {
    scene.stages[static_cast<std::size_t>(Stage::refined)].median.fill(refined);
    scene.stages[static_cast<std::size_t>(Stage::limit)].median.fill(limit);
    scene.stages[static_cast<std::size_t>(Stage::refined)].good = 2;
    scene.stages[static_cast<std::size_t>(Stage::refined)].failed = 3;
    scene.accepted = 4;
    scene.refused = 1;
    for (auto& within : scene.within) within = {1, 2, 3};
  }
  return summary;
}

/// Views of `csv`.
std::vector<std::vector<Field>> rows_of(const std::string& csv) {
  std::vector<std::vector<Field>> rows;
  LineReader reader(csv);
  std::string_view line;
  while (reader.next(&line)) rows.push_back(split(line, ','));
  return rows;
}

bool contains(const std::string& text, const std::string& piece) { return text.find(piece) != std::string::npos; }

}  // namespace

TEST_CASE("experiment: the sweeps are those of the paper's figure 4") {
  const auto trial_at = [](std::size_t sweep, double value) {
    return sweep_trial(sweeps()[sweep], Protocol::text, value);
  };
  CHECK(sweeps()[0].values.front() == 0);
  CHECK(sweeps()[0].values.back() == 5);
  CHECK(trial_at(0, 5).sigma_px == 5);
  CHECK(sweeps()[1].values.front() == 400);
  CHECK(sweeps()[1].values.back() == 2000);
  CHECK(trial_at(1, 2000).focal_px == 2000);
  CHECK(sweeps()[2].values.front() == 6);
  CHECK(sweeps()[2].values.back() == 30);
  CHECK(trial_at(2, 6).lines == 6);
  CHECK(sweeps()[3].values == std::vector<double>{-0.1, -0.2, -0.3, -0.4, -0.5});
  CHECK(trial_at(3, -0.4).k1 == -0.4);
  CHECK(trial_at(3, -0.4).k2 == -0.4);
  CHECK(trial_at(3, -0.4).sigma_px == 1);
  CHECK(trial_at(3, -0.4).focal_px == 400);
  CHECK(trial_at(3, -0.4).lines == 25);
}

TEST_CASE("experiment: only what is asked for is run, and an arrangement in two figures is the same in both") {
  double last = 0;
  bool rises = true;
  const ExperimentResults results =
      run_experiments(small(Protocol::text, true, {"noise", "distortion"}), [&](double x) {
        rises = rises && x >= last && x <= 1 + 1e-12;
        last = x;
      });
  CHECK(rises);
  CHECK(last == doctest::Approx(1));
  REQUIRE(results.ablation.size() == 1);
  REQUIRE(results.sweeps.size() == 2);
  CHECK(results.sweeps[0].points.size() == 6);
  CHECK(results.sweeps[1].points.size() == 5);
  const auto medians = [](const TrialsSummary& summary) {
    return summary.scenes[1].stages[static_cast<std::size_t>(Stage::refined)].median;
  };
  CHECK(medians(results.ablation[0].summary) == medians(results.sweeps[0].points[1]));
  CHECK(medians(results.ablation[0].summary) == medians(results.sweeps[1].points[0]));
  CHECK(medians(results.sweeps[0].points[1]) != medians(results.sweeps[0].points[2]));
  CHECK(run_experiments(small(Protocol::physical, false, {"lines"})).ablation.empty());
}

TEST_CASE("experiment report: the CSV has a row per arrangement, scene and stage, all as wide as its header") {
  ExperimentResults results;
  results.ablation = {{Protocol::scripts, made_up(1.5, 1)}};
  results.sweeps = {{&sweeps()[3], Protocol::physical, std::vector<TrialsSummary>(5, made_up(no_answer()[0], 1))}};
  const std::string csv = experiments_csv(results);
  const auto rows = rows_of(csv);
  REQUIRE(rows.size() == 1 + 2 * 3 + 5 * 2 * 2);
  for (const auto& row : rows) CHECK(row.size() == rows[0].size());
  CHECK(rows[2][0].text == "ablation");
  CHECK(rows[2][1].text == "S");
  CHECK(rows[2][8].text == "refined");
  CHECK(rows[2][9].text == "1.5");
  CHECK(rows[7][5].text == "-0.1");
  CHECK(rows[7][9].text == "inf");
  CHECK(rows[7][17].text == "25");  // good %, of 8
  CHECK(rows[7][18].text == "8");
  CHECK(rows[7][19].text == "3");
  CHECK(rows[7][20].text == "1");
}

TEST_CASE("experiment report: the text shows failures, the paper's table beside S only, and the ratio to the limit") {
  ExperimentResults results;
  results.ablation = {{Protocol::scripts, made_up(1.5, 1)}};
  results.sweeps = {{&sweeps()[3], Protocol::scripts, std::vector<TrialsSummary>(5, made_up(1.5, 1))}};
  results.sweeps[0].points[1] = made_up(200, 11);  // a limit above 10 is no measure
  const std::string text = experiments_markdown(results);
  CHECK(contains(text, "|  | refined | 1.500 | 1.50 |"));
  CHECK(contains(text, "| 25.0 | 3 | 1 |"));
  CHECK(contains(text, "*[Liu24] refined* | *0.35* | *0.58* |"));
  CHECK(contains(text, "![distortion_S.svg](distortion_S.svg)"));
  CHECK(contains(text, "planar: 15 of 40 trials failed, 5 refused, largest ratio to the limit 1.500;"));
  results.ablation[0].protocol = Protocol::text;
  CHECK_FALSE(contains(experiments_markdown(results), "[Liu24] refined"));
  CHECK(contains(experiments_markdown(results), "| T planar | 4 | 25.0 / 50.0 / 75.0 |"));
  CHECK(contains(experiments_markdown(results), "without any prior"));
  results.options.priors = true;
  CHECK(contains(experiments_markdown(results), "with the priors that a calibration has by default"));
  CHECK_FALSE(contains(text, "Reported sigma"));
}

TEST_CASE(
    "experiment report: the ratio to the limit leaves out the principal point of S, which its noise's mean moves") {
  TrialsSummary summary = made_up(1, 1);
  for (SceneSummary& scene : summary.scenes) scene.stages[static_cast<std::size_t>(Stage::refined)].median[4] = 3;
  ExperimentResults results;
  for (const bool scripts : {true, false}) {
    const Protocol protocol = scripts ? Protocol::scripts : Protocol::text;
    results.sweeps = {{&sweeps()[3], protocol, std::vector<TrialsSummary>(5, summary)}};
    CHECK(contains(experiments_markdown(results), scripts ? "limit 1.000;" : "limit 3.000;"));
  }
}

TEST_CASE("experiment report: a figure has a panel per error and one for good trials, with failures in its subtitle") {
  const SweepResult result = {&sweeps()[0], Protocol::text, std::vector<TrialsSummary>(6, made_up(1.5, 1))};
  CHECK(svg_name(result) == "noise_T.svg");
  const std::string svg = sweep_svg(result);
  for (const char* title : {"Rotation, degrees", "Translation, %", "Good trials, %", "fx, %", "fy, %", "cx, %", "cy, %",
                            "k1, ", "k2, ", "image noise, px"}) {
    INFO(title);
    CHECK(contains(svg, std::string(">") + title));
  }
  CHECK(contains(svg, "planar: 18 of 48 trials failed, 6 refused"));
}
