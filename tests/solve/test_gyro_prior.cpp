// SPDX-License-Identifier: MIT
#include "lecalib/solve/gyro_prior.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "lecalib/math/eigen.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

template <class Rate>
std::vector<GyroSample> sampled(const Rate& rate, std::int64_t from_us, std::int64_t to_us, std::int64_t step_us) {
  std::vector<GyroSample> samples;
  for (std::int64_t t = from_us; t <= to_us; t += step_us) {
    const Vec3 w = rate(1e-6 * static_cast<double>(t));
    samples.push_back({t, {w(0), w(1), w(2)}});
  }
  return samples;
}

Mat3 turn_of(const RelativePrior& prior) { return Eigen::Map<const RowMat3>(prior.R_b_a); }

TEST_CASE("gyro prior: a constant rate turns by its time, whatever the instants between samples") {
  const Vec3 w(0.5, -1.0, 2.0);
  const auto samples = sampled([&](double) { return w; }, 0, 100000, 1000);
  for (const std::int64_t a : {std::int64_t{0}, std::int64_t{1}, std::int64_t{12345}}) {
    for (const std::int64_t length : {std::int64_t{10}, std::int64_t{990}, std::int64_t{54321}}) {
      RelativePrior prior;
      REQUIRE(integrate_gyro({}, samples, a, a + length, &prior) == Status::ok);
      const Vec3 turned = -1e-6 * static_cast<double>(length) * w;
      CHECK((turn_of(prior) - so3_exp(turned)).norm() < 1e-14);
    }
  }
}

TEST_CASE("gyro prior: a rate that changes linearly about one axis gives the exact angle") {
  const Vec3 axis = Vec3(1.0, 2.0, -2.0) / 3.0;
  const auto samples = sampled([&](double t) { return Vec3((3.0 * t + 0.2) * axis); }, 0, 200000, 5000);
  RelativePrior prior;
  REQUIRE(integrate_gyro({}, samples, 1234, 187654, &prior) == Status::ok);
  const double a = 1234e-6;
  const double b = 187654e-6;
  CHECK((so3_log(turn_of(prior)) + axis * (1.5 * (b * b - a * a) + 0.2 * (b - a))).norm() < 1e-13);
}

TEST_CASE("gyro prior: a turning axis is followed, with an error that falls by the square of the interval") {
  // R(t) = exp(-hat(z) a t) exp(-hat(x) b t) has the camera rate a z + b exp(-hat(z) a t) x.
  const double a = 3.0;
  const double b = 2.0;
  const auto rate = [&](double t) {
    return Vec3(a * Vec3(0, 0, 1) + b * (so3_exp(Vec3(0, 0, -a * t)) * Vec3(1, 0, 0)));
  };
  const auto attitude = [&](double t) { return Mat3(so3_exp(Vec3(0, 0, -a * t)) * so3_exp(Vec3(-b * t, 0, 0))); };
  double errors[2];
  for (int i = 0; i < 2; ++i) {
    const auto samples = sampled(rate, 0, 400000, i == 0 ? 10000 : 5000);
    RelativePrior prior;
    REQUIRE(integrate_gyro({}, samples, 20000, 380000, &prior) == Status::ok);
    errors[i] = (turn_of(prior) - attitude(0.38) * attitude(0.02).transpose()).norm();
  }
  CHECK(errors[0] < 2e-4);
  CHECK(errors[1] < 0.3 * errors[0]);
}

TEST_CASE("gyro prior: sigma is that of white noise and of a bias") {
  const auto samples = sampled([](double) { return Vec3::Zero().eval(); }, 0, 400000, 1000);
  GyroOptions options;
  options.noise_density = 2e-3;
  options.bias_sigma = 0.01;
  RelativePrior prior;
  REQUIRE(integrate_gyro(options, samples, 0, 250000, &prior) == Status::ok);
  CHECK(prior.sigma_rad == doctest::Approx(std::sqrt(4e-6 * 0.25 + 1e-4 * 0.0625)).epsilon(1e-12));
  CHECK(prior.shared_rad == doctest::Approx(0.0025).epsilon(1e-12));
}

TEST_CASE("gyro prior: what the samples do not cover is not told") {
  std::vector<GyroSample> samples = sampled([](double) { return Vec3(1, 0, 0); }, 1000, 50000, 1000);
  RelativePrior prior;
  CHECK(integrate_gyro({}, samples, 1000, 50000, &prior) == Status::ok);
  prior.sigma_rad = 7.0;
  CHECK(integrate_gyro({}, samples, 999, 5000, &prior) == Status::need_more_data);
  CHECK(integrate_gyro({}, samples, 2000, 50001, &prior) == Status::need_more_data);
  CHECK(integrate_gyro({}, samples, 60000, 70000, &prior) == Status::need_more_data);
  CHECK(integrate_gyro({}, {}, 1000, 2000, &prior) == Status::need_more_data);
  CHECK(integrate_gyro({}, samples, 2000, 2000, &prior) == Status::invalid_argument);
  GyroOptions options;
  options.max_gap_us = 0;
  CHECK(integrate_gyro(options, samples, 2000, 3000, &prior) == Status::invalid_argument);
  samples.erase(samples.begin() + 10, samples.begin() + 35);  // a gap of 26 ms
  CHECK(integrate_gyro({}, samples, 2000, 45000, &prior) == Status::need_more_data);
  CHECK(integrate_gyro({}, samples, 2000, 9000, &prior) == Status::ok);
  constexpr std::int64_t kFar = 9'200'000'000'000'000'000;
  const GyroSample far_apart[] = {{-kFar, {1, 0, 0}}, {kFar, {1, 0, 0}}};
  CHECK(integrate_gyro({}, far_apart, 0, 1000, &prior) == Status::need_more_data);
  std::swap(samples[3], samples[4]);
  CHECK(integrate_gyro({}, samples, 2000, 9000, &prior) == Status::invalid_argument);
}

}  // namespace
}  // namespace lecalib
