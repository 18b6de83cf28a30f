// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/line_detector.hpp"

#include <algorithm>

#include "lecalib/segments/plane_projection.hpp"

namespace lecalib {
namespace {

/// Adds the time from its making to its end to a stage.
class StageTimer {
 public:
  StageTimer(std::uint64_t (*clock_ns)(), DetectorStage stage, DetectorStats* stats)
      : clock_ns_(clock_ns), total_(&stats->stage_ns[static_cast<std::size_t>(stage)]) {
    if (clock_ns_ != nullptr) start_ = clock_ns_();
  }
  ~StageTimer() {
    if (clock_ns_ != nullptr) *total_ += clock_ns_() - start_;
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  std::uint64_t (*clock_ns_)();
  std::uint64_t* total_;
  std::uint64_t start_ = 0;
};

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

/// Grows and fits each guess on the events that no line has taken yet. @return how many lines were accepted
std::size_t fit_guesses(const EventCloud& cloud, Span<const PlaneLine> guesses, const DetectorOptions& options,
                        const DetectorWorkspace& ws, DetectorStats* stats) {
  const StageTimer timer(options.clock_ns, DetectorStage::lines, stats);
  std::fill(ws.fit.owner.begin(), ws.fit.owner.begin() + cloud.size(), std::uint8_t{0});
  std::size_t count = 0;
  for (const PlaneLine& guess : guesses) {
    if (count == ws.lines.size()) {
      ++stats->lines_dropped;
      continue;
    }
    MovingLine line;
    if (!line_between(guess.begin, guess.end, &line)) continue;
    line.polarities = guess.polarity != 0 ? 2 : 1;
    if (!grow_line(cloud, options.growth, options.fit.priors, ws.fit, &line)) {
      ++stats->guesses_repeated;
      continue;
    }
    const FitClaim claim{static_cast<std::uint8_t>(count + 1), {0, 0}, 1};
    const FitOutcome outcome = fit_line(cloud, options.fit, ws.fit, claim, &line);
    ++stats->fits[static_cast<std::size_t>(outcome)];
    if (outcome == FitOutcome::accepted) ws.lines[count++] = line;
  }
  return count;
}

std::size_t write_lines(const EventCloud& cloud, Span<MovingLine> lines, const LineFitOptions& options,
                        Span<EventLine> out, DetectorStats* stats) {
  const auto more_events = [](const MovingLine& a, const MovingLine& b) { return a.events > b.events; };
  std::make_heap(lines.begin(), lines.end(), more_events);
  std::sort_heap(lines.begin(), lines.end(), more_events);
  const std::size_t count = std::min(lines.size(), out.size());
  for (std::size_t i = 0; i < count; ++i) out[i] = to_event_line(cloud, lines[i], options);
  stats->lines_dropped += static_cast<std::uint32_t>(lines.size() - count);
  return count;
}

}  // namespace

const char* to_string(DetectorStage stage) noexcept {
  switch (stage) {
    case DetectorStage::cloud: return "cloud";
    case DetectorStage::normals: return "normals";
    case DetectorStage::planes: return "planes";
    case DetectorStage::segments: return "segments";
    case DetectorStage::lines: return "lines";
    case DetectorStage::merge: return "merge";
  }
  return "unknown";
}

Status detect_lines(const EventWindow& window, const DetectorOptions& options, DetectorWorkspace* workspace,
                    Span<EventLine> out, std::size_t* count, DetectorStats* stats) {
  DetectorStats unused;
  if (stats == nullptr) stats = &unused;
  *stats = {};
  const DetectorWorkspace& ws = *workspace;
  if (ws.lines.size() > kMaxLines) return Status::invalid_argument;

  EventCloud cloud;
  {
    const StageTimer timer(options.clock_ns, DetectorStage::cloud, stats);
    const Status status = build_cloud(window, options.cloud, ws.cloud, &cloud, &stats->cloud);
    if (status != Status::ok) return status;
  }
  std::size_t num_planes = 0;
  Status status = find_planes(cloud, options, ws, &num_planes, stats);
  if (status != Status::ok) return status;
  std::size_t num_guesses = 0;
  status = guess_lines(cloud, ws.planes.first(num_planes), options, ws, &num_guesses, stats);
  if (status != Status::ok) return status;
  std::size_t num_lines = fit_guesses(cloud, ws.guesses.first(num_guesses), options, ws, stats);
  {
    const StageTimer timer(options.clock_ns, DetectorStage::merge, stats);
    stats->lines_merged = static_cast<std::uint32_t>(
        merge_lines(cloud, options.merge, options.fit, ws.fit, ws.lines.first(num_lines), &num_lines));
  }
  *count = write_lines(cloud, ws.lines.first(num_lines), options.fit, out, stats);
  return Status::ok;
}

}  // namespace lecalib
