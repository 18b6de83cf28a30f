// SPDX-License-Identifier: MIT
/// Eigen's products and solvers for matrices of any size, which oracles rest on. Compiled once: every file that named
/// them itself would have them compiled anew, for longer than all the rest of it.
#pragma once

#include "lecalib/math/eigen.hpp"

namespace lecalib::test {

/// A [n x k] B [k x m].
Eigen::MatrixXd dense_product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
/// The inverse of any regular matrix [n x n].
Eigen::MatrixXd dense_inverse(const Eigen::MatrixXd& matrix);
/// The X [n x m] of A X = B, with A [n x n] symmetric and positive.
Eigen::MatrixXd dense_solve(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
/// The eigenvalues of a symmetric matrix [n x n], the smallest first.
Eigen::VectorXd dense_eigenvalues(const Eigen::MatrixXd& matrix);

}  // namespace lecalib::test
