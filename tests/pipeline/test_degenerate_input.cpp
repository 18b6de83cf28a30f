// SPDX-License-Identifier: MIT
/// Input that does not determine a camera, kind by kind: it is refused by name, never answered by a wrong camera.
#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>
#include <vector>

#include "support/solver_run.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

using test::SyntheticViews;
using Run = test::SolverRun;

/// One view of `model`, with a little noise, as seen by `pose`.
Run solve_one(const std::vector<ModelLine>& model, const Pose& pose, int per_line = 3) {
  static SyntheticViews s;
  Rng rng(60);
  s = SyntheticViews();
  s.camera = test::make_camera(400.0, 400.0, 319.5, 239.5);
  s.model = model;
  s.add_view(pose, per_line, 0.3, 0.3, rng);
  return Run(s.data());
}

const Pose kTilted = test::slanted_pose();

TEST_CASE("refused: fewer lines than the unknowns need") {
  Rng rng(61);
  CHECK(solve_one(test::random_lines(rng, 3, 1.2, 0.9, 0.0), kTilted).status == Status::too_few_lines);
  CHECK(solve_one(test::random_lines(rng, 5, 1.2, 0.9, 0.8), kTilted).status == Status::too_few_lines);
}

TEST_CASE("refused: all lines parallel") {
  std::vector<ModelLine> flat;
  std::vector<ModelLine> spatial;
  for (int i = 0; i < 8; ++i) {
    const double y = 0.25 * i - 1.0;
    flat.push_back(test::make_line(Vec3(-1.0, y, 0.0), Vec3(1.0, y, 0.0)));
    spatial.push_back(test::make_line(Vec3(-1.0, y, 0.3 * (i % 3)), Vec3(1.0, y, 0.3 * (i % 3))));
  }
  for (const auto& model : {flat, spatial}) {
    const Status status = solve_one(model, kTilted).status;
    CHECK((status == Status::degenerate_geometry || status == Status::undetermined));
  }
}

TEST_CASE("refused: all lines through one point") {
  Rng rng(62);
  for (const double depth : {0.0, 0.8}) {
    std::vector<ModelLine> model;
    for (int i = 0; i < 9; ++i) {
      Vec3 end = test::random_vector(rng, 1.0);
      end(2) *= depth;
      model.push_back(test::make_line(Vec3(0.1, -0.1, 0.0), end + Vec3(end(0) > 0 ? 0.3 : -0.3, 0.0, 0.0)));
    }
    const Status status = solve_one(model, kTilted).status;
    CHECK((status == Status::degenerate_geometry || status == Status::undetermined));
  }
}

TEST_CASE("refused: a collinear model") {
  std::vector<ModelLine> model;
  for (int i = 0; i < 8; ++i) model.push_back(test::make_line(Vec3(0.2 * i - 1.0, 0, 0), Vec3(0.2 * i - 0.7, 0, 0)));
  CHECK(is_error(solve_one(model, kTilted).status));
}

TEST_CASE("refused: the same few lines, repeated") {
  Rng rng(63);
  std::vector<ModelLine> model = test::random_lines(rng, 3, 1.2, 0.9, 0.0);
  for (int i = 0; i < 6; ++i) model.push_back(model[static_cast<std::size_t>(i % 3)]);
  CHECK(is_error(solve_one(model, kTilted).status));
  std::vector<ModelLine> spatial = test::random_lines(rng, 4, 1.2, 0.9, 0.8);
  for (int i = 0; i < 8; ++i) spatial.push_back(spatial[static_cast<std::size_t>(i % 4)]);
  CHECK(is_error(solve_one(spatial, kTilted).status));
}

TEST_CASE("refused: a fronto-parallel plane with free focal length, also seen again and again") {
  Rng rng(64);
  const std::vector<ModelLine> model = test::random_lines(rng, 14, 1.2, 0.9, 0.0);
  const Pose frontal = make_pose(so3_exp(Vec3(0.0, 0.0, 0.3)), Vec3(0.1, 0.0, 3.0));
  const Run one = solve_one(model, frontal);
  CHECK(one.status == Status::undetermined);
  CHECK(one.result().parameter <= 1);  // fx or fy
  SyntheticViews s;
  s.camera = test::make_camera(400.0, 400.0, 319.5, 239.5);
  s.model = model;
  for (int v = 0; v < 6; ++v) s.add_view(frontal, 3, 0.3, 0.3, rng);
  CHECK(Run(s.data()).status == Status::undetermined);
}

TEST_CASE("identical planar views count as one: the principal point is listed as assumed") {
  Rng rng(65);
  SyntheticViews s;
  s.camera = test::make_camera(400.0, 400.0, 350.0, 210.0);  // off the centre by 30 px
  s.model = test::random_lines(rng, 14, 1.2, 0.9, 0.0);
  for (int v = 0; v < 6; ++v) s.add_view(kTilted, 3, 0.3, 0.3, rng);
  const Run run(s.data());
  CHECK(run.result().assumed[2]);
  CHECK(run.result().assumed[3]);
  if (run.status == Status::ok) CHECK(std::abs(run.result().camera.fx - 400.0) < 4.0 * run.result().sigma[0]);
}

TEST_CASE("refused: wrong correspondences") {
  Rng rng(9);
  SyntheticViews s;
  s.camera = test::make_camera(400.0, 410.0, 330.0, 230.0, -0.2, 0.05);
  s.model = test::random_lines(rng, 12, 1.2, 0.9, 0.0);
  for (int v = 0; v < 6; ++v) s.add_view(test::looking_pose(rng, 3.0, 0.6), 5, 0.3, 1.0, rng);
  for (LinePoint& point : s.points) point.line = static_cast<std::uint16_t>((point.line * 5 + 3) % s.model.size());
  CHECK(is_error(Run(s.data()).status));
}

/// Whether a result explains a refusal of the geometry: by the arrangement, or by naming an intrinsic.
bool is_geometric_refusal(const Run& run) {
  return run.status == Status::degenerate_geometry ||
         (run.status == Status::undetermined && run.result().parameter != kNoParameter);
}

SyntheticViews seen(const std::vector<ModelLine>& model, std::initializer_list<Pose> poses, std::uint64_t seed) {
  Rng rng(seed);
  SyntheticViews s;
  s.camera = test::make_camera(400.0, 400.0, 319.5, 239.5);
  s.model = model;
  for (const Pose& pose : poses) s.add_view(pose, 3, 0.3, 0.3, rng);
  return s;
}

Pose frontal(double angle, double distance) {
  return make_pose(so3_exp(Vec3(0.0, 0.0, angle)), Vec3(0.1, 0, distance));
}

TEST_CASE("refused: a fronto-parallel plane from several distances, as by a zoom or a slide along the axis") {
  Rng rng(66);
  const auto model = test::random_lines(rng, 14, 1.2, 0.9, 0.0);
  const SyntheticViews s =
      seen(model, {frontal(0.1, 2.5), frontal(0.1, 3.0), frontal(0.1, 4.0), frontal(0.1, 6.0)}, 67);
  CHECK(is_geometric_refusal(Run(s.data())));
}

TEST_CASE("refused: a fronto-parallel plane that only turns about the axis") {
  Rng rng(68);
  const auto model = test::random_lines(rng, 14, 1.2, 0.9, 0.0);
  const SyntheticViews s =
      seen(model, {frontal(-0.5, 3.0), frontal(0.0, 3.0), frontal(0.4, 3.0), frontal(0.9, 3.0)}, 69);
  CHECK(is_geometric_refusal(Run(s.data())));
}

TEST_CASE("refused: two bundles of parallel lines, none across") {
  std::vector<ModelLine> model;  // in two planes, all along x
  for (int i = 0; i < 10; ++i) {
    const double y = 0.2 * (i / 2) - 0.4;
    model.push_back(test::make_line(Vec3(-1.0, y, 0.5 * (i % 2)), Vec3(1.0, y, 0.5 * (i % 2))));
  }
  CHECK(is_error(solve_one(model, kTilted).status));
}

TEST_CASE("refused: all lines but one through one point") {
  Rng rng(70);
  std::vector<ModelLine> model = {test::make_line(Vec3(-1.0, 0.6, 0.0), Vec3(1.0, 0.8, 0.0))};
  for (int i = 0; i < 8; ++i) {
    Vec3 end = test::random_vector(rng, 1.0);
    end(2) = 0.0;
    model.push_back(test::make_line(Vec3(0.1, -0.1, 0.0), end + Vec3(end(0) > 0 ? 0.3 : -0.3, 0.0, 0.0)));
  }
  CHECK(is_geometric_refusal(solve_one(model, kTilted)));
}

TEST_CASE("refused: a plane seen edge-on, all its lines in one image line") {
  Rng rng(71);
  const auto model = test::random_lines(rng, 12, 1.2, 0.9, 0.0);
  // The plane's normal lies along the camera's y axis and the camera in the plane.
  CHECK(is_error(solve_one(model, make_pose(so3_exp(Vec3(1.5707963267948966, 0.0, 0.0)), Vec3(0.0, 0.0, 4.0))).status));
}

TEST_CASE("refused: lines of one measured point, or of points that coincide") {
  Rng rng(72);
  SyntheticViews one = seen(test::random_lines(rng, 12, 1.2, 0.9, 0.8), {kTilted}, 73);
  SyntheticViews same = one;
  std::vector<LinePoint> firsts;
  for (std::size_t i = 0; i < one.points.size(); i += 3) firsts.push_back(one.points[i]);
  one.points = firsts;
  one.views[0].count = static_cast<std::uint32_t>(firsts.size());
  CHECK(Run(one.data()).status == Status::too_few_lines);
  for (std::size_t i = 0; i < same.points.size(); ++i) same.points[i] = same.points[i - i % 3];
  CHECK(Run(same.data()).status == Status::too_few_lines);
}

TEST_CASE("refused: all lines random, or most") {
  for (const std::size_t right : {std::size_t{0}, std::size_t{8}}) {
    for (std::uint64_t seed = 80; seed < 90; ++seed) {
      for (const double depth : {0.0, 0.8}) {
        Rng rng(seed);
        SyntheticViews s = seen(test::random_lines(rng, 24, 1.2, 0.9, depth), {kTilted}, seed);
        for (LinePoint& point : s.points) {
          if (point.line < right) continue;
          point.u_px = rng.uniform(0.0, 640.0);
          point.v_px = rng.uniform(0.0, 480.0);
        }
        CHECK(is_error(Run(s.data()).status));
      }
    }
  }
}

TEST_CASE("refused: the mirror image of a model in space") {
  for (std::uint64_t seed = 90; seed < 95; ++seed) {
    Rng rng(seed);
    SyntheticViews s = seen(test::random_lines(rng, 14, 1.2, 0.9, 0.8), {kTilted}, seed);
    for (LinePoint& point : s.points) point.u_px = 639.0 - point.u_px;
    CHECK(is_error(Run(s.data()).status));
  }
}

TEST_CASE("refused: two models at once, each with half of the lines") {
  Rng rng(96);
  SyntheticViews s = seen(test::random_lines(rng, 20, 1.2, 0.9, 0.8), {kTilted}, 97);
  const SyntheticViews other = seen(s.model, {make_pose(so3_exp(Vec3(-0.4, 0.5, -0.7)), Vec3(-0.3, 0.2, 5.0))}, 98);
  for (std::size_t i = 0; i < std::min(s.points.size(), other.points.size()); ++i) {
    if (s.points[i].line % 2 == 1) s.points[i] = other.points[i];
  }
  const Run run(s.data());
  // Either half is a consistent answer; a mixture of both is none.
  if (run.status == Status::ok) CHECK(std::abs(run.result().camera.fx - 400.0) < 5.0 * run.result().sigma[0]);
}

}  // namespace
}  // namespace lecalib
