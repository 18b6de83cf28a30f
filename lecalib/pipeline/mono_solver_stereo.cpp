// SPDX-License-Identifier: MIT
/// What a refinement of two cameras takes from each and gives back: a part of MonoSolver.
#include "lecalib/pipeline/mono_solver.hpp"

namespace lecalib {

StereoCamera MonoSolver::stereo_camera() {
  StereoCamera camera;
  camera.refiner = &refiner_;
  camera.responses = workspace_.responses.first(kLineErrors * data_.model.size());
  if (!has_edges()) return camera;
  camera.offsets = &offsets_;
  camera.corrected = workspace_.corrected;
  return camera;
}

void MonoSolver::take_stereo(const StereoSolution& solution, std::size_t side) {
  constexpr auto kAll = static_cast<Eigen::Index>(StereoSolution::kParameters);
  const Eigen::Map<const Eigen::Matrix<double, kAll, kAll, Eigen::RowMajor>> all(solution.covariance);
  const auto first = static_cast<Eigen::Index>(kNumIntrinsics * side);
  const Mat9 covariance = all.block<9, 9>(first, first);
  summarise(&result_);
  result_.chi2_per_dof = solution.chi2_per_dof;
  take_covariance(covariance, policy_, options_.covariance, &result_);
  Eigen::Map<Mat9>(spread_.inverse) = covariance / solution.scale;
  spread_.scale = solution.scale;
  summarise_views(&result_);
}

}  // namespace lecalib
