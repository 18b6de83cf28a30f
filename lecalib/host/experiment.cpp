// SPDX-License-Identifier: MIT
#include "lecalib/host/experiment.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace lecalib::host {
namespace {

/// Several figures show the same arrangement: it is run once.
class Arrangements {
 public:
  explicit Arrangements(const ExperimentOptions& options) : options_(options) {}

  std::size_t add(const TrialOptions& trial, bool with_start) {
    const auto key = [](const TrialOptions& t) {
      return std::tuple(t.protocol, t.sigma_px, t.focal_px, t.lines, t.k1, t.k2);
    };
    const auto is_same = [&](const Arrangement& other) { return key(other.trial) == key(trial); };
    const auto found = std::find_if(all_.begin(), all_.end(), is_same);
    const auto index = static_cast<std::size_t>(found - all_.begin());
    if (found == all_.end()) all_.push_back({trial, false, {}});
    all_[index].with_start = all_[index].with_start || with_start;
    return index;
  }

  void run(const std::function<void(double)>& progress) {
    // Trials of many lines take longer, about in proportion to their number.
    double work = 0;
    for (const Arrangement& arrangement : all_) work += arrangement.trial.lines;
    double before = 0;
    for (Arrangement& arrangement : all_) {
      const int lines = arrangement.trial.lines;
      const auto report = [&](std::size_t begun) {
        const double share = static_cast<double>(begun) / static_cast<double>(options_.trials);
        if (progress) progress((before + lines * share) / work);
      };
      arrangement.summary = run_trials(arrangement.trial, options_.trials, options_.seed,
                                       {arrangement.with_start, options_.priors}, options_.threads, report);
      before += lines;
    }
  }

  [[nodiscard]] const TrialsSummary& summary(std::size_t index) const { return all_[index].summary; }

 private:
  struct Arrangement {
    TrialOptions trial;
    bool with_start;
    TrialsSummary summary;
  };

  const ExperimentOptions& options_;
  std::vector<Arrangement> all_;
};

}  // namespace

const std::array<Sweep, 4>& sweeps() {
  static const std::array<Sweep, 4> all = {{
      {"noise",
       "a",
       "image noise",
       "image noise, px",
       false,
       {0, 1, 2, 3, 4, 5},
       [](TrialOptions* options, double value) { options->sigma_px = value; }},
      {"focal",
       "b",
       "focal length",
       "focal length, px",
       true,
       {400, 600, 800, 1000, 1200, 1400, 1600, 1800, 2000},
       [](TrialOptions* options, double value) { options->focal_px = value; }},
      {"lines",
       "c",
       "number of lines",
       "lines",
       true,
       {6, 8, 10, 12, 15, 20, 25, 30},
       [](TrialOptions* options, double value) { options->lines = static_cast<int>(std::lround(value)); }},
      {"distortion",
       "d",
       "distortion",
       "k1 = k2",
       true,
       {-0.1, -0.2, -0.3, -0.4, -0.5},
       [](TrialOptions* options, double value) { options->k1 = options->k2 = value; }},
  }};
  return all;
}

TrialOptions sweep_trial(const Sweep& sweep, Protocol protocol, double value) {
  TrialOptions options = default_trial(protocol);
  sweep.set(&options, value);
  return options;
}

ExperimentResults run_experiments(const ExperimentOptions& options, const std::function<void(double)>& progress) {
  const auto is_wanted = [&](const Sweep& sweep) {
    return std::find(options.sweeps.begin(), options.sweeps.end(), sweep.name) != options.sweeps.end();
  };
  /// What a result is made of, by number of arrangement.
  struct Planned {
    const Sweep* sweep;  // null: the ablation study
    Protocol protocol;
    std::vector<std::size_t> points;
  };
  Arrangements arrangements(options);
  std::vector<Planned> plan;
  for (const Protocol protocol : options.protocols) {
    if (options.ablation) plan.push_back({nullptr, protocol, {arrangements.add(default_trial(protocol), true)}});
    for (const Sweep& sweep : sweeps()) {
      if (!is_wanted(sweep)) continue;
      plan.push_back({&sweep, protocol, {}});
      for (const double value : sweep.values) {
        plan.back().points.push_back(arrangements.add(sweep_trial(sweep, protocol, value), false));
      }
    }
  }
  arrangements.run(progress);
  ExperimentResults results;
  results.options = options;
  for (const Planned& planned : plan) {
    std::vector<TrialsSummary> points;
    for (const std::size_t point : planned.points) points.push_back(arrangements.summary(point));
    if (planned.sweep == nullptr) {
      results.ablation.push_back({planned.protocol, points.front()});
    } else {
      results.sweeps.push_back({planned.sweep, planned.protocol, std::move(points)});
    }
  }
  return results;
}

}  // namespace lecalib::host
