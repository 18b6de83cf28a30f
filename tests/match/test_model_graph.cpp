// SPDX-License-Identifier: MIT
#include "lecalib/match/model_graph.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "synthetic_scene.hpp"

using namespace lecalib;
using namespace lecalib::test;

namespace {

/// All twelve edges: the nine of box_model() and those behind.
std::vector<ModelLine> closed_box(double a, double b, double c) {
  std::vector<ModelLine> lines = box_model(a, b, c);
  lines.push_back({{a, b, 0}, {a, 0, 0}});
  lines.push_back({{a, b, 0}, {0, b, 0}});
  lines.push_back({{a, b, 0}, {a, b, c}});
  return lines;
}

struct Graph {
  explicit Graph(std::vector<ModelLine> model, std::size_t max_quads = 16)
      : lines(std::move(model)), quads(max_quads), sides(lines.size()) {
    status =
        build_model_graph(Span<const ModelLine>(lines), {}, Span<ModelQuad>(quads), Span<ModelSides>(sides), &graph);
  }
  std::vector<ModelLine> lines;
  std::vector<ModelQuad> quads;
  std::vector<ModelSides> sides;
  ModelGraph graph;
  Status status;
};

std::size_t count_hidden(const ModelGraph& graph, double x, double y, double z) {
  const double eye[3] = {x, y, z};
  std::size_t count = 0;
  for (std::size_t j = 0; j < graph.lines.size(); ++j) count += is_hidden(graph, j, eye) ? 1 : 0;
  return count;
}

}  // namespace

TEST_CASE("faces of a sheet, a box and a closed box") {
  const Graph sheet(rectangle_model(0.297, 0.21));
  REQUIRE(sheet.status == Status::ok);
  REQUIRE(sheet.graph.quads.size() == 1);
  CHECK(sheet.graph.quads[0].closed);
  CHECK(sheet.graph.quads[0].area_m2 == doctest::Approx(0.297 * 0.21));

  const Graph box(box_model(0.4, 0.3, 0.25));
  REQUIRE(box.status == Status::ok);
  REQUIRE(box.graph.quads.size() == 3);
  CHECK(box.graph.quads[0].area_m2 == doctest::Approx(0.12));
  CHECK(box.graph.quads[2].area_m2 == doctest::Approx(0.075));
  CHECK(box.graph.extent_m == doctest::Approx(std::sqrt(0.16 + 0.09 + 0.0625)));

  const Graph closed(closed_box(0.4, 0.3, 0.25));
  REQUIRE(closed.status == Status::ok);
  CHECK(closed.graph.quads.size() == 6);
}

TEST_CASE("a side's corners lie on its line, in order around the face") {
  const Graph box(closed_box(0.4, 0.3, 0.25));
  for (const ModelQuad& quad : box.graph.quads) {
    for (int i = 0; i < 4; ++i) {
      const ModelLine& line = box.lines[quad.line[i]];
      const Vec3 p = Eigen::Map<const Vec3>(line.p);
      const Vec3 d = (Eigen::Map<const Vec3>(line.q) - p).normalized();
      for (const int c : {(i + 3) % 4, i}) {
        CHECK((Eigen::Map<const Vec3>(quad.corner[c]) - p).cross(d).norm() < 1e-12);
      }
    }
  }
}

TEST_CASE("a solid hides the edges behind it, a sheet and a room hide nothing") {
  const Graph closed(closed_box(0.4, 0.3, 0.25));
  CHECK(count_hidden(closed.graph, -1.0, -1.0, 1.0) == 3);  // three faces seen
  CHECK(count_hidden(closed.graph, 0.2, -1.0, 1.0) == 5);   // two faces
  CHECK(count_hidden(closed.graph, 0.2, -1.0, 0.1) == 8);   // one face
  CHECK(count_hidden(closed.graph, 0.2, 0.15, 0.1) == 0);   // from inside
  const Graph sheet(rectangle_model(0.297, 0.21));
  CHECK(count_hidden(sheet.graph, 0.1, 0.1, 1.0) == 0);
  CHECK(count_hidden(sheet.graph, 0.1, 0.1, -1.0) == 0);
  const Graph open(box_model(0.4, 0.3, 0.25));
  CHECK(count_hidden(open.graph, -1.0, -1.0, 1.0) == 0);
}

TEST_CASE("the largest faces stay, the others are counted") {
  const Graph closed(closed_box(0.4, 0.3, 0.25), 2);
  REQUIRE(closed.status == Status::ok);
  REQUIRE(closed.graph.quads.size() == 2);
  CHECK(closed.graph.quads[1].area_m2 == doctest::Approx(0.12));
  CHECK(closed.graph.quads_dropped == 4);
}

TEST_CASE("models that cannot be used") {
  CHECK(Graph({}).status == Status::too_few_lines);
  std::vector<ModelLine> bad = rectangle_model(1.0, 1.0);
  bad[2].p[0] = std::numeric_limits<double>::infinity();
  CHECK(Graph(bad).status == Status::invalid_argument);
  ModelGraph graph;
  std::vector<ModelLine> good = rectangle_model(1.0, 1.0);
  std::vector<ModelSides> sides(4);
  ModelGraphOptions options;
  options.corner_tolerance = 0.0;
  CHECK(build_model_graph(Span<const ModelLine>(good), options, {}, Span<ModelSides>(sides), &graph) ==
        Status::invalid_argument);
}
