// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "lecalib/host/calibration_report.hpp"

namespace lecalib::host {
namespace {

constexpr std::size_t kPoseSize = 6;

StereoReport stereo_report(const StereoResult& result) {
  StereoReport stereo;
  stereo.T_right_left = result.T_right_left;
  stereo.covariance.assign(result.covariance, result.covariance + kPoseSize * kPoseSize);
  for (std::size_t i = 0; i < kPoseSize; ++i) stereo.sigma[i] = std::sqrt(result.covariance[(kPoseSize + 1) * i]);
  const double* const t = result.T_right_left.t;
  stereo.baseline_m = std::sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
  double variance = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) variance += t[i] * t[j] * result.covariance[kPoseSize * (3 + i) + 3 + j];
  }
  stereo.baseline_sigma_m = stereo.baseline_m > 0 ? std::sqrt(variance) / stereo.baseline_m : 0;
  return stereo;
}

/// Why there is no pair, where neither camera by itself is the reason.
std::string explanation(const StereoResult& result, StereoPhase failed_in) {
  if (failed_in != StereoPhase::between)
    return std::string("the search for lines stopped: ") + to_string(result.status);
  switch (result.status) {
    case Status::no_match:
      if (result.instants + result.disagreeing == 0) {
        return "the two cameras never see the object at the same time; check that both recordings are of one clock, "
               "and show the object to both";
      }
      return "the object's poses in the two cameras do not agree; check that both recordings are of one clock and that "
             "the cameras are fixed to each other";
    case Status::implausible_result:
      return "the object's poses in the two cameras agree only roughly; check that both recordings are of one "
             "clock, to a millisecond, that the cameras are fixed to each other, and that no distortion that they "
             "have is held";
    case Status::not_converged: return "the refinement of both cameras together did not settle";
    default: return std::string("the refinement of both cameras together stopped: ") + to_string(result.status);
  }
}

}  // namespace

void add_stereo_result(const StereoCalibrator& calibrator, const std::vector<std::string>& line_names,
                       CalibrationReport* report) {
  StereoResult result;
  const Status status = calibrator.result(&result);
  add_result(result.left, calibrator.camera(StereoSide::left).views(), {}, line_names, report, "left");
  const std::string left_reason = report->diagnostics.reason;
  add_result(result.right, calibrator.camera(StereoSide::right).views(), {}, line_names, report, "right");
  Diagnostics& diagnostics = report->diagnostics;
  diagnostics.counts.push_back({"pairs", result.instants});
  diagnostics.counts.push_back({"pairs_disagreeing", result.disagreeing});
  diagnostics.numbers.push_back({"tie_chi2_per_dof", result.tie_chi2_per_dof});
  report->status = status;
  if (status == Status::ok) {
    diagnostics.reason = "both cameras and their relative pose are determined";
    report->stereo = stereo_report(result);
    add_coverage(calibrator.camera(StereoSide::left).coverage(), report);
    return;
  }
  report->cameras.clear();
  report->views.clear();
  const StereoPhase failed_in = calibrator.failed_in();
  if (failed_in != StereoPhase::left && failed_in != StereoPhase::right) {
    diagnostics.reason = explanation(result, failed_in);
    return;
  }
  const bool left = failed_in == StereoPhase::left;
  if (left) diagnostics.reason = left_reason;
  add_coverage(calibrator.camera(left ? StereoSide::left : StereoSide::right).coverage(), report);
  diagnostics.reason = (left ? "left camera: " : "right camera: ") + diagnostics.reason;
}

}  // namespace lecalib::host
