// SPDX-License-Identifier: MIT
#include "lecalib/match/line_assignment.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// The part of a model line nearer to the camera's plane than this share of its distance is cut away.
constexpr double kNearShare = 0.05;
/// Pieces of one model line may overlap by this share of the shorter one.
constexpr double kMaxPieceOverlap = 0.25;
/// A model line's weight grows from 0 to 1 between these lengths in units: short ones are found by chance.
constexpr double kShortUnits = 10.0;
constexpr double kLongUnits = 120.0;
/// Model lines of which less than this is in the image (units) are left out.
constexpr double kMinSeenUnits = 8.0;
/// A line is found that is covered by this share, by detected lines within so many units of it.
constexpr double kFoundShare = 0.5;
constexpr double kCloseUnits = 0.75;
constexpr std::uint16_t kFewFound = 4;
/// An edge that travels less than this many px across itself in a window makes no line, one that travels more than
/// that does, unless it has no contrast.
constexpr double kSilentTravelPx = 1.0;
constexpr double kLoudTravelPx = 3.0;

/// Clips the line start + s direction, s in [low, high], to the frame.
void clip(const FlatFrame& frame, ProjectedLine* line) {
  const double from[4] = {line->start[0] - frame.x0, frame.x1 - line->start[0], line->start[1] - frame.y0,
                          frame.y1 - line->start[1]};
  const double rate[4] = {line->direction[0], -line->direction[0], line->direction[1], -line->direction[1]};
  line->seen_low_px = 0.0;
  line->seen_high_px = line->length_px;
  for (int side = 0; side < 4; ++side) {
    if (std::abs(rate[side]) < 1e-12) {
      if (from[side] < 0.0) line->seen_high_px = 0.0;
      continue;
    }
    const double s = -from[side] / rate[side];
    if (rate[side] > 0.0) {
      line->seen_low_px = std::max(line->seen_low_px, s);
    } else {
      line->seen_high_px = std::min(line->seen_high_px, s);
    }
  }
  line->seen_high_px = std::max(line->seen_high_px, line->seen_low_px);
}

ProjectedLine project_line(const ModelLine& line, const Mat3& R, const Vec3& t, double f_px, const FlatFrame& frame) {
  ProjectedLine out{};
  Vec3 p = R * Eigen::Map<const Vec3>(line.p) + t;
  Vec3 q = R * Eigen::Map<const Vec3>(line.q) + t;
  const double z_near = kNearShare * std::max(p.z(), q.z());
  if (!(z_near > 0.0)) return out;
  if (p.z() < z_near) p += (q - p) * ((z_near - p.z()) / (q.z() - p.z()));
  if (q.z() < z_near) q += (p - q) * ((z_near - q.z()) / (p.z() - q.z()));
  const Vec2 a = p.head<2>() * (f_px / p.z());
  const Vec2 b = q.head<2>() * (f_px / q.z());
  const Vec2 d = b - a;
  const double length = d.norm();
  if (!(length > 1e-9) || !(length < 1e9)) return out;
  out.length_px = length;
  Eigen::Map<Vec2>(out.start) = a;
  Eigen::Map<Vec2>(out.direction) = d / length;
  out.normal[0] = -out.direction[1];
  out.normal[1] = out.direction[0];
  out.normal[2] = -(out.normal[0] * a.x() + out.normal[1] * a.y());
  clip(frame, &out);
  return out;
}

/// Weight of a model line by its visible length: its information over that of pure chance.
double line_weight(double seen_px, double unit_px) {
  return std::min(1.0, std::max(0.0, (seen_px / unit_px - kShortUnits) / (kLongUnits - kShortUnits)) * 0.8 + 0.2);
}

/// How far a model line moves across itself from one place to another: the mean over its ends.
double travel_px(const ProjectedLine& from, const ProjectedLine& to) {
  double sum = 0.0;
  for (const double s : {to.seen_low_px, to.seen_high_px}) {
    const double x = to.start[0] + s * to.direction[0];
    const double y = to.start[1] + s * to.direction[1];
    sum += std::abs(from.normal[0] * x + from.normal[1] * y + from.normal[2]);
  }
  return 0.5 * sum;
}

/// @return false when the detected line cannot be the model line
bool compare(const ProjectedLine& model, const FlatLine& line, std::size_t instant, const AssignmentOptions& options,
             Assignment* out) {
  const double* x = line.x[instant];
  const double* y = line.y[instant];
  double e[kLinePoints];
  for (std::size_t q = 0; q < kLinePoints; ++q) {
    e[q] = model.normal[0] * x[q] + model.normal[1] * y[q] + model.normal[2];
  }
  out->distance_px = (std::abs(e[0]) + std::abs(e[1]) + std::abs(e[2])) / 3.0;
  if (!(out->distance_px <= options.gate_px)) return false;
  if (std::abs(e[2] - e[0]) > std::max(options.max_slope * line.length_px, options.unit_px)) return false;
  const double s0 = model.direction[0] * (x[0] - model.start[0]) + model.direction[1] * (y[0] - model.start[1]);
  const double s2 = model.direction[0] * (x[2] - model.start[0]) + model.direction[1] * (y[2] - model.start[1]);
  out->flipped = s0 > s2;
  out->low_px = std::min(s0, s2);
  out->high_px = std::max(s0, s2);
  const double overlap = std::min(out->high_px, model.length_px) - std::max(out->low_px, 0.0);
  const double outside = (out->high_px - out->low_px) - overlap;
  if (outside > std::max(options.overshoot_px, options.overshoot_share * line.length_px)) return false;
  if (overlap < 0.5 * (out->high_px - out->low_px)) return false;
  const double closeness = 1.0 - out->distance_px * out->distance_px / (options.gate_px * options.gate_px);
  out->weight_px = overlap * closeness;
  return out->weight_px > 0.0;
}

/// True when the detected line's brighter side is not the model line's.
bool contradicts(const AssignmentOptions& options, std::size_t model_line, std::size_t line, bool flipped) {
  if (options.contrast.empty()) return false;
  const int contrast = flipped ? -options.line_contrast[line] : options.line_contrast[line];
  return contrast * options.contrast[model_line] < 0;
}

/// A further piece of a model line must lie beside the ones it has.
bool fits_beside(const Assignment& piece, Span<const Assignment> taken) {
  for (const Assignment& other : taken) {
    if (other.model_line != piece.model_line) continue;
    const double overlap = std::min(piece.high_px, other.high_px) - std::max(piece.low_px, other.low_px);
    const double shorter = std::min(piece.high_px - piece.low_px, other.high_px - other.low_px);
    if (overlap > kMaxPieceOverlap * shorter) return false;
  }
  return true;
}

/// Each model line in the image can earn its weight; it does so as far as close detected lines cover it.
Support measure(Span<const ProjectedLine> projected, Span<const Assignment> taken, double unit_px) {
  Support support;
  for (std::size_t j = 0; j < projected.size(); ++j) {
    const double seen = projected[j].seen_high_px - projected[j].seen_low_px;
    if (projected[j].length_px <= 0.0 || seen < kMinSeenUnits * unit_px) continue;
    const double weight = line_weight(seen, unit_px);
    support.possible += weight;
    double covered = 0.0;
    double closely = 0.0;
    for (const Assignment& a : taken) {
      if (a.model_line != j) continue;
      covered += a.weight_px;
      if (a.distance_px <= kCloseUnits * unit_px) closely += a.weight_px;
    }
    if (covered <= 0.0) continue;
    ++support.lines;
    support.score += weight * std::min(1.0, covered / seen);
    support.found += weight * std::min(1.0, closely / (kFoundShare * seen));
  }
  return support;
}

double coverage(const ProjectedLine& line, std::size_t model_line, Span<const Assignment> taken) {
  double covered = 0.0;
  for (const Assignment& a : taken) {
    if (a.model_line != model_line) continue;
    covered += std::max(0.0, std::min(a.high_px, line.seen_high_px) - std::max(a.low_px, line.seen_low_px));
  }
  return covered / std::max(line.seen_high_px - line.seen_low_px, 1e-9);
}

/// Four lines or less leave at most two numbers to check a pose with: a short line beside the true one would be
/// believed.
Span<Assignment> demand_coverage(Span<const ProjectedLine> projected, const AssignmentOptions& options,
                                 Span<Assignment> taken) {
  if (measure(projected, taken, options.unit_px).lines > kFewFound) return taken;
  std::size_t count = 0;
  for (std::size_t i = 0; i < taken.size(); ++i) {
    const std::size_t j = taken[i].model_line;
    // Pieces of one line stay or go together: those that stay are still in front of the ones to be looked at.
    const double share = coverage(projected[j], j, taken.first(count)) + coverage(projected[j], j, taken.subspan(i));
    if (share >= options.min_coverage_of_few) taken[count++] = taken[i];
  }
  return taken.first(count);
}

}  // namespace

Span<Assignment> assign_lines(const ModelGraph& model, const Pose& pose, double f_px, const FlatFrame& frame,
                              Span<const FlatLine> lines, Instant instant, const AssignmentOptions& options,
                              AssignmentWorkspace* workspace, Support* support) {
  const Mat3 R = rotation_of(pose);
  const Vec3 t = translation_of(pose);
  const Vec3 centre = -(R.transpose() * t);
  const double eye[3] = {centre.x(), centre.y(), centre.z()};
  BoundedBest<Assignment> candidates(workspace->candidates);
  const auto heavier = [](const Assignment& a, const Assignment& b) { return a.weight_px > b.weight_px; };
  const Span<ProjectedLine> projected = workspace->projected.first(model.lines.size());
  for (std::size_t j = 0; j < model.lines.size(); ++j) {
    projected[j] = is_hidden(model, j, eye) ? ProjectedLine{} : project_line(model.lines[j], R, t, f_px, frame);
    if (projected[j].length_px <= 0.0) continue;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (!lines[i].usable) continue;
      Assignment pair;
      if (!compare(projected[j], lines[i], static_cast<std::size_t>(instant), options, &pair)) continue;
      if (contradicts(options, j, i, pair.flipped)) continue;
      pair.line = static_cast<std::uint16_t>(i);
      pair.model_line = static_cast<std::uint16_t>(j);
      candidates.offer(pair, heavier);
    }
  }

  const Span<std::uint8_t> used = workspace->line_used.first(lines.size());
  std::fill(used.begin(), used.end(), std::uint8_t{0});
  std::size_t count = 0;
  std::uint32_t dropped = 0;
  for (const Assignment& pair : candidates.view()) {
    if (used[pair.line] != 0 || !fits_beside(pair, workspace->assignments.first(count))) continue;
    if (count == workspace->assignments.size()) {
      ++dropped;
      continue;
    }
    used[pair.line] = 1;
    workspace->assignments[count++] = pair;
  }
  Span<Assignment> taken = workspace->assignments.first(count);
  if (options.min_coverage_of_few > 0.0) taken = demand_coverage(projected, options, taken);
  if (support != nullptr) {
    *support = measure(projected, taken, options.unit_px);
    support->candidates_dropped = candidates.dropped();
    support->assignments_dropped = dropped;
  }
  return taken;
}

double silent_weight(const ModelGraph& model, const Pose (&poses)[kNumInstants], double f_px, const FlatFrame& frame,
                     double unit_px, Span<const Assignment> taken) {
  Mat3 R[kNumInstants];
  Vec3 t[kNumInstants];
  for (std::size_t k = 0; k < kNumInstants; ++k) {
    R[k] = rotation_of(poses[k]);
    t[k] = translation_of(poses[k]);
  }
  const Vec3 centre = -(R[1].transpose() * t[1]);
  const double eye[3] = {centre.x(), centre.y(), centre.z()};
  double silent = 0.0;
  for (std::size_t j = 0; j < model.lines.size(); ++j) {
    if (is_hidden(model, j, eye)) continue;
    if (std::any_of(taken.begin(), taken.end(), [j](const Assignment& a) { return a.model_line == j; })) continue;
    ProjectedLine at[kNumInstants];
    for (std::size_t k = 0; k < kNumInstants; ++k) at[k] = project_line(model.lines[j], R[k], t[k], f_px, frame);
    const double seen = at[1].seen_high_px - at[1].seen_low_px;
    if (!(at[0].length_px > 0.0 && at[1].length_px > 0.0 && at[2].length_px > 0.0) || seen < kMinSeenUnits * unit_px) {
      continue;
    }
    const double loudness = (travel_px(at[0], at[2]) - kSilentTravelPx) / (kLoudTravelPx - kSilentTravelPx);
    silent += line_weight(seen, unit_px) * (1.0 - std::clamp(loudness, 0.0, 1.0));
  }
  return silent;
}

}  // namespace lecalib
