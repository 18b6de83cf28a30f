// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "lecalib/host/experiment.hpp"

namespace lecalib::host {

/// One row per experiment, arrangement, scene and stage (sweeps without the start), with a header; medians in the units
/// of kErrorUnits, "inf" where half of the trials or more have no camera.
std::string experiments_csv(const ExperimentResults& results);

/// The ablation study as a table beside the paper's, and what each figure shows.
std::string experiments_markdown(const ExperimentResults& results);

/// A panel per error and one for the share of good trials.
std::string sweep_svg(const SweepResult& result);

/// "noise_T.svg" and the like.
std::string svg_name(const SweepResult& result);

}  // namespace lecalib::host
