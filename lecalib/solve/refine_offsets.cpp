// SPDX-License-Identifier: MIT
/// What the points say about offsets of their edges, beside camera and poses: a part of Refiner.
#include <cmath>

#include "lecalib/math/cholesky.hpp"
#include "lecalib/math/packed_cholesky.hpp"
#include "lecalib/math/so3.hpp"
#include "lecalib/solve/edge_offsets.hpp"
#include "lecalib/solve/refine.hpp"

namespace lecalib {
namespace {

Eigen::Map<Vec9> camera_row(const EdgeOffsetWorkspace& ws, std::size_t i) {
  return Eigen::Map<Vec9>(&ws.by_camera[kNumIntrinsics * i]);
}
Eigen::Map<Vec6> pose_row(const EdgeOffsetWorkspace& ws, std::size_t i) { return Eigen::Map<Vec6>(&ws.by_pose[6 * i]); }

}  // namespace

void Refiner::add_offset_equations(const EdgeOffsets& offsets, const EdgeOffsetWorkspace& out) const {
  for (std::size_t v = 0; v < views_.size(); ++v) {
    if (views_[v].used) add_view_offsets(v, offsets, out);
  }
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    for (std::size_t k = 0; k < kNumIntrinsics; ++k) {
      if (!policy_.free[k]) camera_row(out, i)(static_cast<Eigen::Index>(k)) = 0.0;
    }
  }
}

void Refiner::add_view_rows(std::size_t index, const EdgeOffsets& offsets, const EdgeOffsetWorkspace& out) const {
  const View& span = data_.views[index];
  for (double& value : out.by_pose.first(6 * offsets.size())) value = 0.0;
  const Mat3 R = rotation_of(views_[index].pose);
  const Vec3 t = translation_of(views_[index].pose);
  const double knee = radius_of_slope(camera_, kKneeSlope);
  for (std::size_t i = span.first; i < span.first + span.count; ++i) {
    if (!is_left_out(data_, i))
      add_point_offsets(i, line_in_camera(R, t, data_.model[data_.points[i].line]), knee, offsets.terms(i), out);
  }
}

void Refiner::add_view_offsets(std::size_t index, const EdgeOffsets& offsets, const EdgeOffsetWorkspace& out) const {
  const RefineView& view = views_[index];
  Cholesky<6> factor;
  if (!factor.factor(pose_block_of(view), kMinPosePivot)) return;
  add_view_rows(index, offsets, out);
  std::size_t active = 0;
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    if (!pose_row(out, i).isZero(0.0)) out.active[active++] = static_cast<std::uint16_t>(i);
  }
  const Mat69 cross = cross_block_of(view);
  const Vec6 pose_step = factor.solve(Vec6(Eigen::Map<const Vec6>(view.pose_gradient)));
  for (std::size_t a = 0; a < active; ++a) {
    const std::size_t i = out.active[a];
    const Vec6 row = pose_row(out, i);
    const Vec6 answer = factor.solve(row);
    out.gradient[i] -= row.dot(pose_step);
    camera_row(out, i) -= cross.transpose() * answer;
    for (std::size_t b = 0; b <= a; ++b) {
      out.matrix[triangle_index(i, out.active[b])] -= answer.dot(pose_row(out, out.active[b]));
    }
  }
}

/// Adds one point to gradient, by_camera, by_pose and matrix, before the pose is eliminated.
void Refiner::add_point_offsets(std::size_t index, const CameraLine& line, double knee, const OffsetTerms& terms,
                                const EdgeOffsetWorkspace& out) const {
  const LinePoint& point = data_.points[index];
  IdealLine ideal;
  LineResidual residual;
  if (terms.count == 0 || !straightened_line(line, knee, &ideal) ||
      !line_residual(camera_, line, ideal, Vec2(point.u_px, point.v_px), nullptr, &residual)) {
    return;
  }
  const double inverse_sigma = 1.0 / point.sigma_px;
  const double r = residual.value_px() * inverse_sigma;
  const double weight = evaluate_loss(options_.loss, options_.loss_width, r * r).weight * inverse_sigma * inverse_sigma;
  // By the principal point the residual changes as by the pixel, turned round; so it does by what is taken off the
  // pixel.
  const EdgePoint& edge = data_.edges[index];
  const double by_offset = residual.d_intrinsics()(2) * static_cast<double>(edge.normal_x) +
                           residual.d_intrinsics()(3) * static_cast<double>(edge.normal_y);
  for (std::size_t a = 0; a < terms.count; ++a) {
    const std::size_t i = terms.index[a];
    const double gain = weight * by_offset * terms.factor[a];
    out.gradient[i] -= gain * residual.value_px();
    camera_row(out, i) += gain * residual.d_intrinsics().transpose();
    pose_row(out, i) += gain * residual.d_pose().transpose();
    for (std::size_t b = 0; b < terms.count; ++b) {
      if (terms.index[b] <= i) out.matrix[triangle_index(i, terms.index[b])] += gain * by_offset * terms.factor[b];
    }
  }
}

}  // namespace lecalib
