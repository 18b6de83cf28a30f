// SPDX-License-Identifier: MIT
#include "lecalib/match/model_graph.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/match/bounded_best.hpp"
#include "lecalib/math/eigen.hpp"
#include "lecalib/math/line_projection.hpp"

namespace lecalib {
namespace {

/// Two corners on one line count as the two ends of a side when they are this share of the line's length apart.
constexpr double kMinSide = 0.2;
/// Lines closer in direction than this sine are parallel.
constexpr double kMinSine = 0.02;

struct Meeting {
  Vec3 point;
  double s_first, s_second;  ///< where on each line, 0 at p, 1 at q
  bool at_ends;
};

Vec3 direction_of(const ModelLine& line) { return end_of(line) - start_of(line); }

bool near_end(double s, double tolerance) { return std::abs(s) <= tolerance || std::abs(s - 1.0) <= tolerance; }

/// Where two segments meet, within the tolerance.
bool meet(const ModelLine& first, const ModelLine& second, double tolerance, Meeting* out) {
  const Vec3 d1 = direction_of(first);
  const Vec3 d2 = direction_of(second);
  const Vec3 w = start_of(second) - start_of(first);
  const double a = d1.squaredNorm();
  const double b = d1.dot(d2);
  const double c = d2.squaredNorm();
  const double determinant = a * c - b * b;
  if (determinant <= kMinSine * kMinSine * a * c) return false;
  out->s_first = (c * d1.dot(w) - b * d2.dot(w)) / determinant;
  out->s_second = (b * d1.dot(w) - a * d2.dot(w)) / determinant;
  const double reach = tolerance * std::sqrt(std::min(a, c));
  const double tol1 = reach / std::sqrt(a);
  const double tol2 = reach / std::sqrt(c);
  if (out->s_first < -tol1 || out->s_first > 1.0 + tol1) return false;
  if (out->s_second < -tol2 || out->s_second > 1.0 + tol2) return false;
  const Vec3 on_first = start_of(first) + out->s_first * d1;
  const Vec3 on_second = start_of(second) + out->s_second * d2;
  if ((on_first - on_second).norm() > reach) return false;
  out->point = 0.5 * (on_first + on_second);
  out->at_ends = near_end(out->s_first, tol1) && near_end(out->s_second, tol2);
  return true;
}

bool better_quad(const ModelQuad& a, const ModelQuad& b) {
  if (a.closed != b.closed) return a.closed;
  return a.area_m2 > b.area_m2;
}

class QuadSearch {
 public:
  QuadSearch(Span<const ModelLine> lines, double tolerance, Span<ModelQuad> storage)
      : lines_(lines), tolerance_(tolerance), best_(storage) {}

  /// Every 4-cycle is found once: `first` is its smallest index, its neighbour `second` is smaller than `fourth`.
  void run() {
    for (std::size_t first = 0; first < lines_.size(); ++first) {
      for (std::size_t second = first + 1; second < lines_.size(); ++second) {
        Meeting at_second;
        if (!meet(lines_[first], lines_[second], tolerance_, &at_second)) continue;
        for (std::size_t fourth = second + 1; fourth < lines_.size(); ++fourth) {
          Meeting at_fourth;
          if (!meet(lines_[first], lines_[fourth], tolerance_, &at_fourth)) continue;
          if (std::abs(at_second.s_first - at_fourth.s_first) < kMinSide) continue;
          close(first, second, fourth, at_second, at_fourth);
        }
      }
    }
  }
  [[nodiscard]] const BoundedBest<ModelQuad>& best() const { return best_; }

 private:
  void close(std::size_t first, std::size_t second, std::size_t fourth, const Meeting& at_second,
             const Meeting& at_fourth) {
    for (std::size_t third = first + 1; third < lines_.size(); ++third) {
      if (third == second || third == fourth) continue;
      Meeting m23;
      Meeting m34;
      if (!meet(lines_[second], lines_[third], tolerance_, &m23)) continue;
      if (!meet(lines_[third], lines_[fourth], tolerance_, &m34)) continue;
      if (std::abs(m23.s_first - at_second.s_second) < kMinSide) continue;
      if (std::abs(m34.s_second - at_fourth.s_second) < kMinSide) continue;
      if (std::abs(m23.s_second - m34.s_first) < kMinSide) continue;
      offer({first, second, third, fourth}, at_second, m23, m34, at_fourth);
    }
  }

  void offer(const std::size_t (&side)[4], const Meeting& m12, const Meeting& m23, const Meeting& m34,
             const Meeting& m41) {
    ModelQuad quad{};
    const Meeting* meetings[4] = {&m12, &m23, &m34, &m41};
    quad.closed = true;
    for (int i = 0; i < 4; ++i) {
      quad.line[i] = static_cast<std::uint16_t>(side[i]);
      Eigen::Map<Vec3>(quad.corner[i]) = meetings[i]->point;
      quad.closed = quad.closed && meetings[i]->at_ends;
    }
    const Vec3 diagonal1 = m34.point - m12.point;
    const Vec3 diagonal2 = m41.point - m23.point;
    const Vec3 normal = diagonal1.cross(diagonal2);
    quad.area_m2 = 0.5 * normal.norm();
    const double size = std::min(diagonal1.norm(), diagonal2.norm());
    if (quad.area_m2 <= kMinSine * size * size) return;
    const double height = std::abs(normal.normalized().dot(m23.point - m12.point));
    if (height > tolerance_ * size) return;  // not flat
    best_.offer(quad, better_quad);
  }

  Span<const ModelLine> lines_;
  double tolerance_;
  BoundedBest<ModelQuad> best_;
};

/// The plane of a quad with all of the model behind it.
/// @return false when the model lies on both sides, or all in that plane: then the quad is no face of a solid
bool outer_plane(const ModelQuad& quad, Span<const ModelLine> model, double tolerance_m, double (*plane)[4]) {
  const Vec3 origin = Eigen::Map<const Vec3>(quad.corner[0]);
  const Vec3 d1 = Eigen::Map<const Vec3>(quad.corner[2]) - origin;
  const Vec3 d2 = Eigen::Map<const Vec3>(quad.corner[3]) - Eigen::Map<const Vec3>(quad.corner[1]);
  const Vec3 normal = d1.cross(d2).normalized();
  double low = 0.0;
  double high = 0.0;
  for (const ModelLine& line : model) {
    for (const double* end : {line.p, line.q}) {
      const double height = normal.dot(Eigen::Map<const Vec3>(end) - origin);
      low = std::min(low, height);
      high = std::max(high, height);
    }
  }
  if (low > -tolerance_m && high < tolerance_m) return false;
  if (low < -tolerance_m && high > tolerance_m) return false;
  const double sign = high < tolerance_m ? 1.0 : -1.0;
  for (int i = 0; i < 3; ++i) (*plane)[i] = sign * normal(i);
  (*plane)[3] = sign * normal.dot(origin);
  return true;
}

void find_sides(const ModelGraph& graph, double tolerance_m, Span<ModelSides> sides) {
  for (ModelSides& side : sides) side.num = 0;
  for (const ModelQuad& quad : graph.quads) {
    double plane[4];
    if (!quad.closed || !outer_plane(quad, graph.lines, tolerance_m, &plane)) continue;
    for (const std::uint16_t line : quad.line) {
      if (sides[line].num == 2) continue;  // no more faces of a solid meet in a line
      std::copy(plane, plane + 4, sides[line].plane[sides[line].num++]);
    }
  }
}

bool is_in_front(const double (&plane)[4], const double (&eye)[3]) {
  return plane[0] * eye[0] + plane[1] * eye[1] + plane[2] * eye[2] > plane[3];
}

bool is_finite(const ModelLine& line) {
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) sum += std::abs(line.p[i]) + std::abs(line.q[i]);
  return sum < 1e9;  // false for NaN
}

bool all_parallel(Span<const ModelLine> model) {
  const Vec3 first = direction_of(model[0]).normalized();
  return std::all_of(model.begin(), model.end(), [&first](const ModelLine& line) {
    return direction_of(line).normalized().cross(first).norm() < kMinSine;
  });
}

}  // namespace

Status build_model_graph(Span<const ModelLine> model, const ModelGraphOptions& options, Span<ModelQuad> storage,
                         Span<ModelSides> sides, ModelGraph* out) {
  if (!(options.corner_tolerance > 0.0 && options.corner_tolerance <= 0.2)) return Status::invalid_argument;
  Vec3 low = Vec3::Constant(1e300);
  Vec3 high = -low;
  for (const ModelLine& line : model) {
    if (!is_finite(line)) return Status::invalid_argument;
    if (direction_of(line).norm() <= 0.0) return Status::invalid_argument;
    for (const double* end : {line.p, line.q}) {
      low = low.cwiseMin(Eigen::Map<const Vec3>(end));
      high = high.cwiseMax(Eigen::Map<const Vec3>(end));
    }
  }
  if (model.size() < 4) return Status::too_few_lines;
  if (all_parallel(model)) return Status::degenerate_geometry;
  QuadSearch search(model, options.corner_tolerance, storage);
  search.run();
  out->lines = model;
  out->quads = search.best().view();
  out->extent_m = (high - low).norm();
  Eigen::Map<Vec3>(out->centre_m) = 0.5 * (low + high);
  out->quads_dropped = search.best().dropped();
  const Span<ModelSides> used = sides.first(model.size());
  find_sides(*out, options.corner_tolerance * out->extent_m, used);
  out->sides = used;
  return Status::ok;
}

bool is_hidden(const ModelGraph& graph, std::size_t line, const double (&eye)[3]) {
  const ModelSides& sides = graph.sides[line];
  if (sides.num < 2 || is_in_front(sides.plane[0], eye) || is_in_front(sides.plane[1], eye)) return false;
  for (const ModelSides& other : graph.sides) {
    for (int i = 0; i < other.num; ++i) {
      if (is_in_front(other.plane[i], eye)) return true;
    }
  }
  return false;
}

}  // namespace lecalib
