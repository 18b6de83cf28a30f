// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_split.hpp"

#include <algorithm>

#include "lecalib/math/chance.hpp"
#include "lecalib/segments/corridor.hpp"
#include "lecalib/segments/edge_row.hpp"

namespace lecalib {
namespace {

/// Writes the pieces of a line that has gaps. @return how many; none when no piece is a line of its own
std::size_t cut_line(const EventCloud& cloud, const LineFitOptions& options, const LineWorkspace& workspace,
                     const MovingLine& line, Span<MovingLine> out, std::uint32_t* dropped) {
  if (out.empty()) return 0;
  EdgeRow row(line, workspace.histogram);
  const auto for_each_event = [&](float from, float to, auto visit) {
    for_each_near_line(cloud, line, from, to, row.band_px(), line.polarities, 1, visit);
  };
  for_each_event(row.start_px(), row.end_px(), [&](const LineEvent& event) { row.add(event); });
  const GapMotion gaps = row.find_gaps(options.gaps);
  if (gaps.least_px == 0) return 0;
  const float min_length = min_line_length(options, cloud.width, cloud.height);
  const float min_evidence = required_evidence(options, cloud.width, cloud.height);
  const float noise_per_px = 2 * row.band_px() * cloud.noise_in(line.polarities);
  std::size_t count = 0;
  row.for_each_piece(gaps, [&](int first, int end) {
    const auto length = static_cast<float>(end - first);
    if (length < min_length) return;
    const float from = row.start_px() + static_cast<float>(first);
    const float to = std::min(row.start_px() + static_cast<float>(end), row.end_px());
    MovingLine piece = line;
    piece.events = 0;
    for_each_event(from, to, [&](const LineEvent&) { ++piece.events; });
    if (evidence_against_chance(static_cast<float>(piece.events), noise_per_px * length) < min_evidence) return;
    const float half_motion = 0.5F * static_cast<float>(gaps.motion_px);
    for (int k = 0; k < 2; ++k) {
      const float moved = k == 0 ? -half_motion : half_motion;
      if (first > 0) piece.low[k] = from + moved;
      if (end < row.size()) piece.high[k] = to + moved;
    }
    if (count == out.size()) {
      ++*dropped;
      return;
    }
    out[count++] = piece;
  });
  return count;
}

}  // namespace

std::size_t split_lines(const EventCloud& cloud, const LineFitOptions& options, const LineWorkspace& workspace,
                        Span<MovingLine> lines, std::size_t* count, std::uint32_t* dropped) {
  std::size_t cuts = 0;
  const std::size_t original = *count;
  for (std::size_t i = 0; i < original; ++i) {
    if (!lines[i].has_gap) continue;
    const std::size_t pieces = cut_line(cloud, options, workspace, lines[i], lines.subspan(*count), dropped);
    if (pieces == 0) continue;
    lines[i] = lines[*count + pieces - 1];
    *count += pieces - 1;
    cuts += pieces - 1;
  }
  return cuts;
}

}  // namespace lecalib
