// SPDX-License-Identifier: MIT
/// The ways to calibrate, and what they share.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lecalib/events/decoder.hpp"
#include "lecalib/host/calibration_report.hpp"
#include "lecalib/host/model_file.hpp"
#include "lecalib/match/match_hints.hpp"
#include "lecalib/pipeline/mono_calibrator.hpp"
#include "progress.hpp"

namespace lecalib::command {

/// Instead of a file: the IMU in the recording.
inline constexpr const char* kGyroOfRecording = "recording";

struct CalibrateOptions {
  std::vector<std::string> events;
  std::vector<std::string> right;  ///< of a second camera; empty: there is none
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
  std::string gyro;  ///< file, or kGyroOfRecording; empty: none
  double gyro_noise = GyroOptions{}.noise_density;
  std::optional<double> gyro_bias;  ///< one sigma, rad/s
  bool lines_only = false;          ///< leave the edges' events out, see MonoOptions::use_edges
  double max_focal_sigma = 0;       ///< share of the focal length; 0: the solver's own
  double focal_px = 0;              ///< a hint, 0: none
  std::string hint_pose;            ///< rx,ry,rz,tx,ty,tz; empty: none

  /// What the options ask of the solver; the rest stays as it is.
  void apply(MonoSolverOptions* solver) const;
  /// What the gyro's readings are off.
  [[nodiscard]] GyroOptions gyro_options() const;
  /// What is known beforehand; ends by fail() where a hint cannot be read.
  [[nodiscard]] MatchHints hints() const;
};

/// Options of every way to calibrate: the model and where results go; what is known, free and refused.
void add_model_options(CLI::App* command, CalibrateOptions* options);
void add_solver_options(CLI::App* command, CalibrateOptions* options);

/// Reads the model, lets `calibrate` find the camera, and writes and prints the result. Ends by fail() without one.
void run_calibration(const CalibrateOptions& options,
                     const std::function<void(const host::Model&, host::CalibrationReport*)>& calibrate);

/// Events of one camera in the order of their times, wherever they come from.
class EventSource {
 public:
  virtual ~EventSource() = default;
  [[nodiscard]] virtual SensorSize sensor() const = 0;
  /// The next events, valid until the next call; empty at the end. Ends by fail() where they cannot be read.
  virtual Span<const Event> read() = 0;
  /// Whether events are missing between those of the last read() and those before.
  [[nodiscard]] virtual bool has_gap() const { return false; }
  /// Says how far it is.
  virtual void show(const MonoCalibrator& calibrator, Progress* progress) const = 0;
  [[nodiscard]] virtual DecoderStats stats() const = 0;
  [[nodiscard]] virtual std::uint64_t decode_cpu_ns() const = 0;
};

/// Opens recordings of one camera. Ends by fail() where they are of different sizes.
std::vector<std::unique_ptr<EventSource>> open_recordings(const std::vector<std::string>& paths,
                                                          const std::string& sensor);

/// What one camera's calibrator must hold. Ends by fail() where the model has more lines than can be searched for.
Capacities capacities_for(SensorSize sensor, const CalibrateOptions& options, const host::Model& model);

/// The options of one camera's calibrator, without a gyro.
MonoOptions mono_options(const CalibrateOptions& options, SensorSize sensor);

/// Adds what went through, and what was dropped. @param prefix of all names, to tell two cameras apart
void report_counts(const std::vector<std::unique_ptr<EventSource>>& sources, const MonoStats& stats,
                   const std::string& prefix, host::Diagnostics* diagnostics);

/// From the events of all sources, one after the other, each window worked on as soon as it is full. Fills *report also
/// when it ends by fail().
void calibrate_from(const std::vector<std::unique_ptr<EventSource>>& sources, const CalibrateOptions& options,
                    const host::Model& model, host::CalibrationReport* report);

/// From measured points. Fills *report also when it ends by fail().
void calibrate_observations(const CalibrateOptions& options, const host::Model& model, host::CalibrationReport* report);

/// From recordings. Fills *report also when it ends by fail().
void calibrate_events(const CalibrateOptions& options, const host::Model& model, host::CalibrationReport* report);

/// From recordings of two cameras. Fills *report also when it ends by fail().
void calibrate_stereo(const CalibrateOptions& options, const host::Model& model, host::CalibrationReport* report);

}  // namespace lecalib::command
