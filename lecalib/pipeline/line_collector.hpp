// SPDX-License-Identifier: MIT
/// What the detectors share: growth and fit of the lines that they guess.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "lecalib/pipeline/line_detector.hpp"

namespace lecalib {

/// Adds the time from its making to its end to a stage.
class StageTimer {
 public:
  StageTimer(std::uint64_t (*clock_ns)(), DetectorStage stage, DetectorStats* stats)
      : clock_ns_(clock_ns), total_(&stats->stage_ns[static_cast<std::size_t>(stage)]) {
    if (clock_ns_ != nullptr) start_ = clock_ns_();
  }
  ~StageTimer() {
    if (clock_ns_ != nullptr) *total_ += clock_ns_() - start_;
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  std::uint64_t (*clock_ns_)();
  std::uint64_t* total_;
  std::uint64_t start_ = 0;
};

/// Grows and fits lines, each on the events that no line has taken yet.
class LineCollector {
 public:
  LineCollector(const EventCloud& cloud, const DetectorOptions& options, const DetectorWorkspace& workspace,
                DetectorStats* stats)
      : cloud_(cloud), options_(options), ws_(workspace), failed_(workspace.failed), stats_(stats) {
    std::fill(ws_.fit.owner.begin(), ws_.fit.owner.begin() + cloud.size(), std::uint8_t{0});
  }

  [[nodiscard]] bool full() const { return count_ == ws_.lines.size(); }
  [[nodiscard]] std::size_t count() const { return count_; }

  /// @return whether the guess became a line
  bool add(MovingLine line) {
    if (failed_.holds(line) || !grow_line(cloud_, options_.growth, options_.fit.priors, ws_.fit, {}, {}, &line)) {
      ++stats_->guesses_repeated;
      return false;
    }
    const FitClaim claim{static_cast<std::uint8_t>(count_ + 1), {}, 1, {}};
    const FitOutcome outcome = fit_line(cloud_, options_.fit, ws_.fit, claim, &line);
    ++stats_->fits[static_cast<std::size_t>(outcome)];
    if (outcome != FitOutcome::accepted) {
      failed_.add(line);
      return false;
    }
    ws_.lines[count_++] = line;
    return true;
  }

 private:
  const EventCloud& cloud_;
  const DetectorOptions& options_;
  const DetectorWorkspace& ws_;
  FailedLines failed_;
  DetectorStats* stats_;
  std::size_t count_ = 0;
};

}  // namespace lecalib
