// SPDX-License-Identifier: MIT
/// lecalib experiments: the simulated experiments of [Liu24] section 4.2, with the statistical limit beside them.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "commands.hpp"
#include "lecalib/host/experiment.hpp"
#include "lecalib/host/experiment_report.hpp"
#include "lecalib/host/file_io.hpp"
#include "progress.hpp"

namespace lecalib::command {
namespace {

constexpr const char* kAblation = "table";
constexpr unsigned kMaxThreads = 256;
constexpr std::size_t kMaxTrials = 1000000;

struct ExperimentsArguments {
  std::string out;
  std::vector<std::string> only;       ///< empty: all
  std::vector<std::string> protocols;  ///< empty: all
  host::ExperimentOptions options;
};

host::ExperimentOptions chosen(const ExperimentsArguments& arguments) {
  host::ExperimentOptions options = arguments.options;
  if (!arguments.protocols.empty()) {
    const auto is_left_out = [&](host::Protocol protocol) {
      const std::vector<std::string>& names = arguments.protocols;
      return std::find(names.begin(), names.end(), host::short_name(protocol)) == names.end();
    };
    std::vector<host::Protocol>& all = options.protocols;
    all.erase(std::remove_if(all.begin(), all.end(), is_left_out), all.end());
  }
  if (!arguments.only.empty()) {
    options.ablation = std::find(arguments.only.begin(), arguments.only.end(), kAblation) != arguments.only.end();
    options.sweeps = arguments.only;
  }
  return options;
}

void write(const std::string& folder, const std::string& name, const std::string& content) {
  const std::string path = folder + "/" + name;
  check(host::write_file(path, content));
  std::printf("%s\n", path.c_str());
}

host::ExperimentResults run_with_progress(const host::ExperimentOptions& options) {
  Progress progress("running trials");
  return host::run_experiments(options, [&](double done) { progress.update(done); });
}

void run_experiments(const ExperimentsArguments& arguments) {
  check(host::make_folder(arguments.out));
  const host::ExperimentResults results = run_with_progress(chosen(arguments));
  write(arguments.out, "experiments.csv", experiments_csv(results));
  write(arguments.out, "experiments.md", experiments_markdown(results));
  for (const host::SweepResult& sweep : results.sweeps) write(arguments.out, svg_name(sweep), sweep_svg(sweep));
}

}  // namespace

void add_experiments(CLI::App& app) {
  const auto arguments = std::make_shared<ExperimentsArguments>();
  host::ExperimentOptions& options = arguments->options;
  options.threads = std::clamp(std::thread::hardware_concurrency(), 1U, kMaxThreads);
  CLI::App* command = app.add_subcommand("experiments", "Repeat the paper's simulated experiments beside their limit");
  command->footer(
      "Figure 4 and the ablation table of [Liu24] section 4.2, planar and non-planar, for three kinds of\n"
      "trials: S as the authors' scripts make them, T as the text says, P as T with planar points that a\n"
      "camera can see. Writes experiments.csv, experiments.md and a figure per sweep and protocol (.svg),\n"
      "with the statistical limit (Cramer-Rao) in all of them.");
  command->add_option("--out", arguments->out, "Folder to write to; made if missing")->type_name("DIR")->required();
  command->add_option("--trials", options.trials, "Per arrangement")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(std::size_t{1}, kMaxTrials).description(""));
  command->add_option("--seed", options.seed, "Of all trials")->type_name("N")->capture_default_str();
  std::vector<std::string> names = {kAblation};
  for (const host::Sweep& sweep : host::sweeps()) names.emplace_back(sweep.name);
  command->add_option("--only", arguments->only, "table, noise, focal, lines or distortion; may be repeated")
      ->type_name("NAME")
      ->check(CLI::IsMember(names).description(""));
  command->add_option("--protocol", arguments->protocols, "S, T or P; may be repeated")
      ->type_name("NAME")
      ->check(CLI::IsMember({"S", "T", "P"}).description(""));
  command->add_flag("--priors", options.priors, "Assume what calibrations do by default, instead of nothing");
  command->add_option("--threads", options.threads, "Default one per processor; the results don't depend on it")
      ->type_name("N")
      ->check(CLI::Range(1U, kMaxThreads).description(""));
  command->callback([arguments] { run_experiments(*arguments); });
}

}  // namespace lecalib::command
