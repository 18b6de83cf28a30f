// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/line_detector.hpp"

#include <algorithm>

#include "lecalib/pipeline/line_collector.hpp"

namespace lecalib {
namespace {

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
      static_cast<std::uint32_t>(split_lines(cloud, options.fit, ws.fit, ws.lines, &count, &stats->lines_dropped));
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
    const OwnEvents own(lines[i].id);
    SharedStretches shared(options.extension.sharing, lines, lines[i], own.filter());
    if (shared.share_of(lines[i]) <= 0) shared = {};  // the shape asks for every event
    const ShapedLine shaped = shape_line(cloud, options.shape, options.fit.priors, ws.fit, lines[i], shared,
                                         ws.samples.subspan(i * per_line, per_line));
    out[i] = shaped.record;
    ws.shapes[i] = shaped.shape;
    if (per_line > 0) ws.num_samples[i] = static_cast<std::uint8_t>(shaped.num_samples);
  }
  stats->lines_dropped += static_cast<std::uint32_t>(lines.size() - count);
  return count;
}

}  // namespace

Status fast_detector(const EventCloud& cloud, const DetectorOptions& options, const DetectorWorkspace& ws,
                     std::size_t* num_lines, DetectorStats* stats) {
  std::size_t num_seeds = 0;
  {
    const StageTimer timer(options.clock_ns, DetectorStage::seeds, stats);
    num_seeds = rank_seeds(cloud, options.seeds, ws.seeds, &stats->guesses_dropped);
  }
  const StageTimer timer(options.clock_ns, DetectorStage::lines, stats);
  stats->guesses = static_cast<std::uint32_t>(num_seeds);
  LineCollector lines(cloud, options, ws, stats);
  std::uint32_t failures = 0;
  MovingLine line;
  for (const CellSeed& seed : ws.seeds.seeds.first(num_seeds)) {
    if (lines.full() || failures > options.max_failures) {
      ++stats->guesses_dropped;
      continue;
    }
    if (has_failed(cloud, ws.seeds, seed) || !refine_seed(cloud, options.seeds, seed, ws.fit.owner, &line)) continue;
    if (lines.add(line)) continue;
    mark_failed(cloud, ws.seeds, seed);
    ++failures;
  }
  *num_lines = lines.count();
  return Status::ok;
}

void line_edges(const EventCloud& cloud, float window_us, const DetectorOptions& options, const DetectorWorkspace& ws,
                Span<EventLine> out, DetectorStats* stats) {
  const StageTimer timer(options.clock_ns, DetectorStage::edges, stats);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const CrossingFit fit{window_us, options.crossings, options.shape, options.fit.priors};
    (void)fit_crossings(cloud, fit, ws.fit, ws.lines[i], ws.shapes[i], &out[i].edge, &stats->crossings_dropped);
  }
}

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
  if (ws.lines.empty() || ws.lines.size() > kMaxLines || !valid(options)) return Status::invalid_argument;
  if (options.find_edges != nullptr && ws.fit.pixel.empty()) return Status::buffer_too_small;

  EventCloud cloud;
  {
    const StageTimer timer(options.clock_ns, DetectorStage::cloud, stats);
    const Status status = build_cloud(window, options.cloud, ws.cloud, &cloud, &stats->cloud);
    if (status != Status::ok) return status;
  }
  std::size_t num_lines = 0;
  const Status status = options.find_lines(cloud, options, ws, &num_lines, stats);
  if (status != Status::ok) return status;
  num_lines = settle_lines(cloud, num_lines, options, ws, stats);
  *count = write_lines(cloud, ws.lines.first(num_lines), options, ws, out, stats);
  if (options.find_edges != nullptr && cloud.kept_share >= 1) {
    const auto window_us = static_cast<float>(window.end_us - window.begin_us);
    options.find_edges(cloud, window_us, options, ws, out.first(*count), stats);
  }
  return Status::ok;
}

}  // namespace lecalib
