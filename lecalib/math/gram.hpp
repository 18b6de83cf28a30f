// SPDX-License-Identifier: MIT
#pragma once

namespace lecalib {

/// The sum of z z' over rows z: all of a least-squares problem's normal equations in one, where a row holds the
/// derivatives and the residual. By pairs of columns, for which processors have instructions; those that have not add
/// the same numbers one by one.
template <int N>
class Gram {
 public:
  static constexpr int kSize = (N + 1) / 2 * 2;

  /// @param z N values, 0 behind them
  void add(const double (&z)[kSize]) {
    Pair pairs[kPairs];
    for (int j = 0; j < kPairs; ++j) pairs[j] = Pair{z[2 * j], z[2 * j + 1]};
    add_row<0>(z, pairs);
  }

  [[nodiscard]] double operator()(int i, int j) const { return i <= j ? sum_[i][j / 2][j % 2] : sum_[j][i / 2][i % 2]; }

 private:
  static constexpr int kPairs = kSize / 2;
  using Pair = double __attribute__((vector_size(2 * sizeof(double))));

  /// Row I from the diagonal's pair on, unrolled: the innermost work of all.
  template <int I>
  void add_row(const double (&z)[kSize], const Pair (&pairs)[kPairs]) {
    const Pair factor = {z[I], z[I]};
    add_pairs<I, I / 2>(factor, pairs);
    if constexpr (I + 1 < N) add_row<I + 1>(z, pairs);
  }
  template <int I, int J>
  void add_pairs(const Pair& factor, const Pair (&pairs)[kPairs]) {
    sum_[I][J] += factor * pairs[J];
    if constexpr (J + 1 < kPairs) add_pairs<I, J + 1>(factor, pairs);
  }

  Pair sum_[N][kPairs] = {};  // upper triangle
};

}  // namespace lecalib
