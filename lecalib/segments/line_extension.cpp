// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_extension.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/segments/event_weight.hpp"

namespace lecalib {
namespace {

/// Events by owner.
struct Holdings {
  std::uint32_t events[kMaxLines + 1] = {};

  Holdings() = default;
  Holdings(Span<const std::uint8_t> owner, std::size_t count) {
    // Neighbours mostly have one owner, and each would wait for the count of the one before: two places in turn.
    const std::size_t half = count / 2;
    for (std::size_t i = 0; i < half; ++i) {
      ++events[owner[i]];
      ++events[owner[half + i]];
    }
    if (2 * half < count) ++events[owner[count - 1]];
  }
};

/// Fits lines anew that lost most of their events to others, and drops those that are none without: what lived between
/// two edges, on events of both.
void settle_robbed(const EventCloud& cloud, const ExtensionOptions& options, const LineFitOptions& fit_options,
                   const LineWorkspace& workspace, const Holdings& before, Span<MovingLine> lines, std::size_t* count) {
  const Holdings after(workspace.owner, cloud.size());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < *count; ++i) {
    MovingLine line = lines[i];
    const auto had = static_cast<float>(before.events[line.id]);
    if (static_cast<float>(after.events[line.id]) < options.min_kept_share * had) {
      const OwnEvents own(line.id);
      if (fit_line(cloud, fit_options, workspace, {line.id, own.filter(), 1, {}}, &line) != FitOutcome::accepted) {
        continue;
      }
    }
    lines[kept++] = line;
  }
  *count = kept;
}

}  // namespace

void clear_lines(const EventCloud& cloud, const ExtensionOptions& options, const LineFitOptions& fit_options,
                 const LineWorkspace& workspace, Span<MovingLine> lines, std::size_t* count) {
  const Span<MovingLine> all = lines.first(*count);
  Holdings before;
  bool any = false;
  for (MovingLine& line : all) {
    const OwnEvents own(line.id);
    const SharedStretches shared(options.sharing, all, line, own.filter());
    if (shared.empty()) continue;
    if (!any) before = Holdings(workspace.owner, cloud.size());
    any = true;
    (void)fit_line(cloud, fit_options, workspace, {line.id, own.filter(), 1, shared}, &line);
  }
  if (any) settle_robbed(cloud, options, fit_options, workspace, before, lines, count);
}

std::size_t extend_lines(const EventCloud& cloud, const ExtensionOptions& options, const GrowthOptions& growth_options,
                         const LineFitOptions& fit_options, const LineWorkspace& workspace, Span<MovingLine> lines,
                         std::size_t* count) {
  GrowthOptions growth = growth_options;
  growth.other_polarity_px = 0;  // a line through others' events has no use for a second reason to go on
  const Span<MovingLine> all = lines.first(*count);
  Holdings before;
  bool any = false;
  std::size_t extended = 0;
  for (MovingLine& line : all) {
    const OwnEvents own(line.id);
    const SharedStretches shared(options.sharing, all, line, own.filter());
    if (shared.empty()) continue;
    MovingLine longer = line;
    if (!grow_line(cloud, growth, fit_options.priors, workspace, own.filter(), shared, &longer)) continue;
    if (longer.highest() - longer.lowest() < line.highest() - line.lowest() + options.min_gain_px) continue;
    longer.thickness_px = line.thickness_px;
    // A fit that is accepted has taken its events: what makes the extension not worth while must refuse it before.
    LineFitOptions fit = fit_options;
    fit.max_thickness_px = std::min(fit.max_thickness_px, options.max_thickening * line.thickness_px);
    fit.min_length_px = std::max(min_line_length(fit, cloud.width, cloud.height), line.length() + options.min_gain_px);
    const FitClaim claim{line.id, own.filter(), 1, {options.sharing, all, longer, own.filter()}};
    if (!any) before = Holdings(workspace.owner, cloud.size());
    any = true;
    if (fit_line(cloud, fit, workspace, claim, &longer) != FitOutcome::accepted) continue;
    line = longer;
    ++extended;
  }
  if (extended > 0) settle_robbed(cloud, options, fit_options, workspace, before, lines, count);
  return extended;
}

}  // namespace lecalib
