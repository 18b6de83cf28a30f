// SPDX-License-Identifier: MIT
#include "lecalib/solve/calibration_data.hpp"

#include <cmath>

namespace lecalib {
namespace {

bool is_usable(const ModelLine& line) {
  double length2 = 0.0;
  for (int k = 0; k < 3; ++k) length2 += (line.q[k] - line.p[k]) * (line.q[k] - line.p[k]);
  return length2 > 0.0 && std::isfinite(length2);
}

bool is_usable(const LinePoint& point, std::size_t num_lines) {
  return std::isfinite(point.u_px) && std::isfinite(point.v_px) && point.sigma_px > 0.0 &&
         std::isfinite(point.sigma_px) && point.line < num_lines;
}

bool is_usable(const RelativePrior& prior, std::size_t num_views) {
  for (const double entry : prior.R_b_a) {
    if (!std::isfinite(entry)) return false;
  }
  return prior.view_a < num_views && prior.view_b < num_views && prior.view_a != prior.view_b &&
         prior.sigma_rad > 0.0 && std::isfinite(prior.sigma_rad) && prior.shared_rad >= 0.0 &&
         prior.shared_rad <= prior.sigma_rad;
}

bool ties(const RelativePrior& prior, std::uint32_t view) { return prior.view_a == view || prior.view_b == view; }

/// Whether the prior's views are in none of the priors before it.
bool ties_new_views(Span<const RelativePrior> priors, std::size_t index) {
  for (const RelativePrior& other : priors.first(index)) {
    if (ties(other, priors[index].view_a) || ties(other, priors[index].view_b)) return false;
  }
  return true;
}

}  // namespace

Status validate(const CalibrationData& data) {
  if (data.width < 2 || data.height < 2) return Status::invalid_argument;
  if (data.model.empty() || data.views.empty() || data.points.empty()) return Status::too_few_lines;
  for (const ModelLine& line : data.model) {
    if (!is_usable(line)) return Status::invalid_argument;
  }
  for (const LinePoint& point : data.points) {
    if (!is_usable(point, data.model.size())) return Status::invalid_argument;
  }
  if (!data.edges.empty() && data.edges.size() < data.points.size()) return Status::invalid_argument;
  if (!data.left_out.empty() && data.left_out.size() < data.points.size()) return Status::invalid_argument;
  for (const View& view : data.views) {
    if (view.first > data.points.size() || view.count > data.points.size() - view.first)
      return Status::invalid_argument;
  }
  for (std::size_t i = 0; i < data.relative.size(); ++i) {
    if (!is_usable(data.relative[i], data.views.size()) || !ties_new_views(data.relative, i))
      return Status::invalid_argument;
  }
  return Status::ok;
}

std::size_t count_points(const CalibrationData& data, const View& view) {
  std::size_t count = 0;
  for (std::size_t i = view.first; i < view.first + view.count; ++i) count += is_left_out(data, i) ? 0 : 1;
  return count;
}

}  // namespace lecalib
