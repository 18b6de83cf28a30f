// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_merge.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/segments/corridor.hpp"

namespace lecalib {
namespace {

constexpr float kGapMarginPx = 8;
constexpr float kSmallGapPx = 6;      // not worth looking at
constexpr float kSmallGapEvents = 9;  // nor is a gap where so many events are missing at most
constexpr float kGapBandPx = 2.5F;
constexpr int kMaxGapBins = 64;
constexpr float kGapBinPx = 4;
constexpr float kMaxHolePx = 4;
constexpr float kHoleEvents = 6;  // a stretch that should have held so many events and holds none is a hole
/// ON and OFF pieces join only when they follow each other: side by side they are the two edges of a thin stripe.
constexpr float kMaxOppositeDistancePx = 1.2F;
constexpr float kMaxOppositeOverlap = 0.3F;
constexpr float kMaxPiecesApartPx = 24;  // of an end, from where the other piece would have it
constexpr int kGapPlaces = 8;
constexpr int kMinSharedGapPlaces = 5;
constexpr float kMaxAcrossDistancePx = 1.5F;
/// A joined line may be uneven: its pieces were parted for a reason.
constexpr float kJoinTolerance = 0.5F;

/// How the surface of `line` lies to another's.
struct Agreement {
  bool agrees = false;
  float worst_px = 0;  // largest distance of an end
  float low = 0;       // extent of `line` along the other
  float high = 0;
};

/// Which ends of a piece are looked at.
enum class PieceEnds : std::uint8_t { both, low, high };

/// Holds ends of `piece` against the surface of `reference`, at the window's begin and end.
Agreement compare(const MovingLine& reference, const MovingLine& piece, PieceEnds ends, const MergeOptions& options) {
  Agreement result;
  result.low = 1e9F;
  result.high = -1e9F;
  result.agrees = true;
  for (int end = 0; end < 2; ++end) {
    const float tau = end == 0 ? -1.0F : 1.0F;
    for (const bool is_high : {false, true}) {
      if (ends == (is_high ? PieceEnds::low : PieceEnds::high)) continue;
      const float s_piece = is_high ? piece.high[end] : piece.low[end];
      const float d_piece = piece.offset(s_piece, tau);
      const float x = piece.x(s_piece, d_piece);
      const float y = piece.y(s_piece, d_piece);
      const float s = reference.along(x, y);
      const float distance = std::fabs(reference.across(x, y) - reference.offset(s, tau));
      const float variance = offset_variance(reference, s, tau) + offset_variance(piece, s_piece, tau);
      const float allowed = options.max_distance_px + options.distance_sigmas * std::sqrt(variance);
      if (distance > std::min(allowed, options.max_allowed_px)) result.agrees = false;
      result.worst_px = std::max(result.worst_px, distance);
      result.low = std::min(result.low, s);
      result.high = std::max(result.high, s);
    }
  }
  return result;
}

/// Whether events of anybody lie on the line all along the gap.
bool is_gap_filled(const EventCloud& cloud, const MergeOptions& options, const MovingLine& line, unsigned polarities,
                   float from, float to, float density) {
  const float gap = to - from;
  const int bins = std::clamp(static_cast<int>(gap / kGapBinPx), 1, kMaxGapBins);
  int counts[kMaxGapBins] = {};
  for_each_near_line(cloud, line, from, to, kGapBandPx, polarities, 1, [&](const LineEvent& event) {
    const int bin = static_cast<int>((event.along_px - from) / gap * static_cast<float>(bins));
    ++counts[std::min(bin, bins - 1)];
  });
  const float expected = density * gap;
  int total = 0;
  int holes = 0;
  for (int b = 0; b < bins; ++b) {
    total += counts[b];
    holes += static_cast<float>(counts[b]) < 0.25F * expected / static_cast<float>(bins) ? 1 : 0;
  }
  const float hole_px = static_cast<float>(holes) * gap / static_cast<float>(bins);
  return static_cast<float>(total) >= options.min_gap_filling * expected &&
         hole_px <= std::max(kMaxHolePx, kHoleEvents / density);
}

float density_of(const MovingLine& line) { return static_cast<float>(line.events) / std::max(line.length(), 1.0F); }

bool opposite(const MovingLine& a, const MovingLine& b) { return (a.polarities & b.polarities) == 0; }

/// Whether the shorter line `b` continues, or repeats, `a`; `of_b` is b's place along a.
bool belong_together(const EventCloud& cloud, const MergeOptions& options, const MovingLine& a, const MovingLine& b,
                     const Agreement& of_b) {
  if (!of_b.agrees) return false;
  const float low = a.lowest();
  const float high = a.highest();
  // At the longer line's far end the shorter one, extrapolated, would say nothing.
  const PieceEnds near = of_b.low > high ? PieceEnds::high : of_b.high < low ? PieceEnds::low : PieceEnds::both;
  const Agreement of_a = compare(b, a, near, options);
  if (!of_a.agrees) return false;
  if (opposite(a, b)) {
    const float overlap = std::min(high, of_b.high) - std::max(low, of_b.low);
    if (std::max(of_b.worst_px, of_a.worst_px) > kMaxOppositeDistancePx) return false;
    if (overlap > kMaxOppositeOverlap * (of_b.high - of_b.low)) return false;
  }
  const float gap = std::max(of_b.low - high, low - of_b.high);
  if (gap > options.max_gap_lengths * 0.5F * (high - low + of_b.high - of_b.low) + kGapMarginPx) return false;
  const float density = std::min(density_of(a), density_of(b));
  if (gap <= std::max(kSmallGapPx, kSmallGapEvents / density)) return true;
  const bool after = of_b.low > high;
  const unsigned polarities = opposite(a, b) ? 3U : (a.polarities | b.polarities);
  return is_gap_filled(cloud, options, a, polarities, after ? high : of_b.high, after ? of_b.low : low, density);
}

/// Whether the lines follow each other and point at each other nearly enough to be worth a closer look.
bool may_lie_across(const MovingLine& a, const MovingLine& b, const Agreement& of_b) {
  return !opposite(a, b) && (of_b.low > a.highest() || of_b.high < a.lowest()) && of_b.worst_px < kMaxPiecesApartPx;
}

/// Whether the lines are pieces of one on both sides of a stretch that it shares with another line. What two short
/// pieces say of each other's place is little; but one line must fit both.
bool lie_across(const EventCloud& cloud, const MergeOptions& options, const MovingLine& a, const MovingLine& b,
                const Agreement& of_b, const MovingLine& whole, const SharedStretches& shared) {
  if (shared.empty()) return false;
  const float low = a.lowest();
  const float high = a.highest();
  const float from = of_b.low > high ? high : of_b.high;
  const float to = of_b.low > high ? of_b.low : low;
  int shared_places = 0;
  for (int i = 0; i < kGapPlaces; ++i) {
    const float s = from + (to - from) * (static_cast<float>(i) + 0.5F) / kGapPlaces;
    shared_places += shared.hold(whole, s, 0) ? 1 : 0;
  }
  if (shared_places < kMinSharedGapPlaces) return false;
  MergeOptions close = options;
  close.max_allowed_px = kMaxAcrossDistancePx;
  if (!compare(whole, a, PieceEnds::both, close).agrees || !compare(whole, b, PieceEnds::both, close).agrees)
    return false;
  return is_gap_filled(cloud, options, whole, a.polarities | b.polarities, from, to,
                       std::min(density_of(a), density_of(b)));
}

/// First guess of the joined line: a least squares fit to points of both surfaces, weighted by their events.
bool join(const MovingLine& a, const MovingLine& b, const Agreement& of_b, const LinePriors& priors, MovingLine* out) {
  constexpr int kSamples = 5;
  LineEquations equations;
  for (const MovingLine* line : {&a, &b}) {
    const float weight = static_cast<float>(line->events) / (3 * kSamples);
    for (int i = 0; i < kSamples; ++i) {
      const float s = line->lowest() + (line->highest() - line->lowest()) * static_cast<float>(i) / (kSamples - 1);
      for (const float tau : {-1.0F, 0.0F, 1.0F}) {
        const float d = line->offset(s, tau);
        const float x = line->x(s, d);
        const float y = line->y(s, d);
        equations.add(a.along(x, y), tau, a.across(x, y), weight);
      }
    }
  }
  *out = a;
  if (!equations.solve(priors, 1, out->m, nullptr)) return false;
  out->low[0] = out->low[1] = std::min(a.lowest(), of_b.low);
  out->high[0] = out->high[1] = std::max(a.highest(), of_b.high);
  out->thickness_px = std::max(a.thickness_px, b.thickness_px);
  out->polarities = static_cast<std::uint8_t>(a.polarities | b.polarities);
  out->events = a.events + b.events;
  return true;
}

}  // namespace

std::size_t merge_lines(const EventCloud& cloud, const MergeOptions& options, const SharingOptions& sharing,
                        const LineFitOptions& fit_options, const LineWorkspace& workspace, Span<MovingLine> lines,
                        std::size_t* count) {
  // A line that was joined to another has no events left.
  std::size_t joined = 0;
  for (std::size_t i = 0; i < *count; ++i) {
    for (std::size_t k = 0; k < *count; ++k) {
      MovingLine& a = lines[i];
      MovingLine& b = lines[k];
      if (i == k || a.events == 0 || b.events == 0 || a.length() < b.length()) continue;
      if (std::fabs(a.ux * b.ux + a.uy * b.uy) < options.min_cosine) continue;
      const Agreement of_b = compare(a, b, PieceEnds::both, options);
      const bool agree = belong_together(cloud, options, a, b, of_b);
      MovingLine whole;
      if ((!agree && !may_lie_across(a, b, of_b)) || !join(a, b, of_b, fit_options.priors, &whole)) continue;
      const OwnEvents own(a.id, b.id);
      const SharedStretches shared(sharing, lines.first(*count), whole, own.filter());
      if (!agree && !lie_across(cloud, options, a, b, of_b, whole, shared)) continue;
      const FitClaim claim{a.id, own.filter(), kJoinTolerance, shared};
      if (fit_line(cloud, fit_options, workspace, claim, &whole) != FitOutcome::accepted) continue;
      a = whole;
      b.events = 0;
      ++joined;
      k = static_cast<std::size_t>(-1);  // the longer line may reach others now
    }
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < *count; ++i) {
    if (lines[i].events > 0) lines[kept++] = lines[i];
  }
  *count = kept;
  return joined;
}

}  // namespace lecalib
