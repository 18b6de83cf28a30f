// SPDX-License-Identifier: MIT
/// Runs trials through the public solver and beside it through its linear start alone and through the limit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "lecalib/core/status.hpp"
#include "lecalib/host/protocol.hpp"
#include "lecalib/host/protocol_errors.hpp"

namespace lecalib::host {

/// Which of a trial's two models is used.
enum class ProtocolScene : std::uint8_t { planar, spatial };
inline constexpr std::size_t kNumScenes = 2;
inline constexpr const char* kSceneNames[kNumScenes] = {"planar", "non-planar"};

/// What is compared.
enum class Stage : std::uint8_t { start, refined, limit };
inline constexpr std::size_t kNumStages = 3;
inline constexpr const char* kStageNames[kNumStages] = {"initial", "refined", "limit"};

/// Intrinsics whose reported sigma is looked at: fx fy cx cy k1 k2.
inline constexpr std::size_t kNumSigmas = 6;

/// One trial with one of its models.
struct SceneOutcome {
  std::array<TrialErrors, kNumStages> errors;   ///< by Stage; no_answer() where there is none
  Status status = Status::in_progress;          ///< of the solver
  std::array<double, kNumSigmas> sigmas_off{};  ///< errors in sigmas that the solver reports; where status is ok
};

struct RunOptions {
  bool with_start = false;  ///< false: Stage::start is left out, as no_answer(), which saves a third of the time
  /// The solver assumes what it does by default (PolicyOptions). false: nothing, as the limit has it.
  bool with_priors = false;
};

/// All twelve parameters are free. The solver finds its own start.
SceneOutcome run_scene(const Trial& trial, ProtocolScene scene, const RunOptions& options);

/// Over the trials of one arrangement.
struct StageSummary {
  TrialErrors median{};
  std::size_t good = 0;    ///< trials with is_good()
  std::size_t failed = 0;  ///< trials with no_answer(): count as larger than any other error
};

struct SceneSummary {
  std::array<StageSummary, kNumStages> stages;  ///< by Stage
  std::size_t refused = 0;   ///< with a camera that the solver calls implausible or undetermined: its errors count
  std::size_t accepted = 0;  ///< solver's status ok
  /// Of the accepted ones, those whose true value is within 1, 2 and 3 reported sigmas.
  std::array<std::array<std::size_t, 3>, kNumSigmas> within{};
};

struct TrialsSummary {
  std::size_t trials = 0;
  std::array<SceneSummary, kNumScenes> scenes;  ///< by ProtocolScene
};

/// The middle value, or the mean of the two middle ones; infinity counts as a value. 0 for none.
double median(std::vector<double> values);

SceneSummary summarise(const std::vector<SceneOutcome>& outcomes);

/// Draws and runs `trials` trials. The result does not depend on the number of threads.
/// @param progress may be empty; called on this thread with the number of trials begun so far
TrialsSummary run_trials(const TrialOptions& options, std::size_t trials, std::uint64_t seed, const RunOptions& run,
                         unsigned threads, const std::function<void(std::size_t)>& progress = {});

}  // namespace lecalib::host
