// SPDX-License-Identifier: MIT
#include "lecalib/math/distortion_fit.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "lecalib/math/radial_curve.hpp"

namespace lecalib {
namespace {

Camera make_lens(DistortionModel model, double k1, double k2 = 0) {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 400.0;
  camera.cx = 300.0;
  camera.cy = 250.0;
  camera.model = model;
  camera.k1 = k1;
  camera.k2 = k2;
  return camera;
}

TEST_CASE("distortion fit: the image's radius is that of its farthest corner") {
  const Camera camera = make_lens(DistortionModel::brown, 0.0);
  CHECK(image_radius(camera) == doctest::Approx(std::sqrt(339.0 * 339.0 + 250.0 * 250.0) / 400.0).epsilon(1e-15));
}

TEST_CASE("distortion fit: between any two models ordinary lenses agree to two pixels over the image") {
  const Camera lenses[] = {make_lens(DistortionModel::brown, -0.15, 0.03),
                           make_lens(DistortionModel::polynomial, 0.15, 0.02),
                           make_lens(DistortionModel::division, -0.15)};
  for (const Camera& lens : lenses) {
    const double radius = image_radius(lens);
    for (std::size_t m = 0; m < kNumDistortionModels; ++m) {
      const auto model = static_cast<DistortionModel>(m);
      const Camera other = in_model(lens, model, radius, 3);
      CHECK(other.model == model);
      CHECK(other.fx == lens.fx);
      CHECK(largest_difference_px(lens, other, radius) < 2.0);
      const Camera back = in_model(other, lens.model, radius, 2);
      CHECK(std::abs(back.k1 - lens.k1) < 0.02);
    }
  }
}

TEST_CASE("distortion fit: what one model says exactly comes out exactly, and no distortion stays none") {
  // Brown's and the polynomial's identity; the division's curve out to a small radius.
  for (std::size_t m = 0; m < kNumDistortionModels; ++m) {
    const Camera none = in_model(make_lens(DistortionModel::brown, 0.0), static_cast<DistortionModel>(m), 1.0, 2);
    CHECK(std::abs(none.k1) < 1e-13);
    CHECK(std::abs(none.k2) < 1e-13);
  }
  const Camera division = make_lens(DistortionModel::division, -0.2);
  CHECK(in_model(division, DistortionModel::brown, 0.01, 1).k1 == doctest::Approx(-0.2).epsilon(1e-3));
  CHECK(in_model(division, DistortionModel::polynomial, 0.01, 1).k1 == doctest::Approx(0.2).epsilon(1e-3));
}

TEST_CASE("distortion fit: the least squares are least against brute force") {
  const Camera lens = make_lens(DistortionModel::division, -0.3);
  const double radius = image_radius(lens);
  const auto squares = [&](const Camera& other) {
    double sum = 0.0;
    for (int i = 0; i < 2000; ++i) {
      const double r_d = radius * (i + 0.5) / 2000.0;
      const double r = r_d / (1.0 + lens.k1 * r_d * r_d);
      const double error = r * radial_at(other, r * r).value - r_d;
      sum += r_d * error * error;
    }
    return sum;
  };
  const Camera found = in_model(lens, DistortionModel::brown, radius, 2);
  for (const double dk1 : {-2e-3, 0.0, 2e-3}) {
    for (const double dk2 : {-2e-3, 0.0, 2e-3}) {
      Camera other = found;
      other.k1 += dk1;
      other.k2 += dk2;
      CHECK(squares(other) >= squares(found) * 0.999);
    }
  }
}

TEST_CASE("distortion fit: a lens whose image ends inside of the sensor is fitted as far as it goes") {
  const Camera lens = make_lens(DistortionModel::division, -1.5);  // nothing beyond r_d = 0.82, the corner is at 1.05
  const Camera brown = in_model(lens, DistortionModel::brown, image_radius(lens), 3);
  CHECK(std::isfinite(brown.k1));
  CHECK(std::isfinite(brown.k3));
}

}  // namespace
}  // namespace lecalib
