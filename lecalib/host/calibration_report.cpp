// SPDX-License-Identifier: MIT
#include "lecalib/host/calibration_report.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/host/text.hpp"
#include "lecalib/math/so3.hpp"
#include "lecalib/math/trigonometry.hpp"

namespace lecalib::host {
namespace {

constexpr const char* kLinesLeftOut = "lines_left_out";

/// A model line that is found in less than this share of the windows is found by chance.
constexpr double kFoundByChance = 0.1;
/// Of a guess that finds less than this share of the model's lines, or the object in less than this share of the
/// windows, nobody knows whether it is right.
constexpr double kMostOfIt = 0.5;

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

/// Two significant digits of sigma decide how many decimals a value is worth.
int decimals(double sigma) {
  int count = 0;
  for (double scaled = sigma; scaled < 10 && count < 6; scaled *= 10) ++count;
  return count;
}

std::string padded(const std::string& text, std::size_t width) {
  return std::string(width - std::min(width, text.size()), ' ') + text;
}

std::string parameter_text(const CameraReport& entry, std::size_t i) {
  const double sigma = entry.sigma[i];
  const double value = entry.camera.*kIntrinsics[i];
  const int digits = sigma > 0 ? decimals(sigma) : 4;
  const bool is_assumed =
      std::find(entry.assumed.begin(), entry.assumed.end(), kIntrinsicNames[i]) != entry.assumed.end();
  std::string line = "  " + std::string(kIntrinsicNames[i]) + padded(fixed(value, digits), 14);
  if (sigma > 0) line += " +- " + fixed(sigma, digits);
  if (i < 4) line += " px";
  if (is_assumed) line += sigma > 0 ? " (rests on what was assumed)" : " (held)";
  return line + "\n";
}

std::string value_text(double value, double sigma) {
  const int digits = decimals(sigma);
  return fixed(value, digits) + " +- " + fixed(sigma, digits);
}

std::string stereo_text(const StereoReport& stereo) {
  constexpr double kMillimetres = 1e3;
  const Vec3 turn = so3_log(rotation_of(stereo.T_right_left));
  std::string text = "from left to right: x_right = R x_left + T\n  R as a vector, degrees:";
  for (std::size_t i = 0; i < 3; ++i)
    text += "  " + value_text(rad_to_deg(turn.data()[i]), rad_to_deg(stereo.sigma[i]));
  text += "\n  T, mm:";
  for (std::size_t i = 0; i < 3; ++i) {
    text += "  " + value_text(kMillimetres * stereo.T_right_left.t[i], kMillimetres * stereo.sigma[3 + i]);
  }
  return text + "\n  baseline " + value_text(kMillimetres * stereo.baseline_m, kMillimetres * stereo.baseline_sigma_m) +
         " mm\n";
}

/// What is known of the intrinsic that a refusal is about: " (420.8 with one sigma of 8.0 px)".
std::string uncertainty(const CalibrationResult& result) {
  if (result.parameter >= kNumIntrinsics || !(result.sigma[result.parameter] > 0)) return "";
  const double sigma = result.sigma[result.parameter];
  const int digits = decimals(sigma);
  return " (" + fixed(result.camera.*kIntrinsics[result.parameter], digits) + " with one sigma of " +
         fixed(sigma, digits) + (result.parameter < 4 ? " px)" : ")");
}

}  // namespace

void add_result(const CalibrationResult& result, Span<const View> views, const std::vector<std::string>& view_names,
                const std::vector<std::string>& line_names, CalibrationReport* report, const std::string& camera_name) {
  report->status = result.status;
  Diagnostics& diagnostics = report->diagnostics;
  diagnostics.reason = explanation(result);
  const std::string prefix = camera_name.empty() ? "" : camera_name + ".";
  diagnostics.counts.push_back({prefix + "views", views.size()});
  diagnostics.counts.push_back({prefix + "views_left_out", result.views_left_out});
  diagnostics.counts.push_back({prefix + kLinesLeftOut, result.lines_left_out});
  diagnostics.counts.push_back({prefix + "points", result.points});
  diagnostics.counts.push_back({prefix + "points_lost", result.points_lost});
  diagnostics.numbers.push_back({prefix + "rms_px", result.rms_px});
  diagnostics.numbers.push_back({prefix + "chi2_per_dof", result.chi2_per_dof});
  diagnostics.numbers.push_back({prefix + "condition", result.condition});
  diagnostics.numbers.push_back({prefix + "iterations", static_cast<double>(result.iterations)});
  diagnostics.stopped_by = to_string(result.reason);
  if (result.status != Status::ok) return;

  CameraReport camera;
  if (!camera_name.empty()) camera.name = camera_name;
  camera.camera = result.camera;
  std::copy(result.sigma, result.sigma + kNumIntrinsics, camera.sigma.begin());
  camera.covariance.assign(result.covariance, result.covariance + kNumIntrinsics * kNumIntrinsics);
  camera.rms_px = result.rms_px;
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    if (result.assumed[i]) camera.assumed.emplace_back(kIntrinsicNames[i]);
  }
  report->cameras.push_back(camera);
  for (std::size_t i = 0; i < result.views.size(); ++i) {
    const ViewResult& view = result.views[i];
    if (!view.used) continue;
    const std::string label = view_names.empty() ? std::string() : view_names[i];
    ViewReport entry{camera.name, label, views[i].t_us, view.T_cam_world, view.lines, view.rms_px, {}, {}};
    for (std::size_t k = 0; k < entry.sigma.size(); ++k) entry.sigma[k] = std::sqrt(view.covariance[7 * k]);
    for (const ViewLineResult& line : view.residuals) {
      entry.line_residuals.push_back({line_names[line.line], line.points, static_cast<double>(line.mean_px),
                                      static_cast<double>(line.rms_px), line.left_out});
    }
    report->views.push_back(entry);
  }
}

void add_coverage(const Coverage& coverage, CalibrationReport* report) {
  report->diagnostics.coverage = coverage;
  const bool mendable = report->status == Status::undetermined || report->status == Status::degenerate_geometry;
  if (!(mendable || report->status == Status::no_match) || coverage.num_hints() == 0) return;
  std::string& reason = report->diagnostics.reason;
  // What is missing takes the place of what might be; a model that does not fit stays the first suspicion.
  if (mendable) reason = reason.substr(0, reason.find(';'));
  for (std::size_t i = 0; i < coverage.num_hints(); ++i) reason += "; " + advice(coverage.hints[i]);
}

void add_search(const MonoCalibrator& calibrator, const std::vector<std::string>& line_names,
                CalibrationReport* report) {
  const MonoStats& stats = calibrator.stats();
  std::string& reason = report->diagnostics.reason;
  if (report->status == Status::degenerate_geometry && stats.windows_matched == 0) {
    reason =
        "a recording cannot be searched for this model: no four of its lines enclose a flat face; "
        "measure further lines of the object";
    return;
  }
  if (report->status != Status::no_match || stats.matcher.ambiguous) return;
  const auto windows = static_cast<double>(calibrator.matcher().windows_explained());
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < line_names.size(); ++i) {
    const auto found = static_cast<double>(calibrator.matcher().windows_with(i));
    if (found < kFoundByChance * windows) missing.push_back(line_names[i]);
  }
  if (missing.empty() || windows < kMostOfIt * stats.windows_kept ||
      static_cast<double>(missing.size()) > kMostOfIt * static_cast<double>(line_names.size())) {
    return;
  }
  reason +=
      "; hardly ever found: " + joined(missing) + " (measure them again, or set them off from what is behind them)";
}

std::string explanation(const CalibrationResult& result) {
  const std::uint8_t parameter = result.parameter;
  const std::string name = parameter < kNumIntrinsics ? kIntrinsicNames[parameter] : "a parameter";
  switch (result.status) {
    case Status::ok: return "the camera is determined";
    case Status::too_few_lines:
      return "too few lines: a view needs 4 lines of a flat model, 6 of another, and one view must have them; "
             "show all of the object and sweep its edges across the image";
    case Status::degenerate_geometry:
      return "the lines seen leave " + name +
             " open (all parallel, through one point, or a flat object always seen at the same slant); "
             "tilt and turn the camera between views";
    case Status::no_match:
      return "the lines found could not be tied to the model; check the model's dimensions, "
             "fill the image with the object, and keep other straight edges out";
    case Status::not_converged: return "the refinement did not settle; check that the names of the lines fit the model";
    case Status::implausible_result:
      return "the camera that fits best cannot be true" +
             (parameter < kNumIntrinsics ? " (" + name + ")" : std::string()) +
             "; check the model's dimensions, the names of the lines and the sensor's size";
    case Status::undetermined:
      return "the data leave " + name + " too uncertain" + uncertainty(result) +
             "; record more views: tilt the object, come nearer, and reach the corners of the image";
    case Status::numerical_failure:
      return "the equations have no finite solution; check model and lines for gross errors";
    default: return std::string("stopped: ") + to_string(result.status);
  }
}

std::string advice(CoverageHint hint) {
  switch (hint) {
    case CoverageHint::none: return "";
    case CoverageHint::show_object: return "bring the object into view (hardly any straight edges are seen)";
    case CoverageHint::move: return "move the camera or the object (edges were seen in few places)";
    case CoverageHint::fill_left: return "show the object at the left edge of the image";
    case CoverageHint::fill_right: return "show the object at the right edge of the image";
    case CoverageHint::fill_top: return "show the object at the top of the image";
    case CoverageHint::fill_bottom: return "show the object at the bottom of the image";
    case CoverageHint::tilt: return "tilt the object, or look at it from another side";
    case CoverageHint::roll: return "turn the camera on its side";
    case CoverageHint::come_closer: return "come closer";
    case CoverageHint::move_away: return "move away";
    case CoverageHint::more_contrast:
      return "give it more light or contrast (its edges make about one event per pixel)";
    case CoverageHint::enough: return "enough was seen";
  }
  return "";
}

std::string calibration_text(const CalibrationReport& report) {
  if (report.cameras.empty()) {
    return std::string("no camera (") + to_string(report.status) + "): " + report.diagnostics.reason + "\n";
  }
  std::string text;
  for (const CameraReport& entry : report.cameras) {
    text += entry.name + ", " + std::to_string(entry.camera.width) + "x" + std::to_string(entry.camera.height) +
            " px, one sigma behind +-\n";
    const auto model = static_cast<std::size_t>(entry.camera.model);
    if (entry.camera.model != DistortionModel::brown) {
      text += std::string("  distortion: ") + kDistortionModelNames[model] + "\n";
    }
    for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
      if (kHasIntrinsic[model][i]) text += parameter_text(entry, i);
    }
    const auto views = std::count_if(report.views.begin(), report.views.end(),
                                     [&entry](const ViewReport& view) { return view.camera == entry.name; });
    text += "  rms " + fixed(entry.rms_px, 3) + " px over " + std::to_string(views) + " views\n";
    if (!entry.assumed.empty()) text += "  assumed: " + joined(entry.assumed) + "\n";
    const std::string count_name = (report.cameras.size() > 1 ? entry.name + "." : "") + kLinesLeftOut;
    for (const NamedCount& count : report.diagnostics.counts) {
      if (count.name == count_name && count.value > 0) {
        text += "  left out, as they do not fit the others: " + std::to_string(count.value) + " lines\n";
      }
    }
  }
  if (report.stereo) text += stereo_text(*report.stereo);
  return text;
}

}  // namespace lecalib::host
