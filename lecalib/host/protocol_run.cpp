// SPDX-License-Identifier: MIT
#include "lecalib/host/protocol_run.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/host/heap_arena.hpp"
#include "lecalib/host/parallel.hpp"
#include "lecalib/host/protocol_limit.hpp"
#include "lecalib/pipeline/mono_solver.hpp"

namespace lecalib::host {
namespace {

MonoSolverOptions solver_options(bool with_priors) {
  MonoSolverOptions options;
  if (with_priors) return options;
  options.policy.planar_centre_sd = options.policy.spatial_centre_sd = 0;
  options.policy.focal_sd = 0;
  options.policy.radial_sd = options.policy.higher_radial_sd = 0;
  options.policy.tangential_sd = 0;
  return options;
}

/// A refusal comes with a camera; other errors have none, or none that is settled.
bool is_refusal(Status status) { return status == Status::undetermined || status == Status::implausible_result; }

TrialErrors judge(const Camera& camera, const Pose& pose, const Trial& trial, ProtocolScene scene) {
  return errors_of(camera, scene == ProtocolScene::planar ? with_origin_ahead(pose) : pose, trial);
}

TrialErrors start_errors(const CalibrationData& data, const InitialGuessOptions& options,
                         const InitialGuessWorkspace& workspace, const Trial& trial, ProtocolScene scene) {
  InitialGuess guess;
  guess.init(data, options, workspace);
  Status status = guess.step();
  while (status == Status::in_progress) status = guess.step();
  return status == Status::ok ? judge(guess.camera(), workspace.views[0].pose, trial, scene) : no_answer();
}

std::array<double, kNumSigmas> sigmas_off(const CalibrationResult& result, const Camera& truth) {
  std::array<double, kNumSigmas> off{};
  for (std::size_t i = 0; i < kNumSigmas; ++i) {
    off[i] = std::abs(result.camera.*kIntrinsics[i] - truth.*kIntrinsics[i]) / result.sigma[i];
  }
  return off;
}

TrialErrors limit_errors(const Trial& trial, Span<const ModelLine> model) {
  TrialLimit limit;
  if (!find_limit(trial, model, &limit)) return no_answer();
  Camera camera;
  Pose pose;
  displace(trial, limit.error, &camera, &pose);
  return errors_of(camera, pose, trial);
}

}  // namespace

SceneOutcome run_scene(const Trial& trial, ProtocolScene scene, const RunOptions& run) {
  const std::vector<ModelLine>& model = scene == ProtocolScene::planar ? trial.planar : trial.spatial;
  const View view{0, 0, static_cast<std::uint32_t>(trial.points.size())};
  const CalibrationData data{trial.camera.width, trial.camera.height, model, trial.points, {&view, 1}};
  const MonoSolverCapacities capacities{1, trial.points.size(), model.size()};
  const HeapArena block(required_bytes(capacities));
  Arena arena(block.memory());
  MonoSolverWorkspace workspace;
  SceneOutcome outcome;
  outcome.errors.fill(no_answer());
  if (!carve(arena, capacities, &workspace)) {
    outcome.status = Status::buffer_too_small;
    return outcome;
  }
  const auto errors = [&outcome](Stage stage) -> TrialErrors& {
    return outcome.errors[static_cast<std::size_t>(stage)];
  };
  const MonoSolverOptions options = solver_options(run.with_priors);
  if (run.with_start) errors(Stage::start) = start_errors(data, options.guess, workspace.guess, trial, scene);
  MonoSolver solver;
  outcome.status = solver.init(data, options, workspace);
  if (outcome.status == Status::ok) {
    do {
      outcome.status = solver.step();
    } while (outcome.status == Status::in_progress);
  }
  if (outcome.status == Status::ok || is_refusal(outcome.status)) {
    errors(Stage::refined) = judge(solver.result().camera, solver.result().views[0].T_cam_world, trial, scene);
  }
  if (outcome.status == Status::ok) outcome.sigmas_off = sigmas_off(solver.result(), trial.camera);
  errors(Stage::limit) = limit_errors(trial, model);
  return outcome;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

SceneSummary summarise(const std::vector<SceneOutcome>& outcomes) {
  SceneSummary summary;
  for (const SceneOutcome& outcome : outcomes) {
    summary.refused += is_refusal(outcome.status) ? 1 : 0;
    if (outcome.status != Status::ok) continue;
    ++summary.accepted;
    for (std::size_t i = 0; i < kNumSigmas; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        summary.within[i][k] += outcome.sigmas_off[i] <= static_cast<double>(k + 1) ? 1 : 0;
      }
    }
  }
  std::vector<double> values(outcomes.size());
  for (std::size_t s = 0; s < kNumStages; ++s) {
    for (std::size_t e = 0; e < kNumErrors; ++e) {
      for (std::size_t i = 0; i < outcomes.size(); ++i) values[i] = outcomes[i].errors[s][e];
      summary.stages[s].median[e] = median(values);
    }
    for (const SceneOutcome& outcome : outcomes) {
      summary.stages[s].good += is_good(outcome.errors[s]) ? 1 : 0;
      summary.stages[s].failed += outcome.errors[s] == no_answer() ? 1 : 0;
    }
  }
  return summary;
}

TrialsSummary run_trials(const TrialOptions& options, std::size_t trials, std::uint64_t seed, const RunOptions& run,
                         unsigned threads, const std::function<void(std::size_t)>& progress) {
  std::array<std::vector<SceneOutcome>, kNumScenes> outcomes;
  for (std::vector<SceneOutcome>& of_scene : outcomes) of_scene.resize(trials);
  const auto run_trial = [&](std::size_t i) {
    const Trial trial = draw_trial(options, trial_seed(seed, i));
    for (std::size_t s = 0; s < kNumScenes; ++s) outcomes[s][i] = run_scene(trial, static_cast<ProtocolScene>(s), run);
  };
  parallel_for(trials, threads, run_trial, progress);
  TrialsSummary summary;
  summary.trials = trials;
  for (std::size_t s = 0; s < kNumScenes; ++s) summary.scenes[s] = summarise(outcomes[s]);
  return summary;
}

}  // namespace lecalib::host
