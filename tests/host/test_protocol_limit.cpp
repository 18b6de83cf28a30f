// SPDX-License-Identifier: MIT
#include "lecalib/host/protocol_limit.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>

#include "lecalib/core/rng.hpp"
#include "lecalib/host/protocol_errors.hpp"
#include "lecalib/math/camera_model.hpp"
#include "lecalib/math/so3.hpp"
#include "support/dense_algebra.hpp"
#include "support/numeric_jacobian.hpp"
#include "support/synthetic_views.hpp"

using namespace lecalib;
using namespace lecalib::host;

namespace {

using Row12 = Eigen::Matrix<double, 1, kTrialParameters>;
using Scalar = Eigen::Matrix<double, 1, 1>;

/// Distance of a pixel, un-distorted, from the ideal image of a model line, in normalised coordinates.
Scalar ideal_distance(const Camera& camera, const Pose& pose, const ModelLine& line, const Vec2& pixel) {
  const Vec3 p = rotation_of(pose) * Vec3(line.p) + translation_of(pose);
  const Vec3 q = rotation_of(pose) * Vec3(line.q) + translation_of(pose);
  const Vec3 image = p.cross(q);
  Vec2 ideal;
  REQUIRE(unproject(camera, pixel, &ideal));
  return Scalar(image.dot(Vec3(ideal(0), ideal(1), 1)) / image.head<2>().norm());
}

/// Rows: what a parameter moves the end point's distance by, px in the distorted image. The residual vanishes at the
/// truth, so that its scale need not be derived.
Row12 numeric_row(const Trial& trial, const ModelLine& line, const Vec2& pixel) {
  // Steps of a thousandth of what each parameter is.
  TrialVector scale;
  scale << 100, 100, 100, 100, 0.1, 0.1, 0.1, 0.1, 0.1, 1, 1, 1;
  const auto of_parameters = [&](const TrialVector& scaled) {
    Camera camera;
    Pose pose;
    displace(trial, scale.cwiseProduct(scaled), &camera, &pose);
    return ideal_distance(camera, pose, line, pixel);
  };
  const auto of_pixel = [&](const Vec2& at) { return ideal_distance(trial.camera, trial.T_cam_world, line, at); };
  const Row12 row = test::numeric_jacobian<1, kTrialParameters>(of_parameters, TrialVector(TrialVector::Zero()));
  const auto by_pixel = test::numeric_jacobian<1, 2>(of_pixel, pixel, 1e-2);
  return row.cwiseQuotient(scale.transpose()) / by_pixel.norm();
}

/// Fresh noise on the same scene.
void redraw_noise(double sigma_px, Rng* rng, Trial* trial) {
  for (std::size_t i = 0; i < trial->points.size(); ++i) {
    const double du = sigma_px * test::gaussian(*rng);
    const double dv = sigma_px * test::gaussian(*rng);
    trial->points[i].u_px = trial->exact_px[i](0) + du;
    trial->points[i].v_px = trial->exact_px[i](1) + dv;
  }
}

}  // namespace

TEST_CASE("protocol limit: the covariance is that of a numerical Jacobian of un-distorted distances") {
  for (const Protocol protocol : {Protocol::scripts, Protocol::physical}) {
    const Trial trial = draw_trial(default_trial(protocol), 11);
    for (const std::vector<ModelLine>* model : {&trial.planar, &trial.spatial}) {
      TrialMatrix information = TrialMatrix::Zero();
      for (std::size_t i = 0; i < trial.points.size(); ++i) {
        const Row12 row = numeric_row(trial, (*model)[i / 2], trial.exact_px[i]);
        information += row.transpose() * row;
      }
      const TrialMatrix expected = test::dense_inverse(information);
      TrialLimit limit;
      REQUIRE(find_limit(trial, *model, &limit));
      const TrialVector sigma = expected.diagonal().cwiseSqrt();
      const TrialMatrix difference = limit.covariance - expected;
      for (int r = 0; r < kTrialParameters; ++r) {
        for (int c = 0; c < kTrialParameters; ++c) CHECK(std::abs(difference(r, c)) < 1e-4 * sigma(r) * sigma(c));
      }
    }
  }
}

TEST_CASE("protocol limit: over many draws of the noise, errors scatter as the covariance says and have no mean") {
  constexpr int kDraws = 2000;
  constexpr double kSigma = 0.5;
  Rng rng(2);
  Trial trial = draw_trial(default_trial(Protocol::text), 12);
  TrialLimit limit;
  TrialVector sum = TrialVector::Zero();
  TrialVector squares = TrialVector::Zero();
  for (int i = 0; i < kDraws; ++i) {
    redraw_noise(kSigma, &rng, &trial);
    REQUIRE(find_limit(trial, trial.spatial, &limit));
    sum += limit.error;
    squares += limit.error.cwiseProduct(limit.error);
  }
  for (int k = 0; k < kTrialParameters; ++k) {
    const double sigma = kSigma * std::sqrt(limit.covariance(k, k));
    CHECK(std::abs(sum(k) / kDraws) < 4 * sigma / std::sqrt(1.0 * kDraws));
    CHECK(std::sqrt(squares(k) / kDraws) == doctest::Approx(sigma).epsilon(0.07));
  }
}

TEST_CASE("protocol limit: small errors of the parameters that explain the noise are found exactly") {
  // Points moved as a slightly different camera would see them: the error is that camera, to first order.
  Trial trial = draw_trial(default_trial(Protocol::physical), 13);
  TrialVector error;
  error << 2, -1, 1, 0.5, 1e-3, 2e-3, 1e-3, -2e-3, 1e-3, 2e-3, 1e-3, -3e-3;
  error *= 1e-4;
  Camera camera;
  Pose pose;
  displace(trial, error, &camera, &pose);
  for (std::size_t i = 0; i < trial.points.size(); ++i) {
    const ModelLine& line = trial.spatial[i / 2];
    const Vec3 world = i % 2 == 0 ? Vec3(line.p) : Vec3(line.q);
    Vec2 pixel;
    REQUIRE(project(camera, rotation_of(pose) * world + translation_of(pose), &pixel));
    trial.points[i].u_px = pixel(0);
    trial.points[i].v_px = pixel(1);
  }
  TrialLimit limit;
  REQUIRE(find_limit(trial, trial.spatial, &limit));
  for (int k = 0; k < kTrialParameters; ++k) CHECK(std::abs(limit.error(k) - error(k)) < 1e-3 * std::abs(error(k)));
}

TEST_CASE("protocol limit: the mean of the scripts' noise is no part of it") {
  TrialOptions options = default_trial(Protocol::scripts);
  const Trial trial = draw_trial(options, 14);
  Trial centred = trial;
  for (LinePoint& point : centred.points) {
    point.u_px -= 0.5;
    point.v_px -= 0.5;
  }
  centred.noise_mean_px = 0;
  TrialLimit limit;
  TrialLimit limit_centred;
  REQUIRE(find_limit(trial, trial.planar, &limit));
  REQUIRE(find_limit(centred, trial.planar, &limit_centred));
  CHECK((limit.error - limit_centred.error).norm() < 1e-9);
}

TEST_CASE("protocol limit: fewer than twelve end points determine no twelve parameters") {
  TrialOptions options = default_trial(Protocol::text);
  options.lines = 5;
  const Trial trial = draw_trial(options, 15);
  TrialLimit limit;
  CHECK_FALSE(find_limit(trial, trial.spatial, &limit));
  options.lines = 6;
  const Trial enough = draw_trial(options, 15);
  CHECK(find_limit(enough, enough.spatial, &limit));
}
