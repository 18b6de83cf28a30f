// SPDX-License-Identifier: MIT
#include "lecalib/solve/calibration_data.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <vector>

#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

test::SyntheticViews good_views() {
  Rng rng(1);
  test::SyntheticViews s;
  s.camera = test::make_camera(400.0, 400.0, 320.0, 240.0);
  s.model = test::box_edges(0.4, 0.3, 0.2);
  for (int v = 0; v < 2; ++v) s.add_view(test::looking_pose(rng, 2.0, 0.5), 2, 0.0, 1.0, rng);
  return s;
}

TEST_CASE("validate accepts good data and names the kind of bad data") {
  CHECK(validate(good_views().data()) == Status::ok);
  CHECK(validate(CalibrationData()) == Status::invalid_argument);

  auto s = good_views();
  s.model.clear();
  CHECK(validate(s.data()) == Status::too_few_lines);
  s = good_views();
  s.views.clear();
  CHECK(validate(s.data()) == Status::too_few_lines);
  s = good_views();
  s.points.clear();
  CHECK(validate(s.data()) == Status::too_few_lines);

  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, infinity}) {
    s = good_views();
    s.points[5].u_px = bad;
    CHECK(validate(s.data()) == Status::invalid_argument);
    s = good_views();
    s.points[5].sigma_px = bad;
    CHECK(validate(s.data()) == Status::invalid_argument);
    s = good_views();
    s.model[3].q[1] = bad;
    CHECK(validate(s.data()) == Status::invalid_argument);
  }
  s = good_views();
  s.points[5].sigma_px = 0.0;
  CHECK(validate(s.data()) == Status::invalid_argument);
  s = good_views();
  s.points[5].line = static_cast<std::uint16_t>(s.model.size());
  CHECK(validate(s.data()) == Status::invalid_argument);
  s = good_views();
  for (int k = 0; k < 3; ++k) s.model[3].q[k] = s.model[3].p[k];
  CHECK(validate(s.data()) == Status::invalid_argument);
  s = good_views();
  s.views[1].count += 1;
  CHECK(validate(s.data()) == Status::invalid_argument);
  s = good_views();
  s.views[1].first = 0xFFFFFFFFU;
  CHECK(validate(s.data()) == Status::invalid_argument);
}

TEST_CASE("validate takes one edge per point, or none") {
  const auto s = good_views();
  CalibrationData data = s.data();
  const std::vector<EdgePoint> edges(data.points.size());
  data.edges = edges;
  CHECK(validate(data) == Status::ok);
  data.edges = data.edges.first(data.points.size() - 1);
  CHECK(validate(data) == Status::invalid_argument);
  data.edges = {};
  const std::vector<std::uint8_t> left_out(data.points.size());
  data.left_out = left_out;
  CHECK(validate(data) == Status::ok);
  data.left_out = data.left_out.first(data.points.size() - 1);
  CHECK(validate(data) == Status::invalid_argument);
}

TEST_CASE("the image centre is that of pixel centres at integers") {
  const auto s = good_views();
  CHECK(centre_x(s.data()) == 319.5);
  CHECK(centre_y(s.data()) == 239.5);
}

}  // namespace
}  // namespace lecalib
