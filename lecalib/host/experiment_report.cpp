// SPDX-License-Identifier: MIT
#include "lecalib/host/experiment_report.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "lecalib/host/plot_svg.hpp"
#include "lecalib/host/text.hpp"

namespace lecalib::host {
namespace {

constexpr auto kRefined = static_cast<std::size_t>(Stage::refined);
constexpr auto kLimit = static_cast<std::size_t>(Stage::limit);

/// [Liu24] table "Ablation studies", by scene, then before and after optimisation. Negative: not given.
constexpr double kPaper[kNumScenes][2][kNumErrors] = {
    {{2.47, 5.09, 4.25, 5.40, -1, -1, 6.86, 8.91}, {0.35, 0.58, 0.74, 0.89, 0.40, 0.44, 5.98, 8.12}},
    {{1.49, 4.70, 5.01, 4.54, 2.25, 2.78, 6.41, 7.22}, {0.05, 0.52, 0.18, 0.17, 0.16, 0.21, 5.98, 6.67}}};

/// Errors of R (degrees) and in percent up to which the limit, a first-order figure, is a measure.
constexpr double kMaxComparedLimit = 10;
constexpr std::size_t kNumComparedErrors = 6;  // those in degrees and percent

std::string number(double value, int decimals) { return std::isfinite(value) ? fixed(value, decimals) : "inf"; }

double good_pct(const TrialsSummary& summary, std::size_t scene, std::size_t stage) {
  return 100.0 * static_cast<double>(summary.scenes[scene].stages[stage].good) / static_cast<double>(summary.trials);
}

const char* description(Protocol protocol) {
  switch (protocol) {
    case Protocol::scripts: return "S (the paper's scripts): uniform noise in [0, sigma] px, k1 = k2 = 0.1";
    case Protocol::text: return "T (the paper's text): Gaussian noise of sigma px, k1 = k2 = -0.1";
    case Protocol::physical: return "P (as T, but planar points 2 to 20 m before the camera)";
  }
  return "";
}

void add_csv_rows(const std::string& experiment, const TrialOptions& trial, const TrialsSummary& summary,
                  Stage first_stage, std::string* csv) {
  std::string arrangement = experiment + "," + short_name(trial.protocol);
  for (const double value : {trial.sigma_px, trial.focal_px, 1.0 * trial.lines, trial.k1, trial.k2}) {
    arrangement += "," + shortest(value);
  }
  for (std::size_t scene = 0; scene < kNumScenes; ++scene) {
    const SceneSummary& of_scene = summary.scenes[scene];
    for (auto stage = static_cast<std::size_t>(first_stage); stage < kNumStages; ++stage) {
      *csv += arrangement + "," + kSceneNames[scene] + "," + kStageNames[stage];
      for (const double value : of_scene.stages[stage].median) {
        *csv += "," + (std::isfinite(value) ? shortest(value) : "inf");
      }
      *csv += "," + shortest(good_pct(summary, scene, stage));
      for (const std::size_t count :
           {summary.trials, of_scene.stages[stage].failed, stage == kRefined ? of_scene.refused : 0}) {
        *csv += "," + std::to_string(count);
      }
      *csv += "\n";
    }
  }
}

std::string table_row(const std::vector<std::string>& cells) {
  std::string row = "|";
  for (const std::string& cell : cells) row += " " + cell + " |";
  return row + "\n";
}

void add_paper_row(std::size_t scene, std::size_t stage, std::string* text) {
  std::vector<std::string> cells = {"", std::string("*[Liu24] ") + kStageNames[stage] + "*"};
  for (const double value : kPaper[scene][stage]) cells.push_back(value < 0 ? "" : "*" + fixed(value, 2) + "*");
  cells.insert(cells.end(), {"", "", ""});
  *text += table_row(cells);
}

void add_ablation_rows(const AblationResult& result, std::string* text) {
  const TrialsSummary& summary = result.summary;
  for (std::size_t scene = 0; scene < kNumScenes; ++scene) {
    const SceneSummary& of_scene = summary.scenes[scene];
    for (std::size_t stage = 0; stage < kNumStages; ++stage) {
      const bool first = stage == 0;
      std::vector<std::string> cells = {
          first ? std::string(short_name(result.protocol)) + " " + kSceneNames[scene] : "", kStageNames[stage]};
      for (std::size_t e = 0; e < kNumErrors; ++e) {
        cells.push_back(number(of_scene.stages[stage].median[e], e == 0 ? 3 : 2));
      }
      cells.push_back(fixed(good_pct(summary, scene, stage), 1));
      cells.push_back(std::to_string(of_scene.stages[stage].failed));
      cells.push_back(stage == kRefined ? std::to_string(of_scene.refused) : "");
      *text += table_row(cells);
      if (result.protocol == Protocol::scripts && stage < kLimit) add_paper_row(scene, stage, text);
    }
  }
}

std::string ablation_table(const ExperimentResults& results) {
  std::string text =
      "## Ablation\n\nMedian errors of the linear initial guess alone, after the refinement, and of the limit, with "
      "sigma = 1 px, f = 400 px, 25 lines. The paper's table stands beside protocol S, whose noise it was made "
      "with.\n\n";
  std::vector<std::string> head = {"trials", "step"};
  for (std::size_t e = 0; e < kNumErrors; ++e) head.push_back(std::string(kErrorNames[e]) + " " + kErrorUnits[e]);
  head.insert(head.end(), {"good %", "failed", "refused"});
  text += table_row(head) + table_row(std::vector<std::string>(head.size(), "---"));
  for (const AblationResult& result : results.ablation) add_ablation_rows(result, &text);
  return text + "\n";
}

/// How often the true value lies within the reported sigmas. Not for S: no sigma knows of its noise's mean.
std::string sigma_table(const ExperimentResults& results) {
  std::vector<std::string> head = {"trials", "accepted"};
  for (std::size_t i = 0; i < kNumSigmas; ++i) head.emplace_back(kErrorNames[i + 2]);
  std::string rows;
  for (const AblationResult& result : results.ablation) {
    if (result.protocol == Protocol::scripts) continue;
    for (std::size_t scene = 0; scene < kNumScenes; ++scene) {
      const SceneSummary& summary = result.summary.scenes[scene];
      std::vector<std::string> cells = {std::string(short_name(result.protocol)) + " " + kSceneNames[scene],
                                        std::to_string(summary.accepted)};
      for (const std::array<std::size_t, 3>& within : summary.within) {
        std::string shares;
        for (const std::size_t count : within) {
          const double share =
              100.0 * static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(summary.accepted, 1));
          shares += (shares.empty() ? "" : " / ") + fixed(share, 1);
        }
        cells.push_back(shares);
      }
      rows += table_row(cells);
    }
  }
  if (rows.empty()) return "";
  return "## Reported sigma\n\nShare of the trials that lecalib accepted, neither failed nor refused, whose true value "
         "lies within 1 / 2 / 3 of the reported sigmas, percent; 68.3 / 95.4 / 99.7 where sigma is true.\n\n" +
         table_row(head) + table_row(std::vector<std::string>(head.size(), "---")) + rows + "\n";
}

/// The mean of the scripts' noise moves the principal point, and no method can tell.
bool is_centre(std::size_t error) { return error == 4 || error == 5; }

/// The largest median over the limit's where the limit is one to be measured by; 0 where there is none.
double largest_ratio(const SweepResult& result, std::size_t scene) {
  double largest = 0;
  for (const TrialsSummary& point : result.points) {
    const auto& stages = point.scenes[scene].stages;
    for (std::size_t e = 0; e < kNumComparedErrors; ++e) {
      if (result.protocol == Protocol::scripts && is_centre(e)) continue;
      const double limit = stages[kLimit].median[e];
      if (limit > 0 && limit < kMaxComparedLimit) largest = std::max(largest, stages[kRefined].median[e] / limit);
    }
  }
  return largest;
}

std::string sweep_counts(const SweepResult& result, std::size_t scene) {
  std::size_t trials = 0;
  std::size_t failed = 0;
  std::size_t refused = 0;
  for (const TrialsSummary& point : result.points) {
    trials += point.trials;
    failed += point.scenes[scene].stages[kRefined].failed;
    refused += point.scenes[scene].refused;
  }
  return std::string(kSceneNames[scene]) + ": " + std::to_string(failed) + " of " + std::to_string(trials) +
         " trials failed, " + std::to_string(refused) + " refused";
}

std::string sweep_section(const SweepResult& result) {
  const Sweep& sweep = *result.sweep;
  const std::string name = svg_name(result);
  std::string text = "### " + name + "\n\n![" + name + "](" + name + ")\n\nFigure 4(" + sweep.part +
                     ") of the paper with protocol " + short_name(result.protocol) + ": median errors against " +
                     sweep.varying + " from " + shortest(sweep.values.front()) + " to " +
                     shortest(sweep.values.back()) +
                     ", marks are lecalib's, the pale bands the limit; the last panel is "
                     "the share of trials with R below 5 degrees and T below 5 %.";
  for (std::size_t scene = 0; scene < kNumScenes; ++scene) {
    text += (scene == 0 ? " " : "; ") + sweep_counts(result, scene);
    const double ratio = largest_ratio(result, scene);
    if (ratio > 0) text += ", largest ratio to the limit " + number(ratio, 3);
  }
  return text + ".\n\n";
}

/// A panel's title from the name and the unit of an error.
std::string panel_title(std::size_t error) {
  const std::string name = kErrorNames[error];
  const std::string unit = kErrorUnits[error];
  if (name == "R") return "Rotation, degrees";
  if (name == "T") return "Translation, %";
  return name + ", " + (unit == "1e-3" ? "10\xE2\x81\xBB\xC2\xB3" : unit);
}

/// Order of the panels in rows of three; kNumErrors stands for the share of good trials.
constexpr std::size_t kPanels[] = {0, 1, kNumErrors, 2, 3, 6, 4, 5, 7};

}  // namespace

std::string experiments_csv(const ExperimentResults& results) {
  std::string csv = "experiment,protocol,sigma_px,focal_px,lines,k1,k2,scene,step";
  for (const char* column : {"R_deg", "T_pct", "fx_pct", "fy_pct", "cx_pct", "cy_pct", "k1_1e-3", "k2_1e-3"}) {
    csv += std::string(",") + column;
  }
  csv += ",good_pct,trials,failed,refused\n";
  for (const AblationResult& result : results.ablation) {
    add_csv_rows("ablation", default_trial(result.protocol), result.summary, Stage::start, &csv);
  }
  for (const SweepResult& result : results.sweeps) {
    for (std::size_t i = 0; i < result.points.size(); ++i) {
      const TrialOptions trial = sweep_trial(*result.sweep, result.protocol, result.sweep->values[i]);
      add_csv_rows(result.sweep->name, trial, result.points[i], Stage::refined, &csv);
    }
  }
  return csv;
}

std::string experiments_markdown(const ExperimentResults& results) {
  const ExperimentOptions& options = results.options;
  std::string text = "# Simulated experiments of [Liu24] section 4.2\n\nMedians over " +
                     std::to_string(options.trials) + " trials of each arrangement, seed " +
                     std::to_string(options.seed) +
                     ". One view of random lines, each measured by its two end points; all of fx, fy, cx, cy, k1, k2 "
                     "and the pose are estimated, ";
  text += options.priors ? "with the priors that a calibration has by default, of which the limit does not know.\n\n"
                         : "without any prior.\n\n";
  for (const Protocol protocol : options.protocols) text += std::string("- ") + description(protocol) + "\n";
  text +=
      "\nThe *limit* is that of an efficient unbiased estimator (Cramer-Rao) with the same trials and the same noise, "
      "to first order; for the uniform noise of S it is that of least squares, without the noise's mean, which no "
      "method can tell from a principal point half a pixel aside. *Good* trials have R below 5 degrees and T below "
      "5 %. A *failed* trial has no camera and counts as an error larger than any other. A *refused* one has a camera "
      "that lecalib calls undetermined or implausible; its errors count as they are.\n\n";
  if (!results.ablation.empty()) text += ablation_table(results) + sigma_table(results);
  if (!results.sweeps.empty()) {
    text +=
        "## Figure 4\n\nThe largest ratio of lecalib's median to the limit's is over R, T, fx, fy and, but for S, "
        "whose noise has a mean, cx and cy, where the limit is below 10 (degrees or percent); above, errors of first "
        "order say little.\n\n";
  }
  for (const SweepResult& result : results.sweeps) text += sweep_section(result);
  return text;
}

std::string svg_name(const SweepResult& result) {
  return std::string(result.sweep->name) + "_" + short_name(result.protocol) + ".svg";
}

std::string sweep_svg(const SweepResult& result) {
  const Sweep& sweep = *result.sweep;
  PlotFigure figure;
  figure.title = "Median error against " + std::string(sweep.varying);
  const std::size_t trials = result.points.front().trials;
  figure.subtitle = "Protocol " + std::string(short_name(result.protocol)) + ", " + std::to_string(trials) +
                    " trials per mark. " + sweep_counts(result, 0) + "; " + sweep_counts(result, 1) + ".";
  figure.x_label = sweep.x_label;
  figure.x = sweep.values;
  figure.keys = {{"planar", "#0060a8", PlotStyle::circles},
                 {"planar, limit", "#0060a8", PlotStyle::band},
                 {"non-planar", "#c84a00", PlotStyle::squares},
                 {"non-planar, limit", "#c84a00", PlotStyle::band}};
  for (const std::size_t error : kPanels) {
    PlotPanel panel;
    const bool is_share = error == kNumErrors;
    panel.title = is_share ? "Good trials, %" : panel_title(error);
    panel.logarithmic = sweep.logarithmic && !is_share;
    for (std::size_t scene = 0; scene < kNumScenes; ++scene) {
      for (const std::size_t stage : {kRefined, kLimit}) {
        std::vector<double> values;
        for (const TrialsSummary& point : result.points) {
          values.push_back(is_share ? good_pct(point, scene, stage) : point.scenes[scene].stages[stage].median[error]);
        }
        panel.curves.push_back(std::move(values));
      }
    }
    figure.panels.push_back(std::move(panel));
  }
  return draw_figure(figure);
}

}  // namespace lecalib::host
