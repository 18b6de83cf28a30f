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

/// Grows and fits lines, each on the events that no line has taken yet.
class LineCollector {
 public:
  LineCollector(const EventCloud& cloud, const DetectorOptions& options, const DetectorWorkspace& workspace,
                DetectorStats* stats)
      : cloud_(cloud), options_(options), ws_(workspace), failed_(workspace.failed), stats_(stats) {
    std::fill(ws_.fit.owner.begin(), ws_.fit.owner.begin() + cloud.size(), std::uint8_t{0});
  }

  [[nodiscard]] bool full() const { return count_ == ws_.lines.size(); }
  [[nodiscard]] std::size_t count() const { return count_; }

  /// @return whether the guess became a line
  bool add(MovingLine line) {
    if (failed_.holds(line) || !grow_line(cloud_, options_.growth, options_.fit.priors, ws_.fit, {}, {}, &line)) {
      ++stats_->guesses_repeated;
      return false;
    }
    const FitClaim claim{static_cast<std::uint8_t>(count_ + 1), {}, 1, {}};
    const FitOutcome outcome = fit_line(cloud_, options_.fit, ws_.fit, claim, &line);
    ++stats_->fits[static_cast<std::size_t>(outcome)];
    if (outcome != FitOutcome::accepted) {
      failed_.add(line);
      return false;
    }
    ws_.lines[count_++] = line;
    return true;
  }

 private:
  const EventCloud& cloud_;
  const DetectorOptions& options_;
  const DetectorWorkspace& ws_;
  FailedLines failed_;
  DetectorStats* stats_;
  std::size_t count_ = 0;
};

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

/// Lines from blocks of cells that look like an edge. @return how many
std::size_t fit_seeds(const EventCloud& cloud, const DetectorOptions& options, const DetectorWorkspace& ws,
                      DetectorStats* stats) {
  std::size_t num_seeds = 0;
  {
    const StageTimer timer(options.clock_ns, DetectorStage::seeds, stats);
    num_seeds = rank_seeds(cloud, options.seeds, ws.seeds, &stats->guesses_dropped);
  }
  const StageTimer timer(options.clock_ns, DetectorStage::lines, stats);
  stats->guesses = static_cast<std::uint32_t>(num_seeds);
  LineCollector lines(cloud, options, ws, stats);
  std::uint32_t failures = 0;
  for (const CellSeed& seed : ws.seeds.seeds.first(num_seeds)) {
    if (lines.full() || failures > options.max_failures) {
      ++stats->guesses_dropped;
      continue;
    }
    MovingLine line;
    if (has_failed(cloud, ws.seeds, seed) || !refine_seed(cloud, options.seeds, seed, ws.fit.owner, &line)) continue;
    if (lines.add(line)) continue;
    mark_failed(cloud, ws.seeds, seed);
    ++failures;
  }
  return lines.count();
}

/// Lines by the chain of [Liu24] section 3.1.
Status find_lines_by_planes(const EventCloud& cloud, const DetectorOptions& options, const DetectorWorkspace& ws,
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

/// Finds what lines have to do with each other: crossings, pieces, rows. @return how many there are then
std::size_t settle_lines(const EventCloud& cloud, std::size_t count, const DetectorOptions& options,
                         const DetectorWorkspace& ws, DetectorStats* stats) {
  const StageTimer timer(options.clock_ns, DetectorStage::merge, stats);
  clear_lines(cloud, options.extension, options.fit, ws.fit, ws.lines, &count);
  stats->lines_merged = static_cast<std::uint32_t>(
      merge_lines(cloud, options.merge, options.extension.sharing, options.fit, ws.fit, ws.lines, &count));
  stats->lines_extended = static_cast<std::uint32_t>(
      extend_lines(cloud, options.extension, options.growth, options.fit, ws.fit, ws.lines, &count));
  stats->lines_merged += static_cast<std::uint32_t>(
      merge_lines(cloud, options.merge, options.extension.sharing, options.fit, ws.fit, ws.lines, &count));
  stats->lines_cut =
      static_cast<std::uint32_t>(split_lines(cloud, options.split, options.fit, ws.fit, ws.lines, &count));
  return count;
}

/// @return how many lines were written, those with most events first; with their shapes in the workspace
std::size_t write_lines(const EventCloud& cloud, Span<MovingLine> lines, const DetectorOptions& options,
                        const DetectorWorkspace& ws, Span<EventLine> out, DetectorStats* stats) {
  const StageTimer timer(options.clock_ns, DetectorStage::shape, stats);
  const auto more_events = [](const MovingLine& a, const MovingLine& b) { return a.events > b.events; };
  std::make_heap(lines.begin(), lines.end(), more_events);
  std::sort_heap(lines.begin(), lines.end(), more_events);
  const std::size_t count = std::min(lines.size(), out.size());
  const std::size_t per_line = ws.samples.size() / ws.lines.size();
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t num_samples = 0;
    bool own[kMaxLines + 1] = {};
    own[lines[i].id] = true;
    SharedStretches shared(options.extension.sharing, lines, lines[i], {own});
    if (shared.share_of(lines[i]) <= 0) shared = {};  // the shape asks for every event
    out[i] = shape_line(cloud, options.shape, options.fit.priors, ws.fit, lines[i], shared,
                        ws.samples.subspan(i * per_line, per_line), &num_samples, &ws.shapes[i]);
    if (per_line > 0) ws.num_samples[i] = static_cast<std::uint8_t>(num_samples);
  }
  stats->lines_dropped += static_cast<std::uint32_t>(lines.size() - count);
  return count;
}

/// Adds their edges to the lines that were written.
void find_edges(const EventCloud& cloud, float window_us, Span<const MovingLine> lines, const DetectorOptions& options,
                const DetectorWorkspace& ws, Span<EventLine> out, DetectorStats* stats) {
  const StageTimer timer(options.clock_ns, DetectorStage::edges, stats);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const CrossingFit fit{window_us, options.crossings, options.shape, options.fit.priors};
    (void)fit_crossings(cloud, fit, ws.fit, lines[i], ws.shapes[i], &out[i].edge, &stats->crossings_dropped);
  }
}

}  // namespace

const char* to_string(DetectorStage stage) noexcept {
  switch (stage) {
    case DetectorStage::cloud: return "cloud";
    case DetectorStage::normals: return "normals";
    case DetectorStage::planes: return "planes";
    case DetectorStage::segments: return "segments";
    case DetectorStage::seeds: return "seeds";
    case DetectorStage::lines: return "lines";
    case DetectorStage::merge: return "merge";
    case DetectorStage::shape: return "shape";
    case DetectorStage::edges: return "edges";
  }
  return "unknown";
}

Span<const LineSample> line_samples(const DetectorWorkspace& workspace, std::size_t line) noexcept {
  if (line >= workspace.num_samples.size()) return {};
  const std::size_t per_line = workspace.samples.size() / workspace.lines.size();
  return {workspace.samples.data() + line * per_line, workspace.num_samples[line]};
}

Status detect_lines(const EventWindow& window, const DetectorOptions& options, DetectorWorkspace* workspace,
                    Span<EventLine> out, std::size_t* count, DetectorStats* stats) {
  DetectorStats unused;
  if (stats == nullptr) stats = &unused;
  *stats = {};
  const DetectorWorkspace& ws = *workspace;
  if (ws.lines.size() > kMaxLines) return Status::invalid_argument;
  if (options.find_edges && ws.fit.pixel.empty()) return Status::buffer_too_small;

  EventCloud cloud;
  {
    const StageTimer timer(options.clock_ns, DetectorStage::cloud, stats);
    const Status status = build_cloud(window, options.cloud, ws.cloud, &cloud, &stats->cloud);
    if (status != Status::ok) return status;
  }
  std::size_t num_lines = 0;
  if (options.kind == DetectorKind::fast) {
    num_lines = fit_seeds(cloud, options, ws, stats);
  } else {
    const Status status = find_lines_by_planes(cloud, options, ws, &num_lines, stats);
    if (status != Status::ok) return status;
  }
  num_lines = settle_lines(cloud, num_lines, options, ws, stats);
  *count = write_lines(cloud, ws.lines.first(num_lines), options, ws, out, stats);
  if (options.find_edges && cloud.kept_share >= 1) {
    const auto window_us = static_cast<float>(window.end_us - window.begin_us);
    find_edges(cloud, window_us, ws.lines.first(*count), options, ws, out, stats);
  }
  return Status::ok;
}

}  // namespace lecalib
