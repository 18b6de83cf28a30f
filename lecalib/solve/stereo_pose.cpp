// SPDX-License-Identifier: MIT
#include "lecalib/solve/stereo_pose.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/eigen.hpp"
#include "lecalib/math/line_projection.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// Places are the same within this share of the model's size.
constexpr double kSamePlace = 1e-3;

/// Pairs that propose a pose between the cameras, at most: evenly spread over all.
constexpr std::size_t kMaxProposals = 16;

/// What a turn between the cameras counts as disagreement, per rad: little beside what another symmetry disagrees as
/// soon as anything turns, and enough to decide where nothing does.
constexpr double kPerTurn = 0.01;

/// Of the pairs, at least.
constexpr double kMinAgreeing = 2.0 / 3.0;

/// Columns: along b - a, across it in the plane of the three points, and normal to it.
Mat3 frame_of(const Vec3& a, const Vec3& b, const Vec3& c) {
  Mat3 frame;
  frame.col(0) = (b - a).normalized();
  frame.col(2) = (b - a).cross(c - a).normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

bool maps_onto(const Mat3& R, const Vec3& t, Span<const ModelLine> model, double reach_m) {
  for (const ModelLine& line : model) {
    const Vec3 p = R * start_of(line) + t;
    const Vec3 q = R * end_of(line) + t;
    const bool found = std::any_of(model.begin(), model.end(), [&](const ModelLine& other) {
      const Vec3 a = start_of(other);
      const Vec3 b = end_of(other);
      return ((p - a).norm() <= reach_m && (q - b).norm() <= reach_m) ||
             ((p - b).norm() <= reach_m && (q - a).norm() <= reach_m);
    });
    if (!found) return false;
  }
  return true;
}

/// How far the right camera's pose is from the one that the left one's has with T_right_left, a turn of 1 rad and a
/// shift by the object's distance counting alike.
double disagreement(const Pose& T_right_left, const Pose& left, const Pose& right) {
  const Pose expected = product(T_right_left, left);
  const Mat3 turn = rotation_of(right) * rotation_of(expected).transpose();
  const double distance = translation_of(right).norm() + translation_of(expected).norm();
  return so3_log(turn).norm() + 2 * (translation_of(right) - translation_of(expected)).norm() / distance;
}

/// By the symmetry that fits best. @param symmetry may be null
double least_disagreement(const Pose& T_right_left, const PosePair& pair, Span<const Pose> symmetries, Pose* symmetry) {
  double least = 0;
  for (std::size_t i = 0; i < symmetries.size(); ++i) {
    const double off = disagreement(T_right_left, product(pair.left, symmetries[i]), pair.right);
    if (i > 0 && off >= least) continue;
    least = off;
    if (symmetry != nullptr) *symmetry = symmetries[i];
  }
  return least;
}

/// Mean over all pairs, of each no more than `most`.
double mean_disagreement(const Pose& T_right_left, Span<const PosePair> pairs, Span<const Pose> symmetries,
                         double most) {
  double sum = 0;
  for (const PosePair& pair : pairs) sum += std::min(most, least_disagreement(T_right_left, pair, symmetries, nullptr));
  return sum / static_cast<double>(pairs.size());
}

/// Fills in the pairs' symmetries and which pairs agree. @return whether enough do
bool agree(const Pose& T_right_left, Span<const Pose> symmetries, const StereoPoseOptions& options,
           Span<PosePair> pairs) {
  double sum = 0;
  double near = 0;
  for (PosePair& pair : pairs) {
    const double off = least_disagreement(T_right_left, pair, symmetries, &pair.symmetry);
    if (off > options.agreement) continue;
    sum += off;
    near += 1;
  }
  if (!(near > 0)) return false;
  const double limit = std::min(options.agreement, std::max(kLeastAgreement, options.over_mean * sum / near));
  double agreeing = 0;
  for (PosePair& pair : pairs) {
    pair.agrees = least_disagreement(T_right_left, pair, symmetries, nullptr) <= limit;
    agreeing += pair.agrees ? 1 : 0;
  }
  return agreeing >= kMinAgreeing * static_cast<double>(pairs.size());
}

}  // namespace

std::size_t find_symmetries(Span<const ModelLine> model, Span<Pose> out) {
  if (out.empty()) return 0;
  std::size_t count = 0;
  out[count++] = Pose();
  if (model.empty()) return count;
  // Three points of the model, as far from one line as any, and where else they may lie.
  const Vec3 a = start_of(model[0]);
  const Vec3 b = end_of(model[0]);
  Vec3 c = a;
  double size = 0;
  for (const ModelLine& line : model) {
    for (const Vec3& p : {start_of(line), end_of(line)}) {
      if ((b - a).cross(p - a).norm() > (b - a).cross(c - a).norm()) c = p;
      size = std::max(size, (p - a).norm());
    }
  }
  const double reach = kSamePlace * size;
  if ((b - a).cross(c - a).norm() <= reach * reach) return count;
  const Mat3 from = frame_of(a, b, c);
  const auto offer = [&](const Vec3& at_a, const Vec3& at_b, const Vec3& at_c) {
    if (std::abs((at_c - at_a).norm() - (c - a).norm()) > reach ||
        std::abs((at_c - at_b).norm() - (c - b).norm()) > reach)
      return;
    const Mat3 R = frame_of(at_a, at_b, at_c) * from.transpose();
    const Vec3 t = at_a - R * a;
    for (std::size_t i = 0; i < count; ++i) {
      const double turn = so3_log(R * rotation_of(out[i]).transpose()).norm();
      if (turn * size <= 2 * reach && (t - translation_of(out[i])).norm() <= 2 * reach) return;
    }
    if (count < out.size() && maps_onto(R, t, model, reach)) out[count++] = make_pose(R, t);
  };
  for (const ModelLine& first : model) {
    if (std::abs((end_of(first) - start_of(first)).norm() - (b - a).norm()) > reach) continue;
    for (const ModelLine& second : model) {
      for (const Vec3& at_c : {start_of(second), end_of(second)}) {
        offer(start_of(first), end_of(first), at_c);
        offer(end_of(first), start_of(first), at_c);
      }
    }
  }
  return count;
}

Status find_stereo_pose(Span<PosePair> pairs, Span<const Pose> symmetries, const StereoPoseOptions& options,
                        Pose* T_right_left) {
  if (pairs.empty() || symmetries.empty()) return Status::no_match;
  Pose best;
  double least = 0;
  bool any = false;
  const std::size_t proposals = std::min(kMaxProposals, pairs.size());
  for (std::size_t k = 0; k < proposals; ++k) {
    const PosePair& pair = pairs[k * pairs.size() / proposals];
    for (const Pose& symmetry : symmetries) {
      const Pose proposed = product(pair.right, product(symmetry, inverse_of(pair.left)));
      const double off = mean_disagreement(proposed, pairs, symmetries, options.agreement) +
                         kPerTurn * so3_log(rotation_of(proposed)).norm();
      if (any && off >= least) continue;
      any = true;
      least = off;
      best = proposed;
    }
  }
  if (!agree(best, symmetries, options, pairs)) return Status::no_match;
  *T_right_left = best;
  return Status::ok;
}

}  // namespace lecalib
