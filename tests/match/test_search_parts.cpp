// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "lecalib/match/bend_distortion.hpp"
#include "lecalib/match/bounded_best.hpp"
#include "lecalib/match/contrast_votes.hpp"
#include "lecalib/match/image_quads.hpp"
#include "lecalib/match/line_assignment.hpp"
#include "lecalib/match/pose_refinement.hpp"
#include "lecalib/match/quad_pose.hpp"
#include "lecalib/match/track_comparison.hpp"
#include "synthetic_scene.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

Camera pinhole(double f) {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = f;
  camera.cx = 319.5;
  camera.cy = 239.5;
  return camera;
}

/// What find_image_quads() needs.
struct QuadMemory {
  ImageQuadWorkspace workspace;
  std::vector<std::max_align_t> memory;
  explicit QuadMemory(const ImageQuadCapacities& capacities) : memory(64 * 1024 / sizeof(std::max_align_t)) {
    Arena arena({reinterpret_cast<std::byte*>(memory.data()), memory.size() * sizeof(std::max_align_t)});
    REQUIRE(carve(arena, capacities, &workspace));
  }
};

EventLine line_between(double x1, double y1, double x2, double y2) {
  const Segment segment = segment_of(Vec2(x1, y1), Vec2(x2, y2));
  return {segment, segment, 0.F, 0.1F, 0.1F, 100, 1};
}

std::vector<FlatLine> flat(const std::vector<EventLine>& lines) {
  std::vector<FlatLine> out(lines.size());
  flatten_lines(Lens{400.0, 319.5, 239.5, 0.0}, Span<const EventLine>(lines), Span<FlatLine>(out));
  return out;
}

}  // namespace

TEST_CASE("BoundedBest keeps the best in order and counts the rest") {
  int storage[3];
  BoundedBest<int> best{Span<int>(storage)};
  for (const int value : {4, 9, 1, 7, 9, 2}) best.offer(value, [](int a, int b) { return a > b; });
  CHECK(best.size() == 3);
  CHECK(best[0] == 9);
  CHECK(best[1] == 9);
  CHECK(best[2] == 7);
  CHECK(best.dropped() == 3);
  BoundedBest<int> none;
  none.offer(1, [](int a, int b) { return a > b; });
  CHECK(none.size() == 0);
  CHECK(none.dropped() == 1);
}

TEST_CASE("unflatten undoes flatten, and flatten's derivatives are central differences") {
  const Lens lens{400.0, 330.0, 235.0, -1.5e-6};
  for (const Vec2& pixel : {Vec2(10, 20), Vec2(330, 235), Vec2(600, 400)}) {
    Vec2 point;
    Eigen::Matrix<double, 2, 3> d_lens;
    REQUIRE(flatten(lens, pixel, &point, &d_lens));
    CHECK((unflatten(lens, point) - pixel).norm() < 1e-9);
    double Lens::*const parameters[] = {&Lens::lambda, &Lens::cx, &Lens::cy};
    const double steps[] = {1e-11, 1e-4, 1e-4};
    for (int i = 0; i < 3; ++i) {
      Lens up = lens;
      Lens down = lens;
      up.*parameters[i] += steps[i];
      down.*parameters[i] -= steps[i];
      Vec2 high;
      Vec2 low;
      REQUIRE(flatten(up, pixel, &high));
      REQUIRE(flatten(down, pixel, &low));
      const Vec2 numeric = (high - low) / (2.0 * steps[i]);
      CHECK((numeric - d_lens.col(i)).norm() <= 1e-5 * (1.0 + numeric.norm()));
    }
  }
  Vec2 untouched(1, 2);
  CHECK_FALSE(flatten(Lens{400, 0, 0, -1e-5}, Vec2(600, 0), &untouched));
  CHECK(untouched == Vec2(1, 2));
}

TEST_CASE("Brown's and the division model agree where they were fitted to each other") {
  Camera camera = pinhole(500.0);
  camera.k1 = -0.2;
  camera.k2 = 0.03;
  const Lens lens = division_lens(camera, 350.0);
  const Camera back = brown_camera(lens, 640, 480, 350.0);
  for (double r = 50.0; r <= 350.0; r += 50.0) {
    Vec2 ideal;
    Vec2 point;
    REQUIRE(unproject(camera, Vec2(camera.cx + r, camera.cy), &ideal));
    REQUIRE(flatten(lens, Vec2(camera.cx + r, camera.cy), &point));
    CHECK(std::abs(point.x() - 500.0 * ideal.x()) < 1.5);
    Vec2 pixel;
    REQUIRE(project(back, Vec3(ideal.x(), 0, 1), &pixel));
    CHECK(std::abs(pixel.x() - camera.cx - r) < 1.5);
  }
}

TEST_CASE("bends of straight lines tell the distortion, straight lines tell that there is none") {
  for (const double k1 : {0.0, -0.15, -0.3}) {
    CAPTURE(k1);
    SceneOptions options;
    options.camera = pinhole(450.0);
    options.camera.k1 = k1;
    options.model = box_model(0.4, 0.3, 0.25);
    options.clutter = 0;
    options.noise_px = 0.1;
    const Scene scene = make_scene(options);
    BendVotes votes;
    votes.init(640, 480, 1.0);
    CHECK(votes.lambda() == doctest::Approx(0.0));
    for (const std::vector<EventLine>& lines : scene.lines) votes.add(Span<const EventLine>(lines));
    CHECK(std::abs(votes.lambda() * 450.0 * 450.0 - k1) < 0.06);
  }
}

TEST_CASE("a quadrilateral is found with one open corner and a broken side, and only once") {
  std::vector<EventLine> lines = {line_between(100, 100, 400, 110), line_between(402, 112, 390, 400),
                                  line_between(388, 401, 250, 396), line_between(240, 395, 110, 390),
                                  line_between(108, 380, 99, 150),  line_between(500, 50, 620, 60)};
  QuadMemory memory({});
  ImageQuadStats stats;
  const std::vector<FlatLine> points = flat(lines);
  const Span<const ImageQuad> quads = find_image_quads(Span<const FlatLine>(points), {}, &memory.workspace, &stats);
  REQUIRE(quads.size() >= 1);
  CHECK(quads[0].covered_px > 1050.0);
  CHECK(stats.quads_dropped == 0);
  for (std::size_t i = 1; i < quads.size(); ++i) CHECK(quads[i].covered_px < quads[0].covered_px);

  QuadMemory small({6, 3, 1});
  ImageQuadStats dropped;
  static_cast<void>(find_image_quads(Span<const FlatLine>(points), {}, &small.workspace, &dropped));
  CHECK(dropped.edges_dropped > 0);
}

TEST_CASE("a quadrilateral's lines may go on behind its corners, less far end before them") {
  // Of a square of 300 px: how far each line goes on at each end, and whether that is taken.
  struct Case {
    double beyond_px;
    bool found;
  };
  for (const Case& c : {Case{0.0, true}, {100.0, true}, {350.0, false}, {-25.0, true}, {-60.0, false}}) {
    CAPTURE(c.beyond_px);
    const double low = 100.0 - c.beyond_px;
    const double high = 400.0 + c.beyond_px;
    const std::vector<EventLine> lines = {line_between(low, 100, high, 100), line_between(400, low, 400, high),
                                          line_between(high, 400, low, 400), line_between(100, high, 100, low)};
    QuadMemory memory({});
    ImageQuadStats stats;
    const std::vector<FlatLine> points = flat(lines);
    CHECK(find_image_quads(Span<const FlatLine>(points), {}, &memory.workspace, &stats).size() == (c.found ? 1 : 0));
  }
}

TEST_CASE("one labeling of a face gives its focal length and pose, a wrong range gives none") {
  const Camera camera = pinhole(600.0);
  const std::vector<ModelLine> model = rectangle_model(0.297, 0.21);
  std::vector<ModelQuad> storage(4);
  std::vector<ModelSides> sides(4);
  ModelGraph graph;
  REQUIRE(build_model_graph(Span<const ModelLine>(model), {}, Span<ModelQuad>(storage), Span<ModelSides>(sides),
                            &graph) == Status::ok);
  const Pose pose = look_at(Vec3(-0.2, -0.3, 0.35), Vec3(0.15, 0.1, 0.0), 0.2);
  ImageQuad quad{};
  for (int i = 0; i < 4; ++i) {
    Vec2 pixel;
    REQUIRE(image_of(camera, pose, Eigen::Map<const Vec3>(graph.quads[0].corner[i]), &pixel));
    Eigen::Map<Vec2>(quad.corner[i]) = pixel - Vec2(319.5, 239.5);
  }
  QuadPoseOptions options;
  options.focal = {150.0, 1900.0};
  double closest = 1e9;
  for (int labeling = 0; labeling < kNumQuadLabelings; ++labeling) {
    PoseGuess guesses[kMaxQuadGuesses];
    const std::size_t count = guess_poses(quad, graph.quads[0], labeling, options, guesses);
    for (std::size_t g = 0; g < count; ++g) {
      const Mat3 R = Eigen::Map<const RowMat3>(guesses[g].R);
      closest = std::min(closest, (R - rotation_of(pose)).norm() + std::abs(guesses[g].f_px / 600.0 - 1.0));
    }
  }
  CHECK(closest < 0.05);
  // All of the views that a search may be asked for, 160 to 5 degrees, where the long end is this view's.
  options.focal = {600.0 / 120.0, 600.0 * 1.08};
  closest = 1e9;
  for (int labeling = 0; labeling < kNumQuadLabelings; ++labeling) {
    PoseGuess guesses[kMaxQuadGuesses];
    const std::size_t count = guess_poses(quad, graph.quads[0], labeling, options, guesses);
    for (std::size_t g = 0; g < count; ++g) closest = std::min(closest, std::abs(guesses[g].f_px / 600.0 - 1.0));
  }
  CHECK(closest < 0.1);
  options.focal = {3000.0, 4000.0};
  PoseGuess guesses[kMaxQuadGuesses];
  for (int labeling = 0; labeling < kNumQuadLabelings; ++labeling) {
    CHECK(guess_poses(quad, graph.quads[0], labeling, options, guesses) == 0);
  }
}

TEST_CASE("lens and poses are refined to the truth from noise-free lines") {
  SceneOptions options;
  options.camera = pinhole(520.0);
  options.model = box_model(0.4, 0.3, 0.25);
  options.clutter = 0;
  options.missing = 0.0;
  options.broken = 0.0;
  options.noise_px = 0.0;
  options.windows = 4;
  Scene scene = make_scene(options);
  std::vector<std::vector<LineMatch>> matches(4);
  std::vector<Pose> poses(4);
  std::vector<LensView> views;
  for (std::size_t w = 0; w < 4; ++w) {
    // The same image at both ends: the middle is then exact, too.
    for (EventLine& line : scene.lines[w]) line.end = line.begin;
    for (std::size_t i = 0; i < scene.lines[w].size(); ++i) {
      matches[w].push_back({static_cast<std::uint16_t>(w), static_cast<std::uint16_t>(i),
                            static_cast<std::uint16_t>(scene.truth[w][i]), false});
      scene.lines[w][i].bend_px = 0.F;
    }
    const Mat3 turn = so3_exp(Vec3(0.02, -0.01, 0.015));
    poses[w] = make_pose(turn * rotation_of(scene.begin[w]), 1.03 * translation_of(scene.begin[w]));
    views.push_back({Span<const EventLine>(scene.lines[w]), Span<const LineMatch>(matches[w]), &poses[w]});
  }
  LensPrior prior;
  prior.mean = {480.0, 319.5, 239.5, 0.0};
  prior.sigma = {1e4, 1e3, 1e3, 1e-3};
  Lens lens = prior.mean;
  std::vector<LensViewSystem> systems(4);
  double cost = 0.0;
  for (int step = 0; step < 30; ++step) {
    REQUIRE(refine_lens_step(Span<const ModelLine>(options.model), Span<const LensView>(views), prior, {},
                             Span<LensViewSystem>(systems), &lens, &cost));
  }
  CHECK(lens.f_px == doctest::Approx(520.0).epsilon(1e-3));
  CHECK(lens.cx == doctest::Approx(319.5).epsilon(2e-3));
  for (std::size_t w = 0; w < 4; ++w) {
    CHECK((rotation_of(poses[w]) - rotation_of(scene.begin[w])).norm() < 2e-3);
    CHECK((translation_of(poses[w]) - translation_of(scene.begin[w])).norm() < 2e-3);
  }

  SUBCASE("a sigma of zero holds its parameter") {
    prior.sigma.cx = prior.sigma.lambda = 0.0;
    lens.cx = 300.0;
    REQUIRE(refine_lens_step(Span<const ModelLine>(options.model), Span<const LensView>(views), prior, {},
                             Span<LensViewSystem>(systems), &lens, &cost));
    CHECK(lens.cx == 300.0);
  }
}

TEST_CASE("contrast: polarity times motion, the same for either order of the end points' motion") {
  EventLine line = line_between(100, 100, 200, 100);
  line.end.y1 += 5.F;
  line.end.y2 += 5.F;
  const int moving_down_on = contrast_of(line, 1.0);
  CHECK(moving_down_on != 0);
  EventLine back = line;
  std::swap(back.begin, back.end);
  back.polarity = -1;
  CHECK(contrast_of(back, 1.0) == moving_down_on);  // the same edge on its way back
  EventLine turned = line;
  std::swap(turned.begin.x1, turned.begin.x2);
  std::swap(turned.end.x1, turned.end.x2);
  CHECK(contrast_of(turned, 1.0) == -moving_down_on);
  CHECK(contrast_of(line, 6.0) == 0);
  line.polarity = 0;
  CHECK(contrast_of(line, 1.0) == 0);

  CHECK(decided_contrast({5, 1}) == 1);
  CHECK(decided_contrast({1, 5}) == -1);
  CHECK(decided_contrast({3, 0}) == 0);
  CHECK(decided_contrast({5, 3}) == 0);
}

TEST_CASE("edges that slide along themselves are no edges that could have been found") {
  // A sheet 0.4 x 0.3 m, 1 m ahead of a camera with f = 400: sides of 160 and 120 px, each of weight 1 on its own.
  std::vector<ModelLine> model = rectangle_model(0.4, 0.3);
  ModelQuad quads[4];
  ModelSides sides[4];
  ModelGraph graph;
  REQUIRE(build_model_graph(model, {}, quads, sides, &graph) == Status::ok);
  const FlatFrame frame = {-319.5, -239.5, 319.5, 239.5};
  // What a pose says when the sheet moves by `dx`, `dy` px from the window's begin to its end.
  const auto silent = [&](double dx, double dy, Span<const Assignment> taken) {
    Pose poses[kNumInstants];
    for (int k = 0; k < 3; ++k) {
      poses[k].t[0] = -0.2 + 0.5 * (k - 1) * dx / 400.0;
      poses[k].t[1] = -0.15 + 0.5 * (k - 1) * dy / 400.0;
      poses[k].t[2] = 1.0;
    }
    return silent_weight(graph, poses, 400.0, frame, 1.0, taken);
  };
  CHECK(silent(0.0, 0.0, {}) == doctest::Approx(4.0));
  CHECK(silent(20.0, 0.0, {}) == doctest::Approx(2.0));  // the two sides along x
  CHECK(silent(20.0, 0.9, {}) == doctest::Approx(2.0));
  CHECK(silent(20.0, 2.0, {}) == doctest::Approx(1.0));  // half way from silent to loud
  CHECK(silent(20.0, 3.1, {}) == doctest::Approx(0.0));
  const Assignment found[] = {{0, 0, false, 0.0, 160.0, 0.1, 160.0}};
  CHECK(silent(20.0, 0.0, found) == doctest::Approx(1.0));  // whatever was found made events
}

TEST_CASE("track_comparison: a model lies alike when it is turned by a symmetry of it, and by no other turn") {
  const auto lies_alike = [](double depth, const Vec3& turn, double further, bool up_to_symmetry) {
    // All twelve edges of a box, about its centre.
    std::vector<ModelLine> model;
    const double size[3] = {0.4, 0.25, depth};
    for (int along = 0; along < 3; ++along) {
      for (int corner = 0; corner < 4; ++corner) {
        ModelLine line{};
        line.p[(along + 1) % 3] = line.q[(along + 1) % 3] = (corner % 2 - 0.5) * size[(along + 1) % 3];
        line.p[(along + 2) % 3] = line.q[(along + 2) % 3] = (corner / 2 - 0.5) * size[(along + 2) % 3];
        line.p[along] = -0.5 * size[along];
        line.q[along] = 0.5 * size[along];
        model.push_back(line);
      }
    }
    std::vector<ModelQuad> quads(16);
    std::vector<ModelSides> sides(model.size());
    ModelGraph graph;
    REQUIRE(build_model_graph(Span<const ModelLine>(model), {}, Span<ModelQuad>(quads), Span<ModelSides>(sides),
                              &graph) == Status::ok);
    const Mat3 R = so3_exp(Vec3(0.5, -0.3, 0.2));
    return is_same_placement(graph, make_pose(R, Vec3(0, 0, 1)), make_pose(R * so3_exp(turn), Vec3(0, 0, 1 + further)),
                             0.1, up_to_symmetry);
  };
  constexpr double kHalf = 3.14159265358979;
  CHECK(lies_alike(0.15, Vec3(0, 0, 0.05), 0.1, false));
  CHECK_FALSE(lies_alike(0.15, Vec3(0, 0, 0.15), 0.0, true));
  CHECK_FALSE(lies_alike(0.15, Vec3(0, 0, 0), 0.3, true));
  for (int axis = 0; axis < 3; ++axis) {
    CHECK(lies_alike(0.15, kHalf * Vec3::Unit(axis), 0.0, true));
    CHECK_FALSE(lies_alike(0.15, kHalf * Vec3::Unit(axis), 0.0, false));
  }
  const Vec3 quarter = 0.5 * kHalf * Vec3::UnitX();
  CHECK_FALSE(lies_alike(0.15, quarter, 0.0, true));
  CHECK_FALSE(lies_alike(0.24, quarter, 0.0, true));  // nearly: another camera
  CHECK(lies_alike(0.25, quarter, 0.0, true));
}
