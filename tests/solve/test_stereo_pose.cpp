// SPDX-License-Identifier: MIT
#include "lecalib/solve/stereo_pose.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "lecalib/math/so3.hpp"
#include "support/synthetic_views.hpp"

namespace lecalib {
namespace {

std::size_t count_symmetries(const std::vector<ModelLine>& model) {
  Pose found[32];
  return find_symmetries(model, found);
}

std::vector<ModelLine> rectangle(double width, double height) {
  const Vec3 corner[] = {{0, 0, 0}, {width, 0, 0}, {width, height, 0}, {0, height, 0}};
  std::vector<ModelLine> lines;
  for (std::size_t i = 0; i < 4; ++i) lines.push_back(test::make_line(corner[i], corner[(i + 1) % 4]));
  return lines;
}

/// Poses of a rig that goes around an object; each camera's labels are turned by some symmetry.
std::vector<PosePair> pairs_of(const Pose& T_right_left, Span<const Pose> symmetries, std::size_t count,
                               double noise_rad, double motion_rad) {
  Rng rng(8);
  std::vector<PosePair> pairs;
  const Pose first = test::slanted_pose();
  for (std::size_t i = 0; i < count; ++i) {
    const Mat3 turn = so3_exp(test::random_vector(rng, motion_rad));
    const Pose seen =
        make_pose(turn * rotation_of(first), translation_of(first) + test::random_vector(rng, motion_rad));
    const auto any = [&]() -> const Pose& {
      return symmetries[rng.below(static_cast<std::uint32_t>(symmetries.size()))];
    };
    const Pose left = product(seen, any());
    const Pose right = product(product(T_right_left, seen), any());
    pairs.push_back({left,
                     make_pose(so3_exp(test::random_vector(rng, noise_rad)) * rotation_of(right),
                               translation_of(right) + test::random_vector(rng, noise_rad)),
                     Pose(), false});
  }
  return pairs;
}

double turn_between(const Pose& a, const Pose& b) {
  return so3_log(rotation_of(a) * rotation_of(b).transpose()).norm();
}

TEST_CASE("symmetries: as many as the object has, wherever it stands") {
  CHECK(count_symmetries(rectangle(0.3, 0.2)) == 4);
  CHECK(count_symmetries(rectangle(0.2, 0.2)) == 8);
  CHECK(count_symmetries(test::box_edges(0.4, 0.3, 0.25)) == 4);
  CHECK(count_symmetries(test::box_edges(0.4, 0.3, 0.3)) == 8);
  CHECK(count_symmetries(test::box_edges(0.3, 0.3, 0.3)) == 24);
  std::vector<ModelLine> visible = test::box_edges(0.4, 0.3, 0.25);
  visible.pop_back();
  CHECK(count_symmetries(visible) == 1);
  std::vector<ModelLine> star;  // all begin at one point
  for (const Vec3& end : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0)}) {
    star.push_back(test::make_line(Vec3::Zero(), end));
  }
  CHECK(count_symmetries(star) == 8);
  Rng rng(4);
  CHECK(count_symmetries(test::random_lines(rng, 10, 1, 1, 1)) == 1);
  CHECK(count_symmetries({test::make_line(Vec3(0, 0, 0), Vec3(1, 0, 0))}) == 1);  // all on one line: not looked for
  Pose one[1];
  CHECK(find_symmetries(test::box_edges(1, 1, 1), one) == 1);
  CHECK(find_symmetries(test::box_edges(1, 1, 1), {}) == 0);
  CHECK(find_symmetries({}, one) == 1);
}

TEST_CASE("symmetries: each maps the lines onto the lines, the identity comes first") {
  const std::vector<ModelLine> model = test::box_edges(0.3, 0.3, 0.2);
  Pose found[24];
  const std::size_t count = find_symmetries(model, found);
  REQUIRE(count == 8);
  CHECK(so3_log(rotation_of(found[0])).norm() + translation_of(found[0]).norm() == 0);
  for (std::size_t s = 0; s < count; ++s) {
    CHECK(std::abs(rotation_of(found[s]).determinant() - 1) <= 1e-12);
    for (const ModelLine& line : model) {
      const Vec3 p = rotation_of(found[s]) * Vec3(line.p) + translation_of(found[s]);
      const Vec3 q = rotation_of(found[s]) * Vec3(line.q) + translation_of(found[s]);
      int hits = 0;
      for (const ModelLine& other : model) {
        const double same = (p - Vec3(other.p)).norm() + (q - Vec3(other.q)).norm();
        const double turned = (p - Vec3(other.q)).norm() + (q - Vec3(other.p)).norm();
        if (std::min(same, turned) <= 1e-9) ++hits;
      }
      CHECK(hits == 1);
    }
  }
}

TEST_CASE("stereo pose: found whatever labels each view has") {
  Pose symmetries[24];
  const Span<const Pose> all(symmetries, find_symmetries(test::box_edges(0.4, 0.3, 0.25), symmetries));
  const Pose T_right_left = make_pose(so3_exp(Vec3(0.02, -0.2, 0.1)), Vec3(-0.2, 0.01, 0.03));
  std::vector<PosePair> pairs = pairs_of(T_right_left, all, 20, 0.002, 0.3);
  // Two wrong ones: the right camera took something else for the object.
  for (const std::size_t i : {std::size_t{3}, std::size_t{11}}) pairs[i].right = test::slanted_pose();
  Pose found;
  REQUIRE(find_stereo_pose(pairs, all, {}, &found) == Status::ok);
  // It is that of one pair, with its noise.
  CHECK(turn_between(found, T_right_left) <= 0.004);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    CHECK(pairs[i].agrees == (i != 3 && i != 11));
    if (!pairs[i].agrees) continue;
    const Pose expected = product(found, product(pairs[i].left, pairs[i].symmetry));
    CHECK(turn_between(expected, pairs[i].right) <= 0.01);
    CHECK((translation_of(expected) - translation_of(pairs[i].right)).norm() <= 0.05);
  }
}

TEST_CASE("stereo pose: where nothing moves, cameras that look the same way are taken to be meant") {
  Pose symmetries[24];
  const Span<const Pose> all(symmetries, find_symmetries(rectangle(0.297, 0.21), symmetries));
  REQUIRE(all.size() == 4);
  const Pose T_right_left = make_pose(so3_exp(Vec3(0.01, 0.1, 0.02)), Vec3(-0.1, 0, 0));
  std::vector<PosePair> pairs = pairs_of(T_right_left, all, 6, 0.001, 0.0005);
  Pose found;
  REQUIRE(find_stereo_pose(pairs, all, {}, &found) == Status::ok);
  CHECK(turn_between(found, T_right_left) <= 0.005);
}

TEST_CASE("stereo pose: cameras that move against each other, or on two clocks, have none") {
  const Pose identity[] = {Pose()};
  const Pose T_right_left = make_pose(so3_exp(Vec3(0.02, -0.2, 0.1)), Vec3(-0.2, 0.01, 0.03));
  std::vector<PosePair> pairs = pairs_of(T_right_left, identity, 20, 0.001, 0.4);
  for (std::size_t i = 0; i + 1 < pairs.size(); ++i) pairs[i].right = pairs[i + 1].right;
  Pose found = T_right_left;
  CHECK(find_stereo_pose(pairs, identity, {}, &found) == Status::no_match);
  CHECK(found.t[0] == T_right_left.t[0]);
  CHECK(find_stereo_pose({}, identity, {}, &found) == Status::no_match);
}

}  // namespace
}  // namespace lecalib
