// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cstdint>
#include <initializer_list>

#include "lecalib/core/rng.hpp"

using lecalib::Rng;

namespace {

constexpr std::uint32_t first_of(std::uint64_t seed) {
  Rng rng(seed);
  return rng.next();
}

static_assert(first_of(42) == 0xc2f57bd6U, "the same sequence at compile time");

}  // namespace

TEST_CASE("rng: the sequence is that of the reference generator (pcg32_oneseq, seed 42)") {
  Rng rng(42);
  for (const std::uint32_t expected : {0xc2f57bd6U, 0x6b07c4a9U, 0x72b7b29bU, 0x44215383U}) {
    CHECK(rng.next() == expected);
  }
  CHECK(first_of(0) == 0xe823a24eU);
  CHECK(first_of(~std::uint64_t{0}) == 0xd9313036U);
}

TEST_CASE("rng: derived draws are golden too") {
  Rng integers(42);
  for (const std::uint32_t expected : {7U, 4U, 4U, 2U, 9U, 4U, 7U, 8U}) CHECK(integers.below(10) == expected);
  Rng reals(42);
  CHECK(reals.uniform() == 0.7615582845173776);
  CHECK(reals.uniform() == 0.41808728338219225);
  Rng scaled(42);
  CHECK(scaled.uniform(-2.0, 2.0) == -2.0 + 4.0 * 0.7615582845173776);
}

TEST_CASE("rng: integers stay below their bound and fill it evenly") {
  constexpr std::uint32_t kBound = 7;
  constexpr int kDraws = 70000;
  int seen[kBound] = {};
  Rng rng(1);
  for (int i = 0; i < kDraws; ++i) {
    const std::uint32_t value = rng.below(kBound);
    REQUIRE(value < kBound);
    ++seen[value];
  }
  // Mean 10000, one sigma 92.6: five of them.
  for (const int count : seen) CHECK(count > 10000 - 463);
  for (const int count : seen) CHECK(count < 10000 + 463);
  CHECK(rng.below(1) == 0);
}

TEST_CASE("rng: reals lie from 0 to below 1 with the mean and variance of the uniform distribution") {
  constexpr int kDraws = 100000;
  double sum = 0.0;
  double squares = 0.0;
  Rng rng(2);
  for (int i = 0; i < kDraws; ++i) {
    const double value = rng.uniform();
    REQUIRE(value >= 0.0);
    REQUIRE(value < 1.0);
    sum += value;
    squares += value * value;
  }
  const double mean = sum / kDraws;
  CHECK(mean == doctest::Approx(0.5).epsilon(0.005));
  CHECK(squares / kDraws - mean * mean == doctest::Approx(1.0 / 12.0).epsilon(0.01));
}
