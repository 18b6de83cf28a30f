// SPDX-License-Identifier: MIT
#pragma once

namespace lecalib {

/// The sum of z z' over rows z of N values, N even: all of a least-squares problem's normal equations in one, where a
/// row holds the residual and the derivatives. By pairs of columns, for which processors have instructions; those that
/// have not add the same numbers one by one.
template <int N>
class Gram {
 public:
  /// Adds the row `gain` z, of its columns only the first M.
  template <int M>
  void add(double gain, const double (&z)[N]) {
    Pair pairs[kPairs];
    for (int j = 0; j < kPairs; ++j) pairs[j] = gain * Pair{z[2 * j], z[2 * j + 1]};
#ifdef __OPTIMIZE_SIZE__
    for (int i = 0; i < M; ++i) {
      const double factor = gain * z[i];
      for (int j = i / 2; j < (M + 1) / 2; ++j) sum_[i][j] += factor * pairs[j];
    }
#else
    add_rows<M>(pairs);
#endif
  }

  [[nodiscard]] double operator()(int i, int j) const { return i <= j ? sum_[i][j / 2][j % 2] : sum_[j][i / 2][i % 2]; }

 private:
  static_assert(N % 2 == 0, "columns come in pairs");
  static constexpr int kPairs = N / 2;
  using Pair = double __attribute__((vector_size(2 * sizeof(double))));

  /// The loops of add(), unrolled: the innermost work of all.
  template <int M, int I = 0>
  void add_rows(const Pair (&pairs)[kPairs]) {
    const double factor = pairs[I / 2][I % 2];
    add_pairs<(M + 1) / 2, I, I / 2>(Pair{factor, factor}, pairs);
    if constexpr (I + 1 < M) add_rows<M, I + 1>(pairs);
  }
  template <int End, int I, int J>
  void add_pairs(const Pair& factor, const Pair (&pairs)[kPairs]) {
    sum_[I][J] += factor * pairs[J];
    if constexpr (J + 1 < End) add_pairs<End, I, J + 1>(factor, pairs);
  }

  Pair sum_[N][kPairs] = {};  // upper triangle
};

}  // namespace lecalib
