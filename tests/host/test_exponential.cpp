// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>

#include "lecalib/core/rng.hpp"
#include "lecalib/host/exponential.hpp"

using lecalib::host::exponential;
using lecalib::host::logarithm;

TEST_CASE("exponential, logarithm: agree with the C library") {
  lecalib::Rng rng(4);
  for (int i = 0; i < 20000; ++i) {
    const double x = rng.uniform(-700, 700);
    CHECK(std::abs(exponential(x) / std::exp(x) - 1.0) < 1e-14);
    const double y = std::exp(rng.uniform(-700, 700));
    CHECK(std::abs(logarithm(y) - std::log(y)) < 1e-15 + 2.3e-16 * std::abs(std::log(y)));
  }
  CHECK(exponential(0) == 1.0);
  CHECK(logarithm(1) == 0.0);
}
