// SPDX-License-Identifier: MIT
#include "lecalib/solve/covariance.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/cholesky.hpp"
#include "lecalib/math/jacobi_eigen.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

using RowMat9 = Eigen::Matrix<double, 9, 9, Eigen::RowMajor>;

/// With fewer degrees of freedom than this small residuals prove nothing, and the given sigmas are not narrowed.
constexpr double kMinScaleDof = 10.0;

/// Of a symmetric positive definite matrix with diagonal elements of about one size, to some percent: where other
/// eigenvalues are so near that the power iteration has not parted them, it makes little difference which one it is.
double largest_eigenvalue(const Mat9& a) {
  constexpr int kIterations = 8;
  Eigen::Index column = 0;
  a.colwise().squaredNorm().maxCoeff(&column);
  Vec9 v = a.col(column);
  double size = v.norm();
  for (int i = 0; i < kIterations; ++i) {
    v = a.lazyProduct(Vec9(v / size));
    size = v.norm();
  }
  return size;
}

/// Largest over smallest eigenvalue with a unit diagonal: held parameters (identity rows) count as 1 and do not matter.
double condition_of(const Mat9& information, const Mat9& inverse) {
  const Vec9 scale = information.diagonal().cwiseSqrt();
  const Vec9 unscale = scale.cwiseInverse();
  return largest_eigenvalue(unscale.asDiagonal() * information * unscale.asDiagonal()) *
         largest_eigenvalue(scale.asDiagonal() * inverse * scale.asDiagonal());
}

/// The first intrinsic whose information vanishes given those before it.
std::uint8_t undetermined_parameter(const Mat9& information) {
  for (Eigen::Index i = 0; i < 9; ++i) {
    if (!(information(i, i) > 0.0)) return static_cast<std::uint8_t>(i);
  }
  Vec9 values;
  Mat9 vectors;
  const Vec9 scale = information.diagonal().cwiseSqrt().cwiseInverse();
  jacobi_eigen(Mat9(scale.asDiagonal() * information * scale.asDiagonal()), &values, &vectors);
  Eigen::Index largest = 0;
  vectors.col(0).cwiseAbs().maxCoeff(&largest);
  return static_cast<std::uint8_t>(largest);
}

/// How many intrinsics the data determine: a parameter that rests on its prior costs no degree of freedom, and one
/// whose prior is not felt costs one.
double determined_parameters(const Refiner& refiner, const ParameterPolicy& policy, const Mat9& covariance) {
  const auto num_free = static_cast<double>(std::count(policy.free, policy.free + kNumIntrinsics, true));
  return num_free - refiner.prior_information().cwiseProduct(covariance).sum();  // the trace of the product
}

/// Held parameters have no covariance.
void hold(const ParameterPolicy& policy, Mat9* covariance) {
  for (Eigen::Index i = 0; i < 9; ++i) {
    if (policy.free[i]) continue;
    covariance->row(i).setZero();
    covariance->col(i).setZero();
  }
}

/// Known turns weigh as if their errors were independent. What they have in common (a gyro's bias) moves the solution
/// through all of them at once instead: (sum of shifts)(sum of shifts)' in place of the sum of shift shift'.
void correlate_turns(const Refiner& refiner, const ParameterPolicy& policy, const Cholesky<9>& factor,
                     Mat9* covariance) {
  if (refiner.num_turns() < 2) return;
  Eigen::Matrix<double, 9, 3> sum = Eigen::Matrix<double, 9, 3>::Zero();
  for (std::size_t i = 0; i < refiner.num_turns(); ++i) {
    const Eigen::Matrix<double, 9, 3> shift = factor.solve(refiner.turn_response(i));
    *covariance -= shift.lazyProduct(shift.transpose());
    sum += shift;
  }
  *covariance += sum.lazyProduct(sum.transpose());
  hold(policy, covariance);
}

}  // namespace

void take_covariance(const Mat9& covariance, const ParameterPolicy& policy, const CovarianceOptions& options,
                     CalibrationResult* result) {
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double sigma = std::sqrt(covariance(k, k));
    const bool rests_on_prior = policy.prior_sd[i] > 0.0 && sigma > options.assumed_share * policy.prior_sd[i];
    result->assumed[i] = kHasIntrinsic[static_cast<std::size_t>(policy.model)][i] &&
                         (!policy.free[i] || policy.assumed[i] || rests_on_prior);
    result->sigma[i] = sigma;
  }
  Eigen::Map<RowMat9>(result->covariance) = covariance;
}

Status compute_covariance(const Refiner& refiner, const ParameterPolicy& policy, const CovarianceOptions& options,
                          std::size_t num_views_used, Span<LineResponse> responses, CalibrationResult* result,
                          IntrinsicSpread* spread, EdgeOffsets* offsets) {
  ReducedSystem system;
  if (!refiner.reduced_system(&system)) return Status::degenerate_geometry;
  Cholesky<9> factor;
  if (!factor.factor(system.matrix)) {
    result->parameter = undetermined_parameter(system.matrix);
    return Status::degenerate_geometry;
  }
  Mat9 covariance = factor.inverse();
  const double condition = condition_of(system.matrix, covariance);
  hold(policy, &covariance);
  const double poses = 6.0 * static_cast<double>(num_views_used);
  const double unknowns =
      poses + determined_parameters(refiner, policy, covariance) - refiner.parameters_from_turns(covariance);
  const double dof = std::max(1.0, static_cast<double>(refiner.points_used()) - unknowns);
  result->chi2_per_dof = refiner.data_cost() / dof;
  const bool may_narrow = !options.trust_sigma && dof >= kMinScaleDof;
  // A scale from residuals is uncertain itself: errors over it are Student's, of variance dof / (dof - 2).
  double scale = may_narrow ? refiner.data_cost() / (dof - 2.0) : std::max(1.0, result->chi2_per_dof);
  if (offsets != nullptr) scale *= std::max(1.0, static_cast<double>(num_views_used) / options.independent_views);
  covariance *= scale;
  correlate_turns(refiner, policy, factor, &covariance);
  if (offsets != nullptr) {
    if (!offsets->add_covariance(refiner, scale, &covariance)) return Status::degenerate_geometry;
    hold(policy, &covariance);
  }
  if (spread != nullptr) {
    Eigen::Map<Mat9>(spread->inverse) = covariance / scale;
    spread->scale = scale;
  }
  if (options.line_errors.any()) {
    refiner.line_responses(responses);
    for (std::size_t r = 0; r < responses.size(); ++r) {
      Eigen::Map<Vec9> shift(responses[r].shift);
      shift = factor.solve(Vec9(Eigen::Map<const Vec9>(responses[r].gradient)));
      for (Eigen::Index i = 0; i < 9; ++i) shift(i) = policy.free[i] ? shift(i) : 0.0;
      const double size = options.line_errors.of(r);
      covariance += size * size * (shift * shift.transpose());
    }
  }
  take_covariance(covariance, policy, options, result);
  result->condition = condition;
  return Status::ok;
}

void compute_pose_covariance(const Refiner& refiner, const CovarianceOptions& options, const IntrinsicSpread& spread,
                             Span<LineResponse> responses, std::size_t view, ViewResult* result) {
  for (double& entry : result->covariance) entry = 0.0;
  Mat6 by_increment;
  if (!(spread.scale > 0.0) || !refiner.pose_covariance(view, Eigen::Map<const Mat9>(spread.inverse), spread.scale,
                                                        options.line_errors, responses, &by_increment)) {
    return;
  }
  Mat6 d_increment = Mat6::Identity();  // t' = exp(w) t + v
  d_increment.bottomLeftCorner<3, 3>() = -hat(translation_of(result->T_cam_world));
  const Mat6 half = d_increment.lazyProduct(by_increment);
  Eigen::Map<Mat6>(result->covariance) = half.lazyProduct(d_increment.transpose());
}

}  // namespace lecalib
