// SPDX-License-Identifier: MIT
/// The simulated experiments of [Liu24] section 4.2: figure 4, one sweep per part, and the ablation study.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "lecalib/host/protocol.hpp"
#include "lecalib/host/protocol_run.hpp"

namespace lecalib::host {

/// One part of figure 4: a quantity that varies while all others hold their default.
struct Sweep {
  const char* name;     ///< for options and file names
  const char* part;     ///< of figure 4
  const char* varying;  ///< what varies, for titles
  const char* x_label;  ///< with its unit
  bool logarithmic;     ///< errors span decades
  std::vector<double> values;
  void (*set)(TrialOptions* options, double value);
};

/// noise, focal, lines, distortion.
const std::array<Sweep, 4>& sweeps();

struct ExperimentOptions {
  std::size_t trials = 1000;  ///< per arrangement; > 0
  std::uint64_t seed = 1;     ///< trials of the same number have the same draws in all arrangements
  unsigned threads = 1;       ///< > 0; has no influence on the results
  std::vector<Protocol> protocols = {Protocol::scripts, Protocol::text, Protocol::physical};
  bool ablation = true;
  bool priors = false;                                                          ///< RunOptions::with_priors
  std::vector<std::string> sweeps = {"noise", "focal", "lines", "distortion"};  ///< by name
};

struct AblationResult {
  Protocol protocol;
  TrialsSummary summary;
};

struct SweepResult {
  const Sweep* sweep;
  Protocol protocol;
  std::vector<TrialsSummary> points;  ///< one per value of the sweep
};

struct ExperimentResults {
  ExperimentOptions options;
  std::vector<AblationResult> ablation;
  std::vector<SweepResult> sweeps;
};

/// The arrangement at one value of a sweep.
TrialOptions sweep_trial(const Sweep& sweep, Protocol protocol, double value);

/// @param progress may be empty; called on this thread with the share of the work that is done, 0 to 1
ExperimentResults run_experiments(const ExperimentOptions& options, const std::function<void(double)>& progress = {});

}  // namespace lecalib::host
