// SPDX-License-Identifier: MIT
#include "lecalib/solve/initial_guess.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

struct Search {
  std::vector<LineSums> sums;
  std::vector<ViewLine> lines;
  std::vector<LinearView> linear;
  std::vector<double> focal_lengths;
  std::vector<RefineView> views;
  InitialGuess guess;

  Status run(const test::SyntheticViews& s) {
    sums.resize(s.model.size());
    lines.resize(s.model.size());
    linear.resize(s.views.size());
    focal_lengths.resize(s.views.size());
    views.resize(s.views.size());
    guess.init(s.data(), {}, {sums, lines, linear, focal_lengths, views});
    return finish();
  }
  Status finish() {
    Status status = Status::in_progress;
    while (status == Status::in_progress) status = guess.step();
    return status;
  }
};

test::SyntheticViews make_views(double k1, double k2, double half_z, int num_views, double noise_px,
                                std::uint64_t seed) {
  Rng rng(seed);
  test::SyntheticViews s;
  s.camera = test::make_camera(400.0, 400.0, 319.5, 239.5, k1, k2);
  s.model = test::random_lines(rng, 20, 1.6, 1.2, half_z);
  for (int v = 0; v < num_views; ++v) s.add_view(test::looking_pose(rng, 4.0, 0.6), 3, noise_px, 1.0, rng);
  return s;
}

TEST_CASE("without distortion and noise the start is the answer, with planes and in space") {
  for (const double half_z : {0.0, 1.0}) {
    for (const int views : {1, 5, 30}) {
      const auto s = make_views(0.0, 0.0, half_z, views, 0.0, 2);
      Search search;
      REQUIRE(search.run(s) == Status::ok);
      CHECK(search.guess.camera().fx == doctest::Approx(400.0).epsilon(1e-6));
      CHECK(search.guess.camera().fy == doctest::Approx(400.0).epsilon(1e-6));
      CHECK(search.guess.rms_px() < 1e-3);
      for (std::size_t v = 0; v < s.views.size(); ++v) {
        REQUIRE(search.views[v].used);
        CHECK((rotation_of(search.views[v].pose) - rotation_of(s.poses[v])).norm() < 1e-6);
        CHECK((translation_of(search.views[v].pose) - translation_of(s.poses[v])).norm() < 1e-5);
      }
    }
  }
}

TEST_CASE("strong barrel, pincushion and noise leave the start within 30 % of the focal length") {
  for (const double k1 : {-0.3, -0.15, 0.15}) {
    for (const double half_z : {0.0, 1.0}) {
      const auto s = make_views(k1, 0.2 * k1 * k1, half_z, 6, 0.5, 3);
      Search search;
      REQUIRE(search.run(s) == Status::ok);
      CHECK(search.guess.camera().fx == doctest::Approx(400.0).epsilon(0.3));
    }
  }
}

TEST_CASE("further candidates differ in focal length and come to an end") {
  Search search;
  const auto s = make_views(-0.2, 0.0, 0.0, 1, 1.0, 4);  // outlives the search
  REQUIRE(search.run(s) == Status::ok);
  double previous = search.guess.camera().fx;
  int candidates = 1;
  while (search.guess.begin_next_candidate()) {
    REQUIRE(search.finish() == Status::ok);
    CHECK(search.guess.camera().fx != previous);
    previous = search.guess.camera().fx;
    REQUIRE(++candidates <= 1 + static_cast<int>(kMaxStartCandidates));  // the plain start comes first
  }
  CHECK(candidates > 1);
}

TEST_CASE("too few lines and degenerate arrangements are told apart") {
  auto few = make_views(0.0, 0.0, 0.0, 2, 0.0, 5);
  for (View& view : few.views) view.count = 9;  // three lines
  CHECK(Search().run(few) == Status::too_few_lines);
  auto parallel = make_views(0.0, 0.0, 0.0, 0, 0.0, 6);
  parallel.model.clear();
  for (int i = 0; i < 8; ++i) parallel.model.push_back(test::make_line(Vec3(-1, 0.2 * i, 0), Vec3(1, 0.2 * i, 0)));
  Rng rng(7);
  parallel.add_view(test::looking_pose(rng, 4.0, 0.5), 3, 0.0, 1.0, rng);
  CHECK(Search().run(parallel) == Status::degenerate_geometry);
}

TEST_CASE("one good view among many bad ones is found") {
  auto s = make_views(0.0, 0.0, 0.0, 30, 0.1, 8);
  for (std::size_t v = 0; v < s.views.size(); ++v) {
    if (v != 17) s.views[v].count = 6;
  }
  Search search;
  REQUIRE(search.run(s) == Status::ok);
  for (std::size_t v = 0; v < s.views.size(); ++v) CHECK(search.views[v].used == (v == 17));
}

TEST_CASE("views are classified by what they tell about the principal point") {
  const auto classify = [](const test::SyntheticViews& s) {
    std::vector<RefineView> views(s.views.size());
    for (std::size_t v = 0; v < views.size(); ++v) {
      views[v].pose = s.poses[v];
      views[v].used = true;
    }
    std::vector<LineSums> sums(s.model.size());
    std::vector<ViewLine> lines(s.model.size());
    return classify_views(s.data(), views, sums, lines);
  };
  CHECK(classify(make_views(0.0, 0.0, 1.0, 1, 0.0, 9)) == ViewGeometry::spatial);
  CHECK(classify(make_views(0.0, 0.0, 0.0, 4, 0.0, 9)) == ViewGeometry::planes);
  CHECK(classify(make_views(0.0, 0.0, 0.0, 1, 0.0, 9)) == ViewGeometry::one_plane_pose);
  auto repeated = make_views(0.0, 0.0, 0.0, 0, 0.0, 9);
  Rng rng(10);
  for (int i = 0; i < 3; ++i) {  // moved, but not turned
    repeated.add_view(make_pose(so3_exp(Vec3(0.3, 0.2, 0.0)), Vec3(0.1 * i, 0.0, 4.0 + i)), 3, 0.0, 1.0, rng);
  }
  CHECK(classify(repeated) == ViewGeometry::one_plane_pose);
}

TEST_CASE("a start knows its views' geometry as the views by themselves tell it") {
  for (const double half_z : {0.0, 1.0}) {
    for (const int num_views : {1, 4}) {
      const test::SyntheticViews s = make_views(-0.1, 0.02, half_z, num_views, 0.3, 12);
      Search search;
      REQUIRE(search.run(s) == Status::ok);
      const ViewGeometry expected = classify_views(s.data(), search.views, search.sums, search.lines);
      CHECK(search.guess.geometry() == expected);
    }
  }
}

}  // namespace
}  // namespace lecalib
