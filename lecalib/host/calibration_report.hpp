// SPDX-License-Identifier: MIT
/// What a calibration found, and the files that say it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lecalib/core/records.hpp"
#include "lecalib/core/status.hpp"
#include "lecalib/pipeline/coverage.hpp"
#include "lecalib/pipeline/mono_calibrator.hpp"
#include "lecalib/pipeline/stereo_calibrator.hpp"
#include "lecalib/solve/calibration_result.hpp"

namespace lecalib::host {

/// One camera. Arrays are in the order of kIntrinsicNames.
struct CameraReport {
  std::string name = "camera";
  Camera camera;
  std::array<double, kNumIntrinsics> sigma = {};  ///< one sigma; 0 for an intrinsic that was held
  std::vector<double> covariance;                 ///< of the intrinsics, 9 x 9 row-major; may be empty
  double rms_px = 0;
  std::vector<std::string> assumed;  ///< intrinsics that were held, or that rest on what was assumed beforehand
};

/// How the points of one line lie in a view, px; positive on the left of the way from the line's first end to its
/// second.
struct LineReport {
  std::string name;
  std::uint32_t points = 0;
  double mean_px = 0;
  double rms_px = 0;
  bool left_out = false;  ///< it did not fit the others
};

struct ViewReport {
  std::string camera = "camera";  ///< CameraReport::name of the one that saw it
  std::string label;              ///< the view's name in a list of observations; may be empty
  std::int64_t t_us = 0;
  Pose T_cam_world;
  std::uint32_t lines = 0;
  double rms_px = 0;
  std::array<double, 6> sigma = {};  ///< one sigma: of turns about the camera's axes, rad, and of t_cam_world, metres
  std::vector<LineReport> line_residuals;
};

struct NamedCount {
  std::string name;
  std::uint64_t value = 0;
};

struct NamedNumber {
  std::string name;
  double value = 0;
};

/// How the answer came about, for people who doubt it.
struct Diagnostics {
  std::string reason;                ///< one plain sentence: how the answer was reached, or why there is none
  std::string stopped_by;            ///< which criterion ended the refinement; may be empty
  std::vector<std::string> inputs;   ///< files that were read
  std::vector<NamedCount> counts;    ///< what went through each stage, in its order
  std::vector<NamedCount> dropped;   ///< what did not, by reason
  std::vector<NamedNumber> numbers;  ///< further figures: condition, iterations, scale of sigma ...
  std::vector<NamedNumber> cpu_ms;   ///< CPU time of the stages
  std::optional<Coverage> coverage;  ///< of a recording: what was seen, and what is missing
};

/// How two cameras stand to each other.
struct StereoReport {
  Pose T_right_left;                 ///< x_right = T_right_left x_left
  std::array<double, 6> sigma = {};  ///< one sigma: of turns about the right camera's axes, rad, and of t, metres
  std::vector<double> covariance;    ///< of the same, 6 x 6 row-major; may be empty
  double baseline_m = 0;             ///< distance of the two centres of projection
  double baseline_sigma_m = 0;       ///< its one sigma
};

/// status ok: at least one camera. Otherwise cameras and views are empty and diagnostics.reason says why.
struct CalibrationReport {
  Status status = Status::ok;
  std::vector<CameraReport> cameras;   ///< of a pair the left one first
  std::optional<StereoReport> stereo;  ///< of a pair
  std::vector<ViewReport> views;
  Diagnostics diagnostics;
};

/// Takes over what a solver found: status, the camera and the views used (only when the status is ok), and why.
/// @param views       the views given to the solver, for their times; as many as result.views
/// @param view_names  their labels, or empty
/// @param line_names  of the model's lines
/// @param camera_name of one of several cameras: "left", say, which its counts and figures are then told apart by
void add_result(const CalibrationResult& result, Span<const View> views, const std::vector<std::string>& view_names,
                const std::vector<std::string>& line_names, CalibrationReport* report,
                const std::string& camera_name = {});

/// Takes over what a pair of cameras came to: both of them, how they stand to each other, and why; and what was seen by
/// the left one, or by the one that has no answer.
void add_stereo_result(const StereoCalibrator& calibrator, const std::vector<std::string>& line_names,
                       CalibrationReport* report);

/// Takes over what was seen of a recording, after add_result(). The reason of a refusal that more data would mend then
/// says what is missing.
void add_coverage(const Coverage& coverage, CalibrationReport* report);

/// Takes over what became of a model that was searched for in vain, after add_coverage(): which of its lines were found
/// nowhere while the rest was, or that nothing of it can be searched for. Nothing where the search has succeeded.
void add_search(const MonoCalibrator& calibrator, const std::vector<std::string>& line_names,
                CalibrationReport* report);

/// One plain sentence: what a status means for somebody who calibrates a camera, and what to do about it.
/// Names the intrinsic that a refusal is about, and what is known of it.
std::string explanation(const CalibrationResult& result);

/// A hint in words: "tilt the object, or look at it from another side". Empty for none.
std::string advice(CoverageHint hint);

/// The answer for people: each intrinsic with its one sigma, what was assumed, how well it fits; or why there is none.
std::string calibration_text(const CalibrationReport& report);

/// lecalib's own format: {"version": 1, "status", "cameras", "stereo", "views", "diagnostics"}. Not a number is null.
std::string calibration_json(const CalibrationReport& report);

/// The first camera in the layout of OpenCV's calibration sample, for cv::FileStorage: camera_matrix,
/// distortion_coefficients (k1 k2 p1 p2 k3), extrinsic_parameters (one row rvec | tvec per view, world to camera), ...
/// Of a pair also what OpenCV's stereo sample has in its two files: M1 D1 M2 D2 and R T, from left to right.
/// OpenCV knows Brown's model alone: of another one the Brown coefficients nearest to it over the image are written,
/// and a comment says so and how far they are off. It has no calibration_time: the same input gives the same bytes.
std::string calibration_opencv_yaml(const CalibrationReport& report);

}  // namespace lecalib::host
