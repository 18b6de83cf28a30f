// SPDX-License-Identifier: MIT
#include "lecalib/solve/edge_offsets.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/chance.hpp"
#include "lecalib/math/cholesky.hpp"
#include "lecalib/math/packed_cholesky.hpp"

namespace lecalib {
namespace {

enum Shared : std::uint16_t { kDark, kTrailing, kBend, kOffBySpeed, kOnBySpeed, kLatency };
enum OfLine : std::size_t { kHalfWidth, kOffset, kTilt, kOwnBend };  // the last three twice, for OFF and for ON

constexpr std::uint16_t kNoOffset = 0xFFFF;
constexpr double kSecondsPerMs = 1e-3;

std::size_t slot_of(std::size_t line, OfLine which, bool on) {
  return kOffsetsPerLine * line + which + (which != kHalfWidth && on ? 3 : 0);
}

double sign_of(float v) { return v > 0 ? 1.0 : v < 0 ? -1.0 : 0.0; }

/// ln(|v| / v0); a line that turns about one of its points has some that stand still.
double log_speed(float px_per_s) {
  constexpr float kSlowest = 0.1F;
  constexpr float kUsual = 150;
  return static_cast<double>(natural_log(std::max(std::fabs(px_per_s) / kUsual, kSlowest)));
}

}  // namespace

void EdgeOffsets::init(const CalibrationData& data, const EdgeOffsetOptions& options,
                       const EdgeOffsetWorkspace& workspace) {
  add_covariance_ = &EdgeOffsets::do_add_covariance;
  data_ = data;
  options_ = options;
  workspace_ = workspace;
  workspace_.sigma[kDark] = options.dark_px;
  workspace_.sigma[kTrailing] = options.trailing_px;
  workspace_.sigma[kBend] = options.bend_px;
  workspace_.sigma[kLatency] = kSecondsPerMs * options.latency_ms;
  workspace_.sigma[kOffBySpeed] = options.off_by_speed_px;
  workspace_.sigma[kOnBySpeed] = options.on_by_speed_px;
  size_ = kSharedOffsets;
  for (std::uint16_t& slot : workspace_.slot) slot = kNoOffset;
  for (std::size_t line = 0; line < data.model.size(); ++line) add_line(line);
  restart();
}

double EdgeOffsets::mean(std::size_t offset) const {
  switch (offset) {
    case kLatency: return kSecondsPerMs * options_.mean_latency_ms;
    case kOffBySpeed: return options_.mean_off_by_speed_px;
    case kOnBySpeed: return options_.mean_on_by_speed_px;
    default: return 0;
  }
}

void EdgeOffsets::restart() {
  for (std::size_t i = 0; i < size_; ++i) workspace_.value[i] = mean(i);
}

void EdgeOffsets::add(std::size_t slot, double sigma) {
  workspace_.slot[slot] = static_cast<std::uint16_t>(size_);
  workspace_.sigma[size_++] = sigma;
}

void EdgeOffsets::add_line(std::size_t line) {
  constexpr double kClearEvents = 2.5;
  double count[2] = {};
  double events[2] = {};
  for (std::size_t i = 0; i < data_.points.size(); ++i) {
    const EdgePoint& edge = data_.edges[i];
    if (data_.points[i].line != line || edge.dark == 0) continue;
    const std::size_t on = edge.polarity > 0 ? 1 : 0;
    count[on] += 1;
    events[on] += static_cast<double>(edge.events);
  }
  for (const bool on : {false, true}) {
    const std::size_t k = on ? 1 : 0;
    if (!(count[k] > 0)) continue;
    const double faint = std::clamp(kClearEvents - events[k] / count[k], 0.0, 1.0);
    add(slot_of(line, kOffset, on), options_.line_px + faint * (options_.faint_line_px - options_.line_px));
    add(slot_of(line, kTilt, on), tilt_px(on));
    add(slot_of(line, kOwnBend, on), line_bend_px(on));
  }
  if (is_drawn(data_, options_.drawn, line)) add(slot_of(line, kHalfWidth, false), options_.half_width_px);
}

OffsetTerms EdgeOffsets::terms(std::size_t point) const {
  OffsetTerms out;
  const EdgePoint& edge = data_.edges[point];
  if (edge.dark == 0) return out;
  const auto add_term = [&](std::uint16_t index, double factor) {
    if (index == kNoOffset) return;
    out.index[out.count] = index;
    out.factor[out.count++] = factor;
  };
  const auto dark = static_cast<double>(edge.dark);
  const std::size_t line = data_.points[point].line;
  const bool on = edge.polarity > 0;
  add_term(kDark, dark);
  const auto along = static_cast<double>(edge.along);
  const double bend = bend_at(along);
  add_term(kBend, dark * bend);
  add_term(kTrailing, -sign_of(edge.speed_px_per_s));
  add_term(on ? kOnBySpeed : kOffBySpeed, -dark * log_speed(edge.speed_px_per_s));
  add_term(kLatency, -static_cast<double>(edge.speed_px_per_s));
  add_term(workspace_.slot[slot_of(line, kHalfWidth, on)], dark);
  add_term(workspace_.slot[slot_of(line, kOffset, on)], dark);
  add_term(workspace_.slot[slot_of(line, kTilt, on)], dark * along);
  add_term(workspace_.slot[slot_of(line, kOwnBend, on)], dark * bend);
  return out;
}

double EdgeOffsets::displacement(std::size_t point) const {
  const OffsetTerms t = terms(point);
  double sum = 0;
  for (std::size_t i = 0; i < t.count; ++i) sum += t.factor[i] * workspace_.value[t.index[i]];
  return sum;
}

void EdgeOffsets::correct(Span<LinePoint> out) const {
  for (std::size_t i = 0; i < data_.points.size(); ++i) {
    const double px = displacement(i);
    out[i] = data_.points[i];
    out[i].u_px -= px * static_cast<double>(data_.edges[i].normal_x);
    out[i].v_px -= px * static_cast<double>(data_.edges[i].normal_y);
  }
}

/// The offsets' normal equations with poses and camera eliminated, in matrix and gradient (to be solved for their
/// change); by_camera holds what ties them to the camera.
bool EdgeOffsets::reduce(const Refiner& refiner) {
  ReducedSystem system;
  Cholesky<9> camera;
  if (!refiner.reduced_system(&system) || !camera.factor(system.matrix)) return false;
  const std::size_t n = size_;
  const Span<double> matrix = workspace_.matrix.first(triangle_index(n, 0));
  for (double& value : matrix) value = 0;
  for (double& value : workspace_.gradient.first(n)) value = 0;
  for (double& value : workspace_.by_camera.first(kNumIntrinsics * n)) value = 0;
  refiner.add_offset_equations(*this, workspace_);
  const Vec9 step = camera.solve(system.gradient);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec9 row = Eigen::Map<const Vec9>(&workspace_.by_camera[kNumIntrinsics * i]);
    const Vec9 answer = camera.solve(row);
    for (std::size_t j = 0; j <= i; ++j) {
      matrix[triangle_index(i, j)] -= answer.dot(Eigen::Map<const Vec9>(&workspace_.by_camera[kNumIntrinsics * j]));
    }
    const double precision = refiner.prior_weight() / (workspace_.sigma[i] * workspace_.sigma[i]);
    matrix[triangle_index(i, i)] += precision;
    workspace_.gradient[i] -= row.dot(step) + precision * (workspace_.value[i] - mean(i));
  }
  return factor_packed(matrix, n);
}

bool EdgeOffsets::solve(const Refiner& refiner, double* largest_px) {
  if (!reduce(refiner)) return false;
  solve_packed(workspace_.matrix, size_, workspace_.gradient);
  double largest = 0;
  for (std::size_t i = 0; i < size_; ++i) {
    const double change = workspace_.gradient[i];
    workspace_.value[i] += change;
    if (i != kLatency) largest = std::max(largest, std::abs(change));
  }
  for (const bool on : {false, true}) {
    estimate_size(kTilt, on, tilt_px(on), refiner.prior_weight());
    estimate_size(kOwnBend, on, line_bend_px(on), refiner.prior_weight());
  }
  *largest_px = largest;
  return true;
}

/// One step towards the likeliest size of an offset that all lines have: the mean of what their squares are expected to
/// be, the size beforehand counting as kBeforehand lines.
void EdgeOffsets::estimate_size(std::size_t which, bool on, double beforehand_px, double prior_weight) {
  constexpr double kBeforehand = 4;
  double lines = kBeforehand;
  double squares = kBeforehand * beforehand_px * beforehand_px;
  const auto offset_of = [&](std::size_t line) {
    return workspace_.slot[slot_of(line, static_cast<OfLine>(which), on)];
  };
  for (std::size_t line = 0; line < data_.model.size(); ++line) {
    const std::uint16_t i = offset_of(line);
    if (i == kNoOffset) continue;
    lines += 1;
    squares += workspace_.value[i] * workspace_.value[i] + prior_weight * inverse_entry(i);
  }
  const double size = std::sqrt(squares / lines);
  for (std::size_t line = 0; line < data_.model.size(); ++line) {
    if (offset_of(line) != kNoOffset) workspace_.sigma[offset_of(line)] = size;
  }
}

/// Entry (i, i) of the inverse of the factored matrix.
double EdgeOffsets::inverse_entry(std::size_t i) {
  const Span<double> x = workspace_.by_pose;
  double sum = 0;
  for (std::size_t row = i; row < size_; ++row) {
    double v = row == i ? 1.0 : 0.0;
    for (std::size_t k = i; k < row; ++k) v -= workspace_.matrix[triangle_index(row, k)] * x[k];
    x[row] = v / workspace_.matrix[triangle_index(row, row)];
    sum += x[row] * x[row];
  }
  return sum;
}

bool EdgeOffsets::do_add_covariance(const Refiner& refiner, double scale, Mat9* sum) {
  ReducedSystem system;
  Cholesky<9> camera;
  if (!refiner.reduced_system(&system) || !camera.factor(system.matrix) || !reduce(refiner)) return false;
  // With H = L L' and answers A = inv(S) G': A inv(H) A' = M M', M = A inv(L)', row by row of M'.
  for (std::size_t i = 0; i < size_; ++i) {
    Eigen::Map<Vec9> place(&workspace_.by_camera[kNumIntrinsics * i]);
    Vec9 row = camera.solve(Vec9(place));
    for (std::size_t k = 0; k < i; ++k) {
      row -=
          workspace_.matrix[triangle_index(i, k)] * Eigen::Map<const Vec9>(&workspace_.by_camera[kNumIntrinsics * k]);
    }
    row /= workspace_.matrix[triangle_index(i, i)];
    place = row;
    *sum += scale * row * row.transpose();
  }
  return true;
}

void EdgeOffsets::mark_strays(Span<std::uint8_t> marks) const {
  for (std::size_t line = 0; line < data_.model.size(); ++line) {
    if (workspace_.slot[slot_of(line, kHalfWidth, false)] == kNoOffset) lecalib::mark_strays(data_, line, marks);
  }
}

double EdgeOffsets::sigmas_off(std::size_t line, bool on) const {
  const std::uint16_t i = workspace_.slot[slot_of(line, kOffset, on)];
  return i == kNoOffset ? 0.0 : std::abs(workspace_.value[i]) / workspace_.sigma[i];
}

bool EdgeOffsets::mark_wrong_lines(Span<std::uint8_t> marks) {
  double worst = 0;
  for (std::size_t line = 0; line < data_.model.size(); ++line) {
    worst = std::max({worst, sigmas_off(line, false), sigmas_off(line, true)});
  }
  if (!(worst > options_.max_sigmas)) return false;
  const double limit = std::max(options_.max_sigmas, 0.5 * worst);
  for (std::size_t i = 0; i < data_.points.size(); ++i) {
    if (sigmas_off(data_.points[i].line, data_.edges[i].polarity > 0) > limit) marks[i] = 1;
  }
  restart();
  return true;
}

}  // namespace lecalib
