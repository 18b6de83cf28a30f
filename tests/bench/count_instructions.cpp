// SPDX-License-Identifier: MIT
/// What a processor without a clock to trust has to do: detection of lines in windows of 20000 and 100000 events, and
/// iterations of the refinement of 25 lines. Calls mark() in between, where QEMU's plugin (tests/cross/count_plugin.c)
/// counts instructions; tests/cross/instructions runs it. Static memory, no operating system needed.
#include <cstddef>

#include "board.hpp"
#include "lecalib/core/rng.hpp"
#include "lecalib/pipeline/line_detector.hpp"
#include "lecalib/pipeline/mono_solver.hpp"
#include "text.hpp"

extern "C" [[gnu::noinline, gnu::used]] void mark() { __asm__ volatile("" ::: "memory"); }

namespace {

using namespace lecalib;

constexpr std::uint16_t kWidth = 640, kHeight = 480;
constexpr std::int64_t kLengthUs = 10000;
constexpr std::size_t kSizes[] = {20000, 100000};
constexpr std::size_t kMaxEvents = 100000;
constexpr std::size_t kEdges = 20;

constexpr DetectorCapacities kCapacities = [] {
  DetectorCapacities c;
  c.events = kMaxEvents, c.lines = 48, c.width = kWidth, c.height = kHeight;
  c.surface_points = c.regions = c.image_cells = 0;
  return c;
}();
constexpr MonoSolverCapacities kSolverCapacities{1, 50, 25};

Event events[kMaxEvents];
alignas(kArenaAlign) std::byte detector_memory[detector_bytes(kCapacities)];
alignas(kArenaAlign) std::byte solver_memory[required_bytes(kSolverCapacities)];
MonoSolver solver;

double normal(Rng* rng) {
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += rng->uniform();
  return sum;
}

/// Edges that move by 6 px in the window, in order of time; a fifth of the events is noise.
void make_window(std::size_t count) {
  Rng rng(7);
  Segment edges[kEdges];
  for (Segment& edge : edges) {
    edge.x1 = static_cast<float>(rng.uniform(20, kWidth - 20));
    edge.y1 = static_cast<float>(rng.uniform(20, kHeight - 20));
    edge.x2 = static_cast<float>(rng.uniform(20, kWidth - 20));
    edge.y2 = static_cast<float>(rng.uniform(20, kHeight - 20));
  }
  for (std::size_t i = 0; i < count; ++i) {
    const double tau = static_cast<double>(i) / static_cast<double>(count);
    double x = rng.uniform(0, kWidth - 1);
    double y = rng.uniform(0, kHeight - 1);
    const std::uint32_t chosen = rng.below(kEdges);
    const Segment& edge = edges[chosen];
    if (rng.below(5) > 0) {
      const double along = rng.uniform();
      const double shift = 6 * tau + 0.4 * normal(&rng);
      x = static_cast<double>(edge.x1) + along * (static_cast<double>(edge.x2) - static_cast<double>(edge.x1)) + shift;
      y = static_cast<double>(edge.y1) + along * (static_cast<double>(edge.y2) - static_cast<double>(edge.y1)) + shift;
    }
    events[i] = {static_cast<std::int64_t>(tau * kLengthUs), static_cast<std::uint16_t>(x + 0.5),
                 static_cast<std::uint16_t>(y + 0.5), static_cast<std::uint8_t>(chosen & 1)};
  }
}

void detect(std::size_t count) {
  make_window(count);
  Arena arena(detector_memory);
  DetectorWorkspace workspace;
  if (!carve(arena, kCapacities, &workspace)) return;
  DetectorOptions options;
  options.cloud.width = kWidth, options.cloud.height = kHeight;
  EventLine lines[48];
  std::size_t num_lines = 0;
  mark();
  const Status status = detect_lines({0, kLengthUs, {events, count}}, options, &workspace, lines, &num_lines, nullptr);
  mark();
  Text text;
  text.add("detect ").add(std::uint64_t{count}).add(" events ").add(std::uint64_t{num_lines}).add(" lines ");
  board::print(text.add(to_string(status)).add("\n").c_str());
}

void refine() {
  Rng rng(11);
  ModelLine model[25];
  LinePoint points[50];
  Pose pose;
  pose.t[2] = 3.5;
  for (std::size_t i = 0; i < 25; ++i) {
    for (double* end : {model[i].p, model[i].q}) {
      end[0] = rng.uniform(-1.2, 1.2);
      end[1] = rng.uniform(-1, 1);
      end[2] = rng.uniform(-1, 1);
      LinePoint& point = points[2 * i + (end == model[i].q ? 1 : 0)];
      point.u_px = 319.5 + 400 * end[0] / (end[2] + pose.t[2]) + normal(&rng);
      point.v_px = 239.5 + 400 * end[1] / (end[2] + pose.t[2]) + normal(&rng);
      point.sigma_px = 1;
      point.line = static_cast<std::uint16_t>(i);
    }
  }
  const View view = {0, 0, 50};
  Camera camera;
  camera.width = kWidth, camera.height = kHeight;
  camera.fx = camera.fy = 380, camera.cx = 319.5, camera.cy = 239.5;
  const CalibrationData data = {kWidth, kHeight, model, points, {&view, 1}};
  const MonoStart start = {camera, {&pose, 1}};
  Arena arena(solver_memory);
  MonoSolverWorkspace workspace;
  if (!carve(arena, kSolverCapacities, &workspace)) return;
  Status status = solver.init(data, {}, workspace, start);
  while (status == Status::ok || status == Status::in_progress) {
    mark();
    status = solver.step();
    mark();
    board::print(Text().add("refine step ").add(to_string(status)).add("\n").c_str());
    if (status == Status::ok) break;
  }
}

}  // namespace

int main() {
  for (const std::size_t count : kSizes) detect(count);
  refine();
  return 0;
}
