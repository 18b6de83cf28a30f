// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace lecalib {

/// Seeded generator with the same sequence on every target: PCG32 (O'Neill 2014), XSH-RR output.
/// Draw one value per statement: the order of evaluation inside an argument list is not defined.
class Rng {
 public:
  constexpr explicit Rng(std::uint64_t seed) noexcept {
    next();
    state_ += seed;
    next();
  }

  /// Uniform over all 32-bit values.
  constexpr std::uint32_t next() noexcept {
    const std::uint64_t old = state_;
    state_ = old * 6364136223846793005ULL + 1442695040888963407ULL;
    const auto shifted = static_cast<std::uint32_t>(((old >> 18U) ^ old) >> 27U);
    const auto rotation = static_cast<std::uint32_t>(old >> 59U);
    return (shifted >> rotation) | (shifted << ((32U - rotation) & 31U));
  }

  /// Uniform integer in [0, bound), bound > 0. Bias below bound / 2^32.
  constexpr std::uint32_t below(std::uint32_t bound) noexcept {
    return static_cast<std::uint32_t>((static_cast<std::uint64_t>(next()) * bound) >> 32U);
  }

  /// Uniform in [0, 1), 32 random bits.
  constexpr double uniform() noexcept { return static_cast<double>(next()) * (1.0 / 4294967296.0); }
  constexpr double uniform(double low, double high) noexcept { return low + (high - low) * uniform(); }

 private:
  std::uint64_t state_ = 0;
};

}  // namespace lecalib
