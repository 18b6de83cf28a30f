// SPDX-License-Identifier: MIT
#include "lecalib/solve/view_lines.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "lecalib/math/plane_homography.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

struct Fitted {
  std::vector<ViewLine> lines;
};

Fitted fit(const std::vector<ModelLine>& model, const std::vector<LinePoint>& points, const Straightening& s) {
  const View view{0, 0, static_cast<std::uint32_t>(points.size())};
  const CalibrationData data{640, 480, model, points, {&view, 1}};
  std::vector<LineSums> moments(model.size());
  Fitted fitted;
  fitted.lines.resize(model.size());
  std::size_t count = 0;
  fit_view_lines(data, view, s, moments, fitted.lines, &count);
  fitted.lines.resize(count);
  return fitted;
}

const Straightening kNone{319.5, 239.5, 400.0, 0.0};

TEST_CASE("points on a line give that line with their extent, in any order and mixed with other lines") {
  const std::vector<ModelLine> model(3, test::make_line(Vec3::Zero(), Vec3::UnitX()));
  std::vector<LinePoint> points;
  for (const double x : {200.0, 100.0, 300.0, 160.0}) {
    points.push_back({x, 2.0 * x + 5.0, 1.0, 2});
    points.push_back({50.0, x, 1.0, 0});
  }
  points.push_back({9.0, 9.0, 1.0, 1});  // one point makes no line
  const Fitted f = fit(model, points, kNone);
  REQUIRE(f.lines.size() == 2);
  CHECK(f.lines[0].model_line == 0);
  CHECK(f.lines[1].model_line == 2);
  for (const double* end : {f.lines[1].image_p, f.lines[1].image_q}) {
    CHECK(end[1] == doctest::Approx(2.0 * end[0] + 5.0).epsilon(1e-12));
    const bool is_end = std::abs(end[0] - 100.0) < 1e-9 || std::abs(end[0] - 300.0) < 1e-9;
    CHECK(is_end);
  }
  CHECK(f.lines[0].image_p[0] == doctest::Approx(50.0));
}

TEST_CASE("the fit minimises the squared distances") {
  Rng rng(2);
  const std::vector<ModelLine> model(1, test::make_line(Vec3::Zero(), Vec3::UnitX()));
  std::vector<LinePoint> points;
  for (int i = 0; i < 30; ++i) {
    const double y = 50.0 + 3.0 * i + test::gaussian(rng);
    points.push_back({100.0 + 10.0 * i, y, 1.0, 0});
  }
  const Fitted f = fit(model, points, kNone);
  const auto cost = [&](const Vec2& p, const Vec2& q) {
    const Vec3 l = line_through(p, q);
    double sum = 0.0;
    for (const LinePoint& point : points) {
      const double d = l.dot(Vec3(point.u_px, point.v_px, 1.0));
      sum += d * d;
    }
    return sum;
  };
  const Vec2 p(f.lines[0].image_p[0], f.lines[0].image_p[1]);
  const Vec2 q(f.lines[0].image_q[0], f.lines[0].image_q[1]);
  for (const double step : {-0.01, 0.01}) {
    CHECK(cost(p, q) < cost(p + Vec2(0.0, step), q));
    CHECK(cost(p, q) < cost(p, q + Vec2(0.0, step)));
  }
}

TEST_CASE("points closer than a pixel make no line") {
  const std::vector<ModelLine> model(1, test::make_line(Vec3::Zero(), Vec3::UnitX()));
  CHECK(fit(model, {{10.0, 10.0, 1.0, 0}, {10.5, 10.5, 1.0, 0}}, kNone).lines.empty());
  CHECK(fit(model, {{10.0, 10.0, 1.0, 0}, {10.0, 10.0, 1.0, 0}}, kNone).lines.empty());
  CHECK(fit(model, {{10.0, 10.0, 1.0, 0}, {10.5, 11.0, 1.0, 0}}, kNone).lines.size() == 1);
}

TEST_CASE("the straightening is the division model, bounded at its pole") {
  const std::vector<ModelLine> model(1, test::make_line(Vec3::Zero(), Vec3::UnitX()));
  Straightening s = kNone;
  s.mu = 0.5;
  // rho = 1 at 400 px: factor 1 / (1 - 0.5); rho = 0.5: 1 / (1 - 0.125).
  const Fitted f = fit(model, {{719.5, 239.5, 1.0, 0}, {519.5, 239.5, 1.0, 0}}, s);
  REQUIRE(f.lines.size() == 1);
  const double low = std::min(f.lines[0].image_p[0], f.lines[0].image_q[0]);
  const double high = std::max(f.lines[0].image_p[0], f.lines[0].image_q[0]);
  CHECK(low == doctest::Approx(319.5 + 200.0 / 0.875).epsilon(1e-12));
  CHECK(high == doctest::Approx(319.5 + 400.0 / 0.5).epsilon(1e-12));
  s.mu = 2.0;
  const Fitted far = fit(model, {{719.5, 239.5, 1.0, 0}, {319.5, 239.5, 1.0, 0}}, s);
  CHECK(std::max(far.lines[0].image_p[0], far.lines[0].image_q[0]) == doctest::Approx(319.5 + 400.0 / 0.05));
}

}  // namespace
}  // namespace lecalib
