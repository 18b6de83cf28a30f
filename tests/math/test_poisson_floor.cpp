// SPDX-License-Identifier: MIT
#include "lecalib/math/poisson_floor.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "lecalib/core/rng.hpp"

using namespace lecalib;

namespace {

constexpr std::size_t kBins = 128;
constexpr float kQuietShare = 0.4F;

/// A draw from Poisson's distribution, by Knuth's product of uniform numbers.
std::uint32_t draw(double mean, Rng* rng) {
  const double limit = std::exp(-mean);
  double product = rng->uniform();
  std::uint32_t count = 0;
  for (; product > limit; product *= rng->uniform()) ++count;
  return count;
}

/// Cells of noise; a share of them holds an edge too, which adds 5 to 60 events.
std::vector<std::uint32_t> histogram_of(double mean, double edge_share, std::size_t cells, std::uint64_t seed) {
  Rng rng(seed);
  std::vector<std::uint32_t> histogram(kBins);
  for (std::size_t c = 0; c < cells; ++c) {
    std::size_t count = draw(mean, &rng);
    if (static_cast<double>(c) < edge_share * static_cast<double>(cells)) count += 5 + rng.below(56);
    ++histogram[std::min(count, kBins - 1)];
  }
  return histogram;
}

double floor_of(const std::vector<std::uint32_t>& histogram) {
  return static_cast<double>(poisson_floor({histogram.data(), histogram.size()}, kQuietShare));
}

}  // namespace

TEST_CASE("Poisson floor: the mean of noise alone, within four standard errors of its count") {
  constexpr std::size_t kCells = 1376;  // whole ones of 346 x 260
  for (const double mean : {0.05, 0.2, 0.5, 0.9, 1.0, 1.9, 3.3, 7.0, 20.0, 60.0}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      CAPTURE(mean);
      CAPTURE(seed);
      // What lies above the quantile is only counted: up to twice the standard error of the plain mean.
      const double error = 2 * std::sqrt(mean / static_cast<double>(kCells));
      CHECK(std::fabs(floor_of(histogram_of(mean, 0, kCells, seed)) - mean) < 4 * error);
    }
  }
}

TEST_CASE("Poisson floor: edges in up to half of the cells move it by less than a fifth, or .1 events per cell") {
  constexpr std::size_t kCells = 14400;  // of 1280 x 720
  for (const double mean : {0.05, 0.2, 0.5, 0.9, 1.0, 1.9, 3.3, 7.0, 20.0}) {
    for (const double edge_share : {0.0, 0.3, 0.5}) {
      CAPTURE(mean);
      CAPTURE(edge_share);
      const double found = floor_of(histogram_of(mean, edge_share, kCells, 5));
      CHECK(std::fabs(found - mean) < std::max(0.1, 0.2 * mean));
    }
  }
}

TEST_CASE("Poisson floor: exact frequencies give the mean, whatever the share of other counts") {
  for (const double mean : {0.01, 0.3, 1.0, 2.5, 12.0, 40.0}) {
    for (const double others : {0.0, 0.2, 0.5}) {
      std::vector<std::uint32_t> histogram(kBins);
      double term = (1 - others) * 1e9 * std::exp(-mean);
      for (std::size_t k = 0; k < kBins; ++k) {
        histogram[k] = static_cast<std::uint32_t>(term + 0.5);
        term *= mean / static_cast<double>(k + 1);
      }
      histogram[kBins - 1] += static_cast<std::uint32_t>(others * 1e9);
      CAPTURE(mean);
      CAPTURE(others);
      CHECK(floor_of(histogram) == doctest::Approx(mean).epsilon(2e-3));
    }
  }
}

TEST_CASE("Poisson floor: counts that no distribution fits give an end of its range") {
  std::vector<std::uint32_t> histogram(kBins);
  CHECK(floor_of(histogram) == 0);
  histogram[0] = 5000;
  CHECK(floor_of(histogram) == 0);
  histogram = std::vector<std::uint32_t>(kBins);
  histogram[kBins - 1] = 5000;
  CHECK(floor_of(histogram) == 2 * (kBins - 1));
  histogram[0] = 5000;  // silence, and edges elsewhere
  CHECK(floor_of(histogram) < 1e-4);
}
