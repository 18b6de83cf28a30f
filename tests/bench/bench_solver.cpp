// SPDX-License-Identifier: MIT
/// What calibration from measured points costs and how well it does, side by side: a change that makes it faster by
/// giving worse cameras shows.
///
///     bench_solver [--quick]
///
/// CPU time of one thread from observations to covariance, median over trials; the error of fx is in its own reported
/// sigmas, rms, 1 where these are true. The exit code is 1 when an answer is missing that should be there; times are
/// for the reader.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <vector>

#include "lecalib/host/cpu_clock.hpp"
#include "lecalib/host/heap_arena.hpp"
#include "lecalib/pipeline/mono_solver.hpp"
#include "support/synthetic_views.hpp"

namespace {

using namespace lecalib;

struct Scene {
  const char* name;
  int views, lines, points_per_line;
  double depth;        ///< half extent of the model across its plane; 0: a plane
  double wrong_share;  ///< of the lines, replaced by random ones
};

struct Outcome {
  double median_us = 0.0;
  double error_in_sigmas = 0.0;
  int solved = 0;
};

test::SyntheticViews make_views(const Scene& scene, std::uint64_t seed) {
  Rng rng(seed);
  test::SyntheticViews s;
  s.camera = test::make_camera(400.0, 400.0, 319.5, 239.5, -0.1, -0.02);
  s.model = test::random_lines(rng, scene.lines, 1.6, 1.2, scene.depth);
  for (int v = 0; v < scene.views; ++v) {
    // Tilted by 0.3 rad at least: a plane seen frontally tells no focal length.
    const Pose pose = test::looking_pose(rng, 3.5, 0.3);
    s.add_view(make_pose(so3_exp(Vec3(0.5, v % 2 == 0 ? 0.5 : -0.5, 0.0)) * rotation_of(pose), translation_of(pose)),
               scene.points_per_line, 1.0, 1.0, rng);
  }
  for (LinePoint& point : s.points) {
    if (point.line >= scene.wrong_share * scene.lines) continue;
    point.u_px = rng.uniform(0.0, 640.0);
    point.v_px = rng.uniform(0.0, 480.0);
  }
  return s;
}

/// CPU microseconds from observations to covariance.
double solve(const CalibrationData& data, MonoSolver* solver) {
  const MonoSolverCapacities capacities{data.views.size(), data.points.size(), data.model.size()};
  const host::HeapArena block(required_bytes(capacities));
  Arena arena(block.memory());
  MonoSolverWorkspace workspace;
  if (!carve(arena, capacities, &workspace)) return 0.0;
  const std::uint64_t begin_ns = host::thread_cpu_ns();
  if (solver->init(data, {}, workspace) == Status::ok) {
    while (solver->step() == Status::in_progress) {
    }
  }
  return static_cast<double>(host::thread_cpu_ns() - begin_ns) * 1e-3;
}

Outcome run(const Scene& scene, int trials) {
  Outcome outcome;
  std::vector<double> times;
  double squares = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    const test::SyntheticViews s = make_views(scene, 1000 + static_cast<std::uint64_t>(trial));
    MonoSolver solver;
    times.push_back(solve(s.data(), &solver));
    const CalibrationResult& result = solver.result();
    if (result.status != Status::ok) continue;
    ++outcome.solved;
    squares += std::pow((result.camera.fx - s.camera.fx) / result.sigma[0], 2.0);
  }
  std::nth_element(times.begin(), times.begin() + trials / 2, times.end());
  outcome.median_us = times[static_cast<std::size_t>(trials / 2)];
  outcome.error_in_sigmas = std::sqrt(squares / std::max(1, outcome.solved));
  return outcome;
}

bool report(const Scene& scene, int trials) {
  const Outcome outcome = run(scene, trials);
  std::printf("%-34s %5d %5d %6d %10.1f %8.2f %5d/%d\n", scene.name, scene.views, scene.lines, scene.points_per_line,
              outcome.median_us, outcome.error_in_sigmas, outcome.solved, trials);
  return outcome.solved * 10 >= trials * 9;
}

/// The exponent of time in the number of views.
void report_growth(int trials) {
  const Scene few{"", 25, 15, 9, 0.0, 0.0};
  const Scene many{"", 400, 15, 9, 0.0, 0.0};
  const double ratio = run(many, trials).median_us / run(few, trials).median_us;
  std::printf("time grows with views to the power of %.2f (25 to 400 views)\n", std::log(ratio) / std::log(16.0));
}

}  // namespace

int main(int argc, char** argv) {
  const bool quick = argc > 1 && std::strcmp(argv[1], "--quick") == 0;
  const int trials = quick ? 20 : 400;
  std::printf("%-34s %5s %5s %6s %10s %8s %s\n", "scene", "views", "lines", "points", "us", "error", "solved");
  bool good = report({"one view, a plane", 1, 25, 2, 0.0, 0.0}, trials);
  good = report({"one view, in space", 1, 25, 2, 1.0, 0.0}, trials) && good;
  good = report({"one view, a plane, 30 % wrong", 1, 25, 2, 0.0, 0.3}, trials) && good;
  good = report({"one view, in space, 30 % wrong", 1, 25, 2, 1.0, 0.3}, trials) && good;
  good = report({"many views of a plane", 50, 15, 9, 0.0, 0.0}, quick ? 3 : 50) && good;
  good = report({"many views in space", 50, 15, 9, 1.0, 0.0}, quick ? 3 : 50) && good;
  if (!quick) report_growth(10);
  return good ? 0 : 1;
}
