// SPDX-License-Identifier: MIT
/// lecalib calibrate --observations: from points on lines that were measured elsewhere to the camera.
#include "calibrate.hpp"
#include "event_options.hpp"
#include "lecalib/host/cpu_clock.hpp"
#include "lecalib/host/gyro_file.hpp"
#include "lecalib/host/heap_arena.hpp"
#include "lecalib/host/observation_file.hpp"
#include "lecalib/pipeline/mono_solver.hpp"

namespace lecalib::command {

void calibrate_observations(const CalibrateOptions& options, const host::Model& model,
                            host::CalibrationReport* report) {
  if (options.sensor.empty()) fail({"--observations needs --sensor WxH: a list of points does not state it"});
  const SensorSize sensor = sensor_size(options.sensor);
  const host::Observations observations = take(host::read_observations(options.observations, model, sensor));
  report->diagnostics.inputs.push_back(options.observations);

  CalibrationData data{sensor.width, sensor.height, model.lines, observations.points, observations.views};
  std::vector<RelativePrior> turns;
  if (!options.gyro.empty()) {
    if (!observations.has_times) fail({"--gyro needs the times of the views: a column t_us", options.observations});
    turns = host::pair_views(options.gyro_options(), take(host::read_gyro(options.gyro)), observations.views);
    data.relative = turns;
    report->diagnostics.inputs.push_back(options.gyro);
  }
  MonoSolverOptions solver_options;
  options.apply(&solver_options);
  solver_options.covariance.trust_sigma = observations.has_sigma;
  const MonoSolverCapacities capacities{data.views.size(), data.points.size(), data.model.size()};
  const host::HeapArena block(required_bytes(capacities));
  Arena arena(block.memory());
  MonoSolverWorkspace workspace;
  if (!carve(arena, capacities, &workspace)) fail({"not enough memory"});

  const std::uint64_t begin_ns = host::thread_cpu_ns();
  MonoSolver solver;
  Status status = solver.init(data, solver_options, workspace);
  if (!is_error(status)) {
    do {
      status = solver.step();
    } while (status == Status::in_progress);
  }
  CalibrationResult result = solver.result();
  result.status = status;
  host::add_result(result, observations.views, observations.view_names, model.names, report);
  if (!options.gyro.empty()) report->diagnostics.counts.push_back({"turns", turns.size()});
  report->diagnostics.cpu_ms.push_back({"solve", static_cast<double>(host::thread_cpu_ns() - begin_ns) * 1e-6});
}

}  // namespace lecalib::command
