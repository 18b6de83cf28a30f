// SPDX-License-Identifier: MIT
/// The normal equations of two cameras, a part of StereoRefiner: as in refine.cpp, with the increments p of the left
/// camera's pose, q of the right one's and e of T_right_left. To first order q = A p + e, A = [R 0; hat(t) R, R] of
/// T_right_left, so that a pair of views has
///     block C_l + A' C_r A, gradient h_l + A' h_r, and is tied to e by A' C_r, to the right camera by A' E_r.
#include <algorithm>

#include "lecalib/math/cholesky.hpp"
#include "lecalib/math/packed_cholesky.hpp"
#include "lecalib/math/so3.hpp"
#include "lecalib/solve/stereo_refiner.hpp"

namespace lecalib {
namespace {

Mat6 symmetric_block(const RefineView& view) {
  Mat6 block = pose_block_of(view);
  block.triangularView<Eigen::StrictlyUpper>() = block.transpose();
  return block;
}

Vec6 pose_gradient_of(const RefineView& view) { return Eigen::Map<const Vec6>(view.pose_gradient); }

}  // namespace

/// A: what an increment of the left camera's pose does to the right one's.
Mat6 StereoRefiner::right_by_left() const {
  const Mat3 R = rotation_of(solution_.T_right_left);
  Mat6 A = Mat6::Zero();
  A.topLeftCorner<3, 3>() = R;
  A.bottomRightCorner<3, 3>() = R;
  A.bottomLeftCorner<3, 3>() = hat(translation_of(solution_.T_right_left)) * R;
  return A;
}

/// Before the rows of all views are summed up.
void StereoRefiner::clear_rows() {
  for (std::size_t side = 0; side < kSides; ++side) {
    const StereoCamera& camera = cameras_[side];
    if (!is_estimated()) {
      for (LineResponse& response : camera.responses) response = {};
      continue;
    }
    const EdgeOffsetWorkspace& sums = camera.offsets->workspace();
    const std::size_t n = num_offsets_[side];
    for (double& value : sums.matrix.first(triangle_index(n, 0))) value = 0;
    for (double& value : sums.gradient.first(n)) value = 0;
    for (double& value : sums.by_camera.first(kNumIntrinsics * n)) value = 0;
  }
}

void StereoRefiner::fill_rows(std::size_t side, std::size_t view) {
  const StereoCamera& camera = cameras_[side];
  if (is_estimated()) {
    camera.refiner->add_view_rows(view, *camera.offsets, camera.offsets->workspace());
  } else {
    camera.refiner->add_line_rows(view, camera.responses);
  }
}

/// Of the view whose rows were filled last.
const double* StereoRefiner::pose_row(std::size_t side, std::size_t offset) const {
  const StereoCamera& camera = cameras_[side];
  return is_estimated() ? &camera.offsets->workspace().by_pose[6 * offset] : camera.responses[offset].pose;
}

/// Appends what ties a group's pose to the offsets and intrinsics of one camera.
/// @param by_pose what the group's pose does to the view's
/// @return how many columns there are now
std::size_t StereoRefiner::add_columns(std::size_t side, std::size_t view, const Mat6& by_pose, std::size_t active) {
  const auto append = [&](std::size_t parameter, const Vec6& column) {
    if (column.isZero(0.0)) return;
    Eigen::Map<Vec6>(&workspace_.columns[6 * active]) = by_pose.transpose() * column;
    workspace_.active[active++] = static_cast<std::uint16_t>(parameter);
  };
  for (std::size_t i = 0; i < num_offsets_[side]; ++i) {
    append(first_offset(side) + i, Eigen::Map<const Vec6>(pose_row(side, i)));
  }
  const Mat69 cross = cross_block_of(cameras_[side].refiner->views()[view]);
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    append(first_intrinsic(side) + i, cross.col(static_cast<Eigen::Index>(i)));
  }
  return active;
}

/// The equations of one pose: of a pair of views (named by its left one), or of a view by itself.
/// @return false where there are none: the view is not used, or is the right one of a pair
bool StereoRefiner::gather(std::size_t side, std::size_t view, double damping, Mat6* block, Vec6* gradient,
                           std::size_t* active) {
  const RefineView& own = cameras_[side].refiner->views()[view];
  const StereoPair* const pair = pair_of(side, view);
  if (!own.used || (pair != nullptr && side == 1)) return false;
  fill_rows(side, view);
  *block = symmetric_block(own);
  *gradient = pose_gradient_of(own);
  *active = add_columns(side, view, Mat6::Identity(), 0);
  if (pair != nullptr) {
    const RefineView& other = cameras_[1].refiner->views()[pair->right];
    fill_rows(1, pair->right);
    const Mat6 A = right_by_left();
    const Mat6 between = A.transpose() * symmetric_block(other);
    *block += between * A;
    *gradient += A.transpose() * pose_gradient_of(other);
    *active = add_columns(1, pair->right, A, *active);
    for (std::size_t i = 0; i < 6; ++i) {
      Eigen::Map<Vec6>(&workspace_.columns[6 * *active]) = between.col(static_cast<Eigen::Index>(i));
      workspace_.active[(*active)++] = static_cast<std::uint16_t>(first_between() + i);
    }
  }
  block->diagonal() *= 1 + damping;
  return true;
}

/// What a right view of a pair, whose rows were filled last, says of T_right_left by itself.
void StereoRefiner::add_between(std::size_t view) {
  const RefineView& own = cameras_[1].refiner->views()[view];
  const Mat6 block = symmetric_block(own);
  const Mat69 cross = cross_block_of(own);
  for (std::size_t i = 0; i < 6; ++i) {
    const std::size_t row = first_between() + i;
    const auto k = static_cast<Eigen::Index>(i);
    for (std::size_t j = 0; j <= i; ++j) {
      workspace_.matrix[triangle_index(row, first_between() + j)] += block(k, static_cast<Eigen::Index>(j));
    }
    for (std::size_t j = 0; j < kNumIntrinsics; ++j) {
      workspace_.matrix[triangle_index(row, first_intrinsic(1) + j)] += cross(k, static_cast<Eigen::Index>(j));
    }
    for (std::size_t j = 0; j < num_offsets_[1]; ++j) {
      workspace_.matrix[triangle_index(row, first_offset(1) + j)] += pose_row(1, j)[i];
    }
    workspace_.gradient[row] += own.pose_gradient[i];
  }
}

void StereoRefiner::add_intrinsics(std::size_t side) {
  const Refiner& refiner = *cameras_[side].refiner;
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    const std::size_t row = first_intrinsic(side) + i;
    const auto k = static_cast<Eigen::Index>(i);
    for (std::size_t j = 0; j <= i; ++j) {
      workspace_.matrix[triangle_index(row, first_intrinsic(side) + j)] +=
          refiner.intrinsic_block()(k, static_cast<Eigen::Index>(j));
    }
    workspace_.gradient[row] += refiner.intrinsic_gradient()(k);
  }
}

/// The sums of fill_rows() over all views.
void StereoRefiner::add_offsets(std::size_t side) {
  const StereoCamera& camera = cameras_[side];
  for (std::size_t i = 0; i < num_offsets_[side]; ++i) {
    const std::size_t row = first_offset(side) + i;
    const double* by_camera = nullptr;
    if (is_estimated()) {
      const EdgeOffsetWorkspace& sums = camera.offsets->workspace();
      for (std::size_t j = 0; j <= i; ++j) {
        workspace_.matrix[triangle_index(row, first_offset(side) + j)] += sums.matrix[triangle_index(i, j)];
      }
      const double precision = camera.refiner->prior_weight() / (sums.sigma[i] * sums.sigma[i]);
      workspace_.matrix[triangle_index(row, row)] += precision;
      workspace_.gradient[row] += sums.gradient[i] - precision * (sums.value[i] - camera.offsets->mean(i));
      by_camera = &sums.by_camera[kNumIntrinsics * i];
    } else {
      by_camera = camera.responses[i].gradient;
    }
    for (std::size_t k = 0; k < kNumIntrinsics; ++k) {
      workspace_.matrix[triangle_index(first_intrinsic(side) + k, row)] += by_camera[k];
    }
  }
}

/// Takes a parameter out of the equations.
void StereoRefiner::hold(std::size_t parameter) {
  for (std::size_t j = 0; j < parameter; ++j) workspace_.matrix[triangle_index(parameter, j)] = 0;
  for (std::size_t i = parameter + 1; i < size(); ++i) workspace_.matrix[triangle_index(i, parameter)] = 0;
  workspace_.matrix[triangle_index(parameter, parameter)] = 1;
  workspace_.gradient[parameter] = 0;
}

/// Takes the pose of the group that was gathered last out of the equations.
/// @return what that pose alone would take off the cost, < 0 where it is not determined
double StereoRefiner::eliminate(const Mat6& block, const Vec6& gradient, std::size_t active) {
  Cholesky<6> factor;
  if (!factor.factor(block, kMinPosePivot)) return -1;
  const Vec6 h = factor.whiten(gradient);
  for (std::size_t a = 0; a < active; ++a) {
    Eigen::Map<Vec6> column(&workspace_.columns[6 * a]);
    column = factor.whiten(Vec6(column));
    const std::size_t i = workspace_.active[a];
    workspace_.gradient[i] -= column.dot(h);
    for (std::size_t b = 0; b <= a; ++b) {
      const std::size_t j = workspace_.active[b];
      workspace_.matrix[triangle_index(std::max(i, j), std::min(i, j))] -=
          column.dot(Eigen::Map<const Vec6>(&workspace_.columns[6 * b]));
    }
  }
  return h.squaredNorm();
}

/// The shared parameters' own equations, the diagonal damped.
void StereoRefiner::build_shared(double damping) {
  for (double& value : workspace_.matrix.first(triangle_index(size(), 0))) value = 0;
  for (double& value : workspace_.gradient.first(size())) value = 0;
  clear_rows();
  for (std::size_t side = 0; side < kSides; ++side) {
    for (std::size_t v = 0; v < cameras_[side].refiner->views().size(); ++v) {
      if (!cameras_[side].refiner->views()[v].used) continue;
      fill_rows(side, v);
      if (side == 1 && pair_of(1, v) != nullptr) add_between(v);
    }
    add_intrinsics(side);
    add_offsets(side);
  }
  for (std::size_t i = 0; i < size(); ++i) workspace_.matrix[triangle_index(i, i)] *= 1 + damping;
}

/// The equations at the linearised state with all poses eliminated.
/// @param pose_decrease what the poses alone would take off the cost
/// @return false where a pose is not determined
bool StereoRefiner::build(double damping, double* pose_decrease) {
  build_shared(damping);
  *pose_decrease = 0;
  for (std::size_t side = 0; side < kSides; ++side) {
    for (std::size_t v = 0; v < cameras_[side].refiner->views().size(); ++v) {
      Mat6 block;
      Vec6 gradient;
      std::size_t active = 0;
      if (!gather(side, v, damping, &block, &gradient, &active)) continue;
      const double decrease = eliminate(block, gradient, active);
      if (decrease < 0) return false;
      *pose_decrease += decrease;
    }
  }
  for (std::size_t side = 0; side < kSides; ++side) {
    for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
      if (!cameras_[side].refiner->is_free(i)) hold(first_intrinsic(side) + i);
    }
  }
  return true;
}

/// Factors the equations, or, where offsets are not estimated, those of the other parameters alone.
bool StereoRefiner::factor_equations() {
  if (is_estimated()) return factor_packed(workspace_.matrix, size());
  const std::size_t first = first_intrinsic(0);
  for (std::size_t i = 0; i < StereoSolution::kParameters; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      workspace_.tail[triangle_index(i, j)] = workspace_.matrix[triangle_index(first + i, first + j)];
    }
  }
  return factor_packed(workspace_.tail, StereoSolution::kParameters);
}

/// Takes what stands in step for the right side. Where offsets are not estimated they stay at 0.
void StereoRefiner::solve_for_step() {
  const Span<double> step = workspace_.step.first(size());
  if (is_estimated()) {
    solve_packed(workspace_.matrix, size(), step);
    return;
  }
  const std::size_t first = first_intrinsic(0);
  for (double& value : step.first(first)) value = 0;
  solve_packed(workspace_.tail, StereoSolution::kParameters, step.subspan(first));
}

}  // namespace lecalib
