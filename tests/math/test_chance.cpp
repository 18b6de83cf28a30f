// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>
#include <limits>

#include "lecalib/math/chance.hpp"

using namespace lecalib;

TEST_CASE("chance: the logarithm agrees with the C library's, from the smallest normal number to the largest") {
  for (double x = 1.2e-38; x < 3e38; x *= 1.0137) {
    const auto single = static_cast<float>(x);
    const double expected = std::log(static_cast<double>(single));
    CHECK(std::fabs(static_cast<double>(natural_log(single)) - expected) <= 3e-7 + 1e-6 * std::fabs(expected));
  }
  CHECK(natural_log(1) == 0);
  CHECK(natural_log(0) == natural_log(-3));
  CHECK(natural_log(0) < -87);
  CHECK(natural_log(std::numeric_limits<float>::quiet_NaN()) == natural_log(0));
  CHECK(natural_log(std::numeric_limits<float>::infinity()) == doctest::Approx(128 * std::log(2.0)));
}

TEST_CASE("chance: evidence bounds the tail of Poisson's distribution") {
  for (const double mean : {0.2, 1.0, 4.0, 30.0}) {
    for (int events = 1; events < 120; events += 3) {
      double term = std::exp(-mean);  // of exactly k events
      double below = 0;
      for (int k = 0; k < events; ++k) {
        below += term;
        term *= mean / (k + 1);
      }
      double tail = 0;
      for (int k = events; k < events + 300; ++k) {
        tail += term;
        term *= mean / (k + 1);
      }
      const float evidence = evidence_against_chance(static_cast<float>(events), static_cast<float>(mean));
      CHECK(std::exp(-static_cast<double>(evidence)) >= tail * (1 - 1e-4));
      CHECK(below + tail == doctest::Approx(1));
    }
  }
  CHECK(evidence_against_chance(3, 3) == 0);
  CHECK(evidence_against_chance(0, 0) == 0);
  CHECK(evidence_against_chance(25, 0) == evidence_against_chance(25, 0.1F));
}
