// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/coverage.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "lecalib/math/so3.hpp"

using namespace lecalib;

namespace {

EventLine line(float x1, float y1, float x2, float y2, float moved_y = 0) {
  EventLine out{};
  out.begin = {x1, y1 - 0.5F * moved_y, x2, y2 - 0.5F * moved_y};
  out.end = {x1, y1 + 0.5F * moved_y, x2, y2 + 0.5F * moved_y};
  return out;
}

bool advises(const Coverage& coverage, CoverageHint hint) {
  return std::find(coverage.hints, coverage.hints + kMaxHintsAtOnce, hint) != coverage.hints + kMaxHintsAtOnce;
}

std::vector<ModelLine> sheet() {
  return {
      {{0, 0, 0}, {0.3, 0, 0}}, {{0.3, 0, 0}, {0.3, 0.2, 0}}, {{0.3, 0.2, 0}, {0, 0.2, 0}}, {{0, 0.2, 0}, {0, 0, 0}}};
}

WindowPoses seen_at(const Vec3& turn, double distance) {
  const Mat3 R = so3_exp(turn);
  WindowPoses poses{};
  poses.num_lines = 4;
  poses.begin = poses.end = make_pose(R, Vec3(0, 0, distance) - R * Vec3(0.15, 0.1, 0));
  return poses;
}

CoverageSolution solution(Span<const ModelLine> model) {
  CoverageSolution out;
  out.camera.width = 640;
  out.camera.height = 480;
  out.camera.fx = out.camera.fy = 500;
  out.camera.cx = 320;
  out.camera.cy = 240;
  out.model = model;
  return out;
}

}  // namespace

TEST_CASE("coverage: cells count the windows in which a line crosses them") {
  CoverageMap map;
  map.clear(800, 600);
  const EventLine lines[] = {line(50, 150, 750, 150, 4), line(450, 10, 450, 590), line(-500, 150, -10, 150)};
  for (int window = 0; window < 3; ++window) map.add(lines);
  const Coverage& seen = map.seen();
  CHECK(seen.windows == 3);
  CHECK(seen.useful_windows == 0);
  for (int row = 0; row < kCoverageRows; ++row) {
    for (int column = 0; column < kCoverageColumns; ++column) {
      CHECK(seen.cells[row][column] == (row == 1 || column == 4 ? 3 : 0));
    }
  }
  CHECK(seen.travel_px == doctest::Approx(3 * 4.0 / 3).epsilon(0.01));
  map.clear(800, 600);
  CHECK(map.seen().windows == 0);
}

TEST_CASE("coverage: the image's lines say what is missing while events are collected") {
  CoverageMap map;
  map.clear(800, 600);
  Coverage coverage = map.seen();
  advise_collecting(&coverage);
  CHECK(coverage.num_hints() == 0);  // nothing was seen yet, which says nothing

  for (int window = 0; window < 8; ++window) map.add({});
  coverage = map.seen();
  advise_collecting(&coverage);
  CHECK(coverage.hints[0] == CoverageHint::show_object);
  CHECK(coverage.num_hints() == 1);

  map.clear(800, 600);
  const EventLine still[] = {line(10, 250, 10, 350), line(110, 250, 110, 350), line(10, 250, 110, 250),
                             line(10, 350, 110, 350)};
  for (int window = 0; window < 8; ++window) map.add(still);
  coverage = map.seen();
  advise_collecting(&coverage);
  CHECK(coverage.hints[0] == CoverageHint::move);
  CHECK(advises(coverage, CoverageHint::fill_right));
  CHECK_FALSE(advises(coverage, CoverageHint::fill_left));
  CHECK_FALSE(advises(coverage, CoverageHint::enough));

  map.clear(800, 600);
  for (int window = 0; window < 24; ++window) {
    const auto x = static_cast<float>(10 + 780 * (window % 12) / 11);
    const auto y = static_cast<float>(10 + 580 * (window % 12) / 11);
    const EventLine sweep[] = {line(x, 10, x, 590), line(x, 300, x, 590), line(10, y, 790, y), line(10, y, 400, y)};
    map.add(sweep);
  }
  coverage = map.seen();
  advise_collecting(&coverage);
  CHECK(coverage.covered_share == 1);
  CHECK(coverage.num_hints() == 0);
}

TEST_CASE("coverage: a sheet that was never tilted is to be tilted, and a known camera is enough") {
  const std::vector<ModelLine> model = sheet();
  std::vector<WindowPoses> poses;
  for (int i = 0; i < 12; ++i) poses.push_back(seen_at(Vec3(0.01 * (i % 3), 0, 0), 0.5));
  Coverage coverage;
  advise_found(solution(model), poses, &coverage);
  CHECK(coverage.matched_windows == 12);
  CHECK(coverage.tilt_deg == doctest::Approx(0.02 * 57.29578).epsilon(0.01));
  CHECK(coverage.roll_deg == doctest::Approx(0).epsilon(0.01));
  CHECK(coverage.worst < 2);
  CHECK(coverage.hints[0] == CoverageHint::tilt);
  const float untilted = coverage.sigma_share[0];

  for (int i = 0; i < 12; ++i)
    poses.push_back(seen_at(Vec3(0.5 * (i % 3 - 1), 0.5 * (i % 2), 0.4 * (i % 4)), 0.5 + 0.01 * i));
  advise_found(solution(model), poses, &coverage);
  CHECK(coverage.sigma_share[0] < 0.5F * untilted);
  CHECK(coverage.tilt_deg > 40);
  CHECK(coverage.roll_deg > 60);
  CHECK(coverage.distance_min_m == doctest::Approx(0.5));
  CHECK(coverage.distance_max_m == doctest::Approx(0.61));
  CHECK_FALSE(advises(coverage, CoverageHint::enough));  // nobody has measured anything yet

  double covariance[81] = {};
  for (int i = 0; i < 8; ++i) covariance[10 * i] = i < 4 ? 1.0 : 1e-6;
  CoverageSolution known = solution(model);
  known.covariance = covariance;
  known.solved = true;
  advise_found(known, poses, &coverage);
  CHECK(coverage.sigma_share[0] == doctest::Approx(1.0 / 500));
  CHECK(coverage.hints[0] == CoverageHint::enough);
  CHECK(coverage.num_hints() == 1);

  covariance[0] = covariance[10] = 100.0;
  known.faint = true;
  advise_found(known, poses, &coverage);
  CHECK(coverage.sigma_share[0] == doctest::Approx(10.0 / 500));
  CHECK(coverage.hints[0] == CoverageHint::more_contrast);
  CHECK_FALSE(advises(coverage, CoverageHint::enough));
}

TEST_CASE("coverage: a solution of which arithmetic can tell nothing is not enough") {
  const std::vector<ModelLine> model = sheet();
  const std::vector<WindowPoses> poses = {seen_at(Vec3(0, 0, 0), 0.5)};
  for (int k = 0; k < 40; ++k) {
    CAPTURE(k);
    // Focal lengths of a sigma 20 times what is good, and ever nearer to depending on each other altogether.
    double covariance[81] = {};
    for (int i = 0; i < 8; ++i) covariance[10 * i] = i < 2 ? 2500.0 : 1.0;
    covariance[1] = covariance[9] = 2500.0 * (1.0 - 5e-15 * (1.0 + 0.01 * k));
    CoverageSolution known = solution(model);
    known.covariance = covariance;
    known.solved = true;
    Coverage coverage;
    advise_found(known, poses, &coverage);
    CHECK_FALSE(advises(coverage, CoverageHint::enough));
  }
}

TEST_CASE("coverage: without poses nothing is known of the object") {
  const std::vector<ModelLine> model = sheet();
  Coverage coverage;
  coverage.hints[0] = CoverageHint::move;
  advise_found(solution(model), {}, &coverage);
  CHECK(coverage.matched_windows == 0);
  CHECK(coverage.hints[0] == CoverageHint::move);
  CHECK(coverage.worst == 0xFF);
}

TEST_CASE("coverage: every hint has a name of its own") {
  for (std::size_t a = 0; a < kNumCoverageHints; ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      CHECK(to_string(static_cast<CoverageHint>(a)) != to_string(static_cast<CoverageHint>(b)));
    }
  }
}
