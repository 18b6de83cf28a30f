// SPDX-License-Identifier: MIT
/// The linear system of the direct linear transformation from lines, for models of two or three dimensions.
#pragma once

#include <cmath>

#include "lecalib/math/cholesky.hpp"
#include "lecalib/math/eigen.hpp"
#include "lecalib/math/smallest_eigenvector.hpp"

namespace lecalib {

/// Isotropic normalisation x' = scale (x - centre): centroid at the origin, mean distance sqrt(D). Fed in two passes.
template <int D>
class Normaliser {
 public:
  using Point = Eigen::Matrix<double, D, 1>;
  using Matrix = Eigen::Matrix<double, D + 1, D + 1>;

  void add_to_centre(const Point& x) {
    centre_ += x;
    ++count_;
  }
  void finish_centre() { centre_ /= static_cast<double>(count_); }
  void add_to_scale(const Point& x) { distance_ += (x - centre_).norm(); }
  /// @return false where all points coincide or one is not finite
  bool finish_scale() {
    if (!(distance_ > 0.0) || !std::isfinite(distance_)) return false;
    scale_ = std::sqrt(static_cast<double>(D)) * static_cast<double>(count_) / distance_;
    return true;
  }

  [[nodiscard]] Point apply(const Point& x) const { return scale_ * (x - centre_); }
  [[nodiscard]] Matrix matrix() const {
    Matrix T = Matrix::Identity();
    T.template topLeftCorner<D, D>() *= scale_;
    T.template topRightCorner<D, 1>() = -scale_ * centre_;
    return T;
  }
  [[nodiscard]] Matrix inverse() const {
    Matrix T = Matrix::Identity();
    T.template topLeftCorner<D, D>() /= scale_;
    T.template topRightCorner<D, 1>() = centre_;
    return T;
  }

 private:
  Point centre_ = Point::Zero();
  double distance_ = 0.0;
  double scale_ = 1.0;
  int count_ = 0;
};

/// Least squares for M (3 x (D + 1)) with l . M (P, 1) = 0 for points P of model lines with image l ([Liu24] eq. 3 to
/// 5): with A = [B C], C the columns of M's last one, that is eliminated (it is what fits best given the rest), and the
/// rest is the eigenvector of the smallest eigenvalue of B'B - B'C inv(C'C) C'B. A third fewer unknowns than A'A has,
/// and a scale that does not depend on where the origin lies. All in normalised coordinates.
template <int D>
class DltSystem {
 public:
  static constexpr int kSize = 3 * (D + 1);
  using Point = Eigen::Matrix<double, D, 1>;
  using Projection = Eigen::Matrix<double, 3, D + 1>;

  /// Adds both points of a model line; `l` has a unit normal.
  void add(const Vec3& l, const Point& p, const Point& q) {
    double ends[2][D + 1];
    for (int i = 0; i < D; ++i) {
      ends[0][i] = p(i);
      ends[1][i] = q(i);
    }
    ends[0][D] = ends[1][D] = 1.0;
    const double ll[6] = {l(0) * l(0), l(0) * l(1), l(0) * l(2), l(1) * l(1), l(1) * l(2), l(2) * l(2)};
    double* sum = sums_;
    for (int i = 0; i <= D; ++i) {
      for (int j = i; j <= D; ++j, sum += 6) {
        const double weight = ends[0][i] * ends[0][j] + ends[1][i] * ends[1][j];
        for (int k = 0; k < 6; ++k) sum[k] += weight * ll[k];
      }
    }
  }

  /// @return false, *M unchanged, where all image lines meet in one point, or where a second direction is as good as
  /// the smallest: M is then not unique
  bool solve(Projection* M) {
    constexpr int kRest = 3 * D;
    const Eigen::Matrix<double, kSize, kSize> AtA = matrix();
    Cholesky<3> last;
    if (!last.factor(AtA.template bottomRightCorner<3, 3>(), kMinEigenRatio)) return false;
    const Eigen::Matrix<double, kRest, 3> cross = AtA.template topRightCorner<kRest, 3>();
    const Eigen::Matrix<double, 3, kRest> fitted = last.solve(Eigen::Matrix<double, 3, kRest>(cross.transpose()));
    const Eigen::Matrix<double, kRest, kRest> reduced =
        AtA.template topLeftCorner<kRest, kRest>() - cross.lazyProduct(fitted);
    Eigen::Matrix<double, kRest, 1> rest;
    if (!smallest_eigenvector(reduced, kMinEigenRatio, &rest)) return false;
    M->template leftCols<D>() = Eigen::Map<const Eigen::Matrix<double, 3, D>>(rest.data());
    M->col(D) = -(fitted.lazyProduct(rest));
    return true;
  }

 private:
  /// Rounding leaves about 1e-16; what noise of 1e-3 px leaves of a degenerate direction is below 1e-12.
  static constexpr double kMinEigenRatio = 1e-12;

  [[nodiscard]] Eigen::Matrix<double, kSize, kSize> matrix() const {
    constexpr int kEntry[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    Eigen::Matrix<double, kSize, kSize> AtA;
    const double* sum = sums_;
    for (int i = 0; i <= D; ++i) {
      for (int j = i; j <= D; ++j, sum += 6) {
        for (int a = 0; a < 3; ++a) {
          for (int b = 0; b < 3; ++b) AtA(3 * i + a, 3 * j + b) = AtA(3 * j + a, 3 * i + b) = sum[kEntry[a][b]];
        }
      }
    }
    return AtA;
  }

  /// A row of A is (P, 1) (x) l, so A'A consists of 3 x 3 blocks, one for each two coordinates of (P, 1) and each a sum
  /// of multiples of l l', of which six entries differ.
  double sums_[6 * (D + 1) * (D + 2) / 2] = {};
};

}  // namespace lecalib
