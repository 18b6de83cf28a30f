// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "lecalib/core/arena.hpp"
#include "lecalib/core/rng.hpp"
#include "lecalib/segments/plane_lines.hpp"
#include "lecalib/segments/plane_projection.hpp"
#include "lecalib/segments/segment_detector.hpp"
#include "support/guarded_arena.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

/// A plane that an edge sweeps: moving 6 px down in 8 px of depth, the edge along (0.8, 0.6).
EventPlane tilted_plane() {
  const float nx = 0.6F;
  const float ny = -0.8F;
  const float nz = 0.5F;
  const float norm = std::sqrt(1 + nz * nz);
  return {{100, 90, 4}, {nx / norm, ny / norm, nz / norm}, 0.5F, 0, 0, 1};
}

double dot(const Point3& a, const Point3& b) {
  return double{a.x} * double{b.x} + double{a.y} * double{b.y} + double{a.z} * double{b.z};
}

/// Points evenly spread over x in [low, high), y in [0, height).
void fill(double low, double high, double height, double per_px2, Rng* rng, std::vector<PlanePoint>* points) {
  const auto n = static_cast<std::size_t>((high - low) * height * per_px2);
  for (std::size_t i = 0; i < n; ++i) {
    const auto x = static_cast<float>(rng->uniform(low, high));
    const auto y = static_cast<float>(rng->uniform(0, height));
    points->push_back({x, y});
  }
}

struct Finder {
  explicit Finder(std::size_t cells = 8192) : memory(bytes(cells)), rims(64) {
    REQUIRE(carve(memory.arena(), SegmentCapacities{cells}, &workspace));
  }
  static std::size_t bytes(std::size_t cells) {
    ArenaMeter meter;
    SegmentWorkspace unused;
    (void)carve(meter, SegmentCapacities{cells}, &unused);
    return meter.peak();
  }
  Status find(const std::vector<PlanePoint>& points, const SegmentOptions& options = {}) {
    std::size_t count = 0;
    rims.resize(64);
    const Status status = find_plane_segments(points, options, workspace, rims, &count, &stats);
    rims.resize(count);
    return status;
  }
  GuardedArena memory;
  SegmentWorkspace workspace;
  std::vector<PlaneSegment> rims;
  SegmentStats stats;
};

}  // namespace

TEST_CASE("projection: the axes are unit, v_x runs in constant time, v_y = v_x x n (eq. 2)") {
  const EventPlane plane = tilted_plane();
  PlaneFrame frame{};
  REQUIRE(make_plane_frame(plane, &frame));
  CHECK(dot(frame.v_x, frame.v_x) == doctest::Approx(1));
  CHECK(dot(frame.v_y, frame.v_y) == doctest::Approx(1));
  CHECK(dot(frame.v_x, frame.v_y) == doctest::Approx(0));
  CHECK(dot(frame.v_x, plane.normal) == doctest::Approx(0));
  CHECK(dot(frame.v_y, plane.normal) == doctest::Approx(0));
  CHECK(frame.v_x.z == 0);
}

TEST_CASE("projection: leaves out the part along the normal and comes back (eq. 3)") {
  const EventPlane plane = tilted_plane();
  PlaneFrame frame{};
  REQUIRE(make_plane_frame(plane, &frame));
  const std::vector<Point3> points = {{100, 90, 4}, {140, 70, 1}, {93, 120, 8}};
  std::vector<PlanePoint> projected(points.size());
  project_to_plane(frame, points, projected);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point3 back = from_plane(frame, projected[i]);
    const Point3 off{points[i].x - back.x, points[i].y - back.y, points[i].z - back.z};
    CHECK(dot(off, frame.v_x) == doctest::Approx(0).epsilon(1e-4));
    CHECK(dot(off, frame.v_y) == doctest::Approx(0).epsilon(1e-4));
    const Point3 from_centre{points[i].x - plane.centre.x, points[i].y - plane.centre.y, points[i].z - plane.centre.z};
    CHECK(dot(off, plane.normal) == doctest::Approx(dot(from_centre, plane.normal)).epsilon(1e-4));
  }
}

TEST_CASE("projection: a plane of constant time holds no line at one time") {
  EventPlane flash = tilted_plane();
  flash.normal = {0, 0, 1};
  PlaneFrame frame{};
  CHECK_FALSE(make_plane_frame(flash, &frame));
}

TEST_CASE("segments: the rims of an evenly filled rectangle are found where they are") {
  Rng rng(5);
  for (const double per_px2 : {0.3, 1.0, 4.0}) {
    std::vector<PlanePoint> points;
    fill(-60, 80, 16, per_px2, &rng, &points);
    Finder finder;
    REQUIRE(finder.find(points) == Status::ok);
    double low_length = 0;
    double high_length = 0;
    for (const PlaneSegment& rim : finder.rims) {
      if (std::fabs(rim.normal_y) < 0.9F) continue;
      const bool is_low = rim.normal_y > 0;
      (is_low ? low_length : high_length) += std::fabs(double{rim.b.x} - double{rim.a.x});
      CHECK(std::fabs(0.5F * (rim.a.y + rim.b.y) - (is_low ? 0 : 16)) < 1.5F);
    }
    CHECK(std::fabs(low_length - 140) < 15);
    CHECK(std::fabs(high_length - 140) < 15);
  }
}

TEST_CASE("segments: gaps split collinear edges") {
  Rng rng(6);
  std::vector<PlanePoint> points;
  fill(0, 60, 10, 1, &rng, &points);
  fill(90, 170, 10, 1, &rng, &points);
  Finder finder;
  REQUIRE(finder.find(points) == Status::ok);
  PlaneFrame frame{};
  const EventPlane plane = tilted_plane();
  REQUIRE(make_plane_frame(plane, &frame));
  frame.origin.z = 0;
  std::vector<PlaneLine> lines(8);
  std::uint32_t dropped = 0;
  const std::size_t count = lines_of_plane(plane, frame, 8, finder.rims, lines, &dropped);
  CHECK(count == 2);
  CHECK(dropped == 0);
  for (std::size_t i = 0; i < count; ++i) {
    const Segment& s = lines[i].begin;
    const float length = std::hypot(s.x2 - s.x1, s.y2 - s.y1);
    CHECK(length > 45);
    CHECK(length < 95);
  }
  CHECK(lines_of_plane(plane, frame, 8, finder.rims, Span<PlaneLine>(lines.data(), 1), &dropped) == 1);
  CHECK(dropped == 1);
}

TEST_CASE("segments: back-projected lines stand at the window's begin and end, on the plane") {
  const EventPlane plane = tilted_plane();
  PlaneFrame frame{};
  REQUIRE(make_plane_frame(plane, &frame));
  const float to_begin = -plane.centre.z / frame.v_y.z;
  const float to_end = (8 - plane.centre.z) / frame.v_y.z;
  const float early_normal = frame.v_y.z > 0 ? 1.0F : -1.0F;
  const std::vector<PlaneSegment> rims = {{{-30, to_begin}, {40, to_begin}, 2, 0, early_normal},
                                          {{42, to_end}, {-28, to_end}, 2, 0, -early_normal},
                                          {{-30, to_begin}, {-28, to_end}, 2, 1, 0}};
  std::vector<PlaneLine> lines(4);
  std::uint32_t dropped = 0;
  REQUIRE(lines_of_plane(plane, frame, 8, rims, lines, &dropped) == 1);
  const PlaneLine& line = lines[0];
  CHECK(line.polarity == 1);
  for (const Point3& p : {Point3{line.begin.x1, line.begin.y1, 0}, Point3{line.begin.x2, line.begin.y2, 0},
                          Point3{line.end.x1, line.end.y1, 8}, Point3{line.end.x2, line.end.y2, 8}}) {
    const Point3 from_centre{p.x - plane.centre.x, p.y - plane.centre.y, p.z - plane.centre.z};
    CHECK(dot(from_centre, plane.normal) == doctest::Approx(0).epsilon(1e-3));
  }
  CHECK(std::hypot(line.begin.x2 - line.begin.x1, line.begin.y2 - line.begin.y1) == doctest::Approx(72).epsilon(1e-3));
}

TEST_CASE("segments: areas larger than the image get larger cells, and arguments are checked") {
  Rng rng(7);
  std::vector<PlanePoint> points;
  fill(-700, 700, 30, 2, &rng, &points);
  Finder small(256);
  CHECK(small.find(points) == Status::ok);
  CHECK(small.find({}) == Status::invalid_argument);
  SegmentOptions options;
  options.min_cell_px = 0;
  CHECK(small.find(points, options) == Status::invalid_argument);
  Finder too_small(63);
  CHECK(too_small.find(points) == Status::buffer_too_small);
  Finder too_large(65536);
  CHECK(too_large.find(points) == Status::invalid_argument);
}
