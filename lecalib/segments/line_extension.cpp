// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_extension.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

/// Events by owner.
struct Holdings {
  std::uint32_t events[kMaxLines + 1] = {};

  Holdings(Span<const std::uint8_t> owner, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) ++events[owner[i]];
  }
};

/// Distance of s from the line's extent, px.
float beyond(const MovingLine& line, float s) {
  return std::max(0.0F, std::max(line.lowest() - s, s - line.highest()));
}

/// Whether the lines cross at a small angle, at mid window, where one may hide the other.
bool may_hide(const MovingLine& a, const MovingLine& b, const ExtensionOptions& options) {
  if ((a.polarities & b.polarities) == 0) return false;
  const float sine = a.ux * b.uy - a.uy * b.ux;
  if (std::fabs(sine) < options.min_sine || std::fabs(sine) > options.max_sine) return false;
  const float of_a = ((b.cx - a.cx) * b.uy - (b.cy - a.cy) * b.ux) / sine;
  const float of_b = ((b.cx - a.cx) * a.uy - (b.cy - a.cy) * a.ux) / sine;
  return beyond(a, of_a) <= options.reach_px && beyond(b, of_b) <= options.reach_px;
}

/// One line's way through the others.
bool extend(const EventCloud& cloud, const ExtensionOptions& options, const GrowthOptions& growth_options,
            const LineFitOptions& fit_options, const LineWorkspace& workspace, Span<const MovingLine> lines,
            MovingLine* line) {
  bool may_take[kMaxLines + 1] = {};
  bool crosses = false;
  for (const MovingLine& other : lines) {
    const bool hides = other.id != line->id && may_hide(*line, other, options);
    may_take[other.id] = hides || other.id == line->id;
    crosses = crosses || hides;
  }
  if (!crosses) return false;
  MovingLine longer = *line;
  const OwnerFilter filter{may_take};
  if (!grow_line(cloud, growth_options, fit_options.priors, workspace, filter, &longer)) return false;
  if (longer.highest() - longer.lowest() < line->highest() - line->lowest() + options.min_gain_px) return false;
  longer.thickness_px = line->thickness_px;
  // A fit that is accepted has taken its events: what makes the extension not worth while must refuse it before.
  LineFitOptions fit = fit_options;
  fit.max_thickness_px = std::min(fit.max_thickness_px, options.max_thickening * line->thickness_px);
  fit.min_length_px = std::max(min_line_length(fit, cloud.width, cloud.height), line->length() + options.min_gain_px);
  if (fit_line(cloud, fit, workspace, {line->id, filter, 1}, &longer) != FitOutcome::accepted) return false;
  *line = longer;
  return true;
}

}  // namespace

std::size_t extend_lines(const EventCloud& cloud, const ExtensionOptions& options, const GrowthOptions& growth_options,
                         const LineFitOptions& fit_options, const LineWorkspace& workspace, Span<MovingLine> lines,
                         std::size_t* count) {
  GrowthOptions growth = growth_options;
  growth.other_polarity_px = 0;  // a line through others' events has no use for a second reason to go on
  const Holdings before(workspace.owner, cloud.size());
  std::size_t extended = 0;
  for (std::size_t i = 0; i < *count; ++i) {
    if (extend(cloud, options, growth, fit_options, workspace, lines.first(*count), &lines[i])) ++extended;
  }
  if (extended == 0) return 0;

  const Holdings after(workspace.owner, cloud.size());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < *count; ++i) {
    MovingLine line = lines[i];
    const auto had = static_cast<float>(before.events[line.id]);
    if (static_cast<float>(after.events[line.id]) < options.min_kept_share * had) {
      bool own[kMaxLines + 1] = {};
      own[line.id] = true;
      if (fit_line(cloud, fit_options, workspace, {line.id, {own}, 1}, &line) != FitOutcome::accepted) continue;
    }
    lines[kept++] = line;
  }
  *count = kept;
  return extended;
}

}  // namespace lecalib
