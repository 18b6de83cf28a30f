// SPDX-License-Identifier: MIT
/// Lines by the chain of [Liu24] section 3.1.
#include <algorithm>

#include "lecalib/pipeline/line_collector.hpp"
#include "lecalib/pipeline/line_detector.hpp"
#include "lecalib/segments/plane_projection.hpp"

namespace lecalib {
namespace {

/// Planes of the cloud, with their points in the workspace.
Status find_planes(const EventCloud& cloud, const DetectorOptions& options, const DetectorWorkspace& ws,
                   std::size_t* num_planes, DetectorStats* stats) {
  std::size_t num_points = 0;
  {
    const StageTimer timer(options.clock_ns, DetectorStage::normals, stats);
    const Status status = estimate_normals(cloud, options.normals, ws.surface, &num_points, &stats->normals);
    if (status != Status::ok) return status;
  }
  const StageTimer timer(options.clock_ns, DetectorStage::planes, stats);
  return grow_planes(cloud, ws.surface.first(num_points), options.regions, ws.regions, ws.planes, ws.plane_points,
                     num_planes, &stats->regions);
}

/// Lines that the planes show, best supported first.
Status guess_lines(const EventCloud& cloud, Span<const EventPlane> planes, const DetectorOptions& options,
                   const DetectorWorkspace& ws, std::size_t* num_guesses, DetectorStats* stats) {
  const StageTimer timer(options.clock_ns, DetectorStage::segments, stats);
  std::size_t count = 0;
  for (const EventPlane& plane : planes) {
    PlaneFrame frame{};
    if (!make_plane_frame(plane, &frame)) {
      ++stats->planes_of_constant_time;
      continue;
    }
    const Span<PlanePoint> projected = ws.projected.first(plane.count);
    project_to_plane(frame, ws.plane_points.subspan(plane.first, plane.count), projected);
    std::size_t num_rims = 0;
    const Status status =
        find_plane_segments(projected, options.segments, ws.segments, ws.rims, &num_rims, &stats->segments);
    if (status != Status::ok) return status;
    count += lines_of_plane(plane, frame, cloud.depth_px, ws.rims.first(num_rims), ws.guesses.subspan(count),
                            &stats->guesses_dropped);
  }
  const auto better = [](const PlaneLine& a, const PlaneLine& b) { return a.support > b.support; };
  std::make_heap(ws.guesses.begin(), ws.guesses.begin() + count, better);
  std::sort_heap(ws.guesses.begin(), ws.guesses.begin() + count, better);
  stats->guesses = static_cast<std::uint32_t>(count);
  *num_guesses = count;
  return Status::ok;
}

/// Lines from the guesses of the planes. @return how many
std::size_t fit_guesses(const EventCloud& cloud, Span<const PlaneLine> guesses, const DetectorOptions& options,
                        const DetectorWorkspace& ws, DetectorStats* stats) {
  const StageTimer timer(options.clock_ns, DetectorStage::lines, stats);
  LineCollector lines(cloud, options, ws, stats);
  for (const PlaneLine& guess : guesses) {
    if (lines.full()) {
      ++stats->lines_dropped;
      continue;
    }
    MovingLine line;
    if (!line_between(guess.begin, guess.end, &line)) continue;
    line.polarities = guess.polarity != 0 ? 2 : 1;
    lines.add(line);
  }
  return lines.count();
}

}  // namespace

Status reference_detector(const EventCloud& cloud, const DetectorOptions& options, const DetectorWorkspace& ws,
                          std::size_t* num_lines, DetectorStats* stats) {
  std::size_t num_planes = 0;
  Status status = find_planes(cloud, options, ws, &num_planes, stats);
  if (status != Status::ok) return status;
  std::size_t num_guesses = 0;
  status = guess_lines(cloud, ws.planes.first(num_planes), options, ws, &num_guesses, stats);
  if (status != Status::ok) return status;
  *num_lines = fit_guesses(cloud, ws.guesses.first(num_guesses), options, ws, stats);
  return Status::ok;
}

}  // namespace lecalib
