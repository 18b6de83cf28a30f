// SPDX-License-Identifier: MIT
#include "lecalib/solve/line_ransac.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

/// Division-model mu of the straightenings tried, 1 at the image corner. The reach bridges what lies between.
constexpr double kSampleStraightenings[] = {0.1, 0.0, 0.3, -0.15, 0.5};
constexpr int kNumSampleStraightenings =
    static_cast<int>(sizeof(kSampleStraightenings) / sizeof(kSampleStraightenings[0]));

/// Refits to all near lines, each time the best solution is beaten.
constexpr int kRefits = 3;

/// Draws of one line for a sample before the sample is given up: it must differ from those drawn before.
constexpr int kMaxDraws = 64;

double squared_distance(const Vec3& line, const double* point) {
  const double d = line(0) * point[0] + line(1) * point[1] + line(2);
  return d * d;
}

/// Mean squared distance of an image line's two points from the image of its model line.
double squared_error(const Mat34& M, const ModelLine& model, const ViewLine& line) {
  const Vec3 p = M * Eigen::Vector4d(model.p[0], model.p[1], model.p[2], 1.0);
  const Vec3 q = M * Eigen::Vector4d(model.q[0], model.q[1], model.q[2], 1.0);
  const Vec3 l = p.cross(q);
  const double scale2 = l.head<2>().squaredNorm();
  if (!(scale2 > 0.0)) return 1e300;
  return 0.5 * (squared_distance(l, line.image_p) + squared_distance(l, line.image_q)) / scale2;
}

double power(double base, int exponent) {
  double result = 1.0;
  for (; exponent > 0; exponent >>= 1, base *= base) {
    if ((exponent & 1) != 0) result *= base;
  }
  return result;
}

}  // namespace

Status LineRansac::init(const CalibrationData& data, const LineRansacOptions& options,
                        const LineRansacWorkspace& workspace, Span<std::uint8_t> left_out) {
  if (options.max_samples <= 0 || !(options.failure > 0.0 && options.failure < 1.0) || !(options.reach_share > 0.0) ||
      !(options.min_right_share >= 0.0 && options.min_right_share <= 1.0))
    return Status::invalid_argument;
  if (workspace.sums.size() < data.model.size() || workspace.lines.size() < data.model.size() ||
      workspace.chosen.size() < data.model.size() || left_out.size() < data.points.size())
    return Status::capacity_exceeded;
  *this = LineRansac();
  data_ = data;
  data_.left_out = {};
  options_ = options;
  workspace_ = workspace;
  left_out_ = left_out;
  rng_ = Rng(options.seed);
  for (std::uint8_t& mark : left_out_) mark = 0;
  begin_view();
  return Status::ok;
}

Straightening LineRansac::straightening(int index) const {
  const double x = centre_x(data_);
  const double y = centre_y(data_);
  return {x, y, std::sqrt(x * x + y * y), kSampleStraightenings[index]};
}

void LineRansac::begin_view() {
  best_straightening_ = -1;
  best_near_ = 0;
  best_cost_ = 1e300;
  straightening_ = 0;
  if (view_ < data_.views.size()) begin_straightening();
}

void LineRansac::begin_straightening() {
  samples_ = 0;
  fit_view_lines(data_, data_.views[view_], straightening(straightening_), workspace_.sums, workspace_.lines,
                 &num_lines_);
  frame_ = find_model_frame(data_.model, Span<const ViewLine>(workspace_.lines).first(num_lines_));
  sample_size_ = frame_.shape == ModelShape::planar ? kMinPlanarLines : kMinNonPlanarLines;
}

Status LineRansac::step() {
  if (view_ >= data_.views.size()) return views_kept_ > 0 ? Status::ok : Status::degenerate_geometry;
  const bool possible = frame_.shape != ModelShape::collinear && num_lines_ > sample_size_;
  if (possible && !enough_samples()) {
    ++samples_;
    Mat34 M;
    if (draw_sample() && solve(workspace_.chosen.first(sample_size_), &M)) improve(M);
    return Status::in_progress;
  }
  if (possible && ++straightening_ < kNumSampleStraightenings) {
    begin_straightening();
    return Status::in_progress;
  }
  mark_view();
  ++view_;
  begin_view();
  return Status::in_progress;
}

bool LineRansac::enough_samples() const {
  if (samples_ >= options_.max_samples) return true;
  const double right = static_cast<double>(best_near_) / static_cast<double>(num_lines_);
  return power(1.0 - power(right, static_cast<int>(sample_size_)), samples_) < options_.failure;
}

/// Fills the first of `chosen` with different lines. False where chance does not find them.
bool LineRansac::draw_sample() {
  for (std::size_t k = 0; k < sample_size_; ++k) {
    bool found = false;
    for (int draw = 0; draw < kMaxDraws && !found; ++draw) {
      const ViewLine& line = workspace_.lines[rng_.below(static_cast<std::uint32_t>(num_lines_))];
      found = true;
      for (std::size_t j = 0; j < k; ++j) found = found && workspace_.chosen[j].model_line != line.model_line;
      if (found) workspace_.chosen[k] = line;
    }
    if (!found) return false;
  }
  return true;
}

/// The projection of world points, also where the lines lie in a plane.
bool LineRansac::solve(Span<const ViewLine> lines, Mat34* M) const {
  if (frame_.shape == ModelShape::non_planar) return solve_line_dlt(data_.model, lines, M);
  Mat3 H;
  if (!solve_planar_line_dlt(data_.model, lines, frame_, &H)) return false;
  Mat34 to_plane = Mat34::Zero();
  to_plane.topLeftCorner<2, 3>() = frame_.axes.topRows<2>();
  to_plane.topRightCorner<2, 1>() = -(frame_.axes.topRows<2>() * frame_.origin);
  to_plane(2, 3) = 1.0;
  *M = H * to_plane;
  return true;
}

/// Truncated cost over the view's lines; *near counts those within reach.
double LineRansac::judge(const Mat34& M, std::size_t* near) const {
  const double reach = options_.reach_share * straightening(straightening_).half_diagonal;
  double cost = 0.0;
  *near = 0;
  for (const ViewLine& line : workspace_.lines.first(num_lines_)) {
    const double error2 = squared_error(M, data_.model[line.model_line], line);
    if (error2 < reach * reach) ++*near;
    cost += std::min(error2, reach * reach);
  }
  return cost;
}

/// Keeps M where it beats the best, and what refits to its near lines make of it.
void LineRansac::improve(Mat34 M) {
  const double reach = options_.reach_share * straightening(straightening_).half_diagonal;
  for (int refit = 0;; ++refit) {
    std::size_t near = 0;
    const double cost = judge(M, &near);
    if (!(cost < best_cost_)) return;
    best_ = M;
    best_cost_ = cost;
    best_near_ = near;
    best_straightening_ = straightening_;
    if (refit == kRefits || near <= sample_size_) return;
    std::size_t count = 0;
    for (const ViewLine& line : workspace_.lines.first(num_lines_)) {
      if (squared_error(M, data_.model[line.model_line], line) < reach * reach) workspace_.chosen[count++] = line;
    }
    if (!solve(workspace_.chosen.first(count), &M)) return;
  }
}

/// Marks the points of the lines that the best solution does not explain, or all where it explains too few.
void LineRansac::mark_view() {
  const View& view = data_.views[view_];
  const auto total = static_cast<double>(num_lines_);
  const bool kept = best_near_ > sample_size_ && static_cast<double>(best_near_) >= options_.min_right_share * total;
  for (std::size_t i = view.first; i < view.first + view.count; ++i) left_out_[i] = 1;
  if (!kept) return;
  ++views_kept_;
  straightening_ = best_straightening_;
  begin_straightening();
  const double reach = options_.reach_share * straightening(straightening_).half_diagonal;
  for (const ViewLine& line : workspace_.lines.first(num_lines_)) {
    if (!(squared_error(best_, data_.model[line.model_line], line) < reach * reach)) continue;
    for (std::size_t i = view.first; i < view.first + view.count; ++i) {
      if (data_.points[i].line == line.model_line) left_out_[i] = 0;
    }
  }
}

}  // namespace lecalib
