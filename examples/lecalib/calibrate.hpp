// SPDX-License-Identifier: MIT
/// The two ways to calibrate, and what they share.
#pragma once

#include <string>
#include <vector>

#include "lecalib/host/calibration_report.hpp"
#include "lecalib/host/model_file.hpp"
#include "lecalib/match/match_hints.hpp"
#include "lecalib/pipeline/mono_solver.hpp"
#include "lecalib/solve/gyro_prior.hpp"

namespace lecalib::command {

struct CalibrateOptions {
  std::vector<std::string> events;
  std::string observations;
  std::string model;
  std::string target;
  std::string sensor;
  std::string out;
  std::string distortion = kDistortionModelNames[0];
  bool free_k3 = false;
  bool hold_distortion = false;
  bool hold_centre = false;
  bool trust_lines = false;
  std::string gyro;            ///< file; empty: none
  GyroOptions gyro_noise;      ///< what its readings are off
  bool lines_only = false;     ///< leave the edges' events out, see MonoOptions::use_edges
  double max_focal_sigma = 0;  ///< share of the focal length; 0: the solver's own
  double focal_px = 0;         ///< a hint, 0: none
  std::string hint_pose;       ///< rx,ry,rz,tx,ty,tz; empty: none

  /// What the options ask of the solver; the rest stays as it is.
  void apply(MonoSolverOptions* solver) const;
  /// What is known beforehand; ends by fail() where a hint cannot be read.
  [[nodiscard]] MatchHints hints() const;
};

/// From measured points. Fills *report also when it ends by fail().
void calibrate_observations(const CalibrateOptions& options, const host::Model& model, host::CalibrationReport* report);

/// From recordings. Fills *report also when it ends by fail().
void calibrate_events(const CalibrateOptions& options, const host::Model& model, host::CalibrationReport* report);

}  // namespace lecalib::command
