// SPDX-License-Identifier: MIT
#include "lecalib/math/robust_loss.hpp"

#include <doctest/doctest.h>

#include <initializer_list>

namespace lecalib {
namespace {

TEST_CASE("the weight is the derivative of rho, and small residuals count in full") {
  for (const Loss loss : {Loss::squared, Loss::huber, Loss::geman}) {
    for (const double s : {0.01, 0.5, 3.9, 4.1, 30.0, 1e4}) {
      const double h = 1e-6 * s;
      const double slope = (evaluate_loss(loss, 2.0, s + h).rho - evaluate_loss(loss, 2.0, s - h).rho) / (2.0 * h);
      CHECK(evaluate_loss(loss, 2.0, s).weight == doctest::Approx(slope).epsilon(1e-6));
    }
    CHECK(evaluate_loss(loss, 2.0, 0.0).rho == 0.0);
    CHECK(evaluate_loss(loss, 2.0, 0.0).weight == 1.0);
  }
}

TEST_CASE("beyond the width Huber is linear and Geman-McClure bounded") {
  CHECK(evaluate_loss(Loss::huber, 2.0, 100.0).rho == doctest::Approx(2.0 * 2.0 * 10.0 - 4.0));
  CHECK(evaluate_loss(Loss::huber, 2.0, 3.9).rho == 3.9);
  CHECK(evaluate_loss(Loss::geman, 2.0, 1e12).rho < 4.0 + 1e-9);
}

}  // namespace
}  // namespace lecalib
