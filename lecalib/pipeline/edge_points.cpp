// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/edge_points.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/segments/line_crossings.hpp"

namespace lecalib {
namespace {

enum class Quality : std::uint8_t { none, blurred, faint, strong };

bool has_edge(const EventLine& line) {
  return line.edge.crossings > 0 && line.edge.speed_px_per_s != 0 && line.polarity != 0;
}

bool is_strong(const EdgePointOptions& options, const LineEdge& edge) {
  return edge.events_per_crossing >= options.strong_events;
}

/// What the strong edges of a recording scatter at best: a quantile of them all, as the lens blurs them and the pixels
/// differ. @return px, 0 with too few edges to tell
float usual_scatter_px(const EdgePointOptions& options, Span<const LineWindow> windows, Span<const LineMatch> matches) {
  constexpr float kBinPx = 0.005F;
  constexpr std::size_t kBins = 128;
  constexpr std::uint32_t kMinEdges = 24;
  constexpr std::uint32_t kPartBelow = 4;
  std::uint32_t counts[kBins] = {};
  std::uint32_t all = 0;
  for (const LineMatch& match : matches) {
    const EventLine& line = windows[match.window].lines[match.line];
    if (!has_edge(line) || !is_strong(options, line.edge)) continue;
    const float bin = line.edge.scatter_px / kBinPx;
    ++counts[bin < kBins - 1 ? static_cast<std::size_t>(bin) : kBins - 1];
    ++all;
  }
  if (all < kMinEdges) return 0;
  std::size_t bin = 0;
  std::uint32_t below = counts[0];
  while (below * kPartBelow < all) below += counts[++bin];
  return (static_cast<float>(bin) + 0.5F) * kBinPx;
}

/// How much an edge may scatter to be a single one, px.
struct ScatterLimits {
  float strong, faint;

  ScatterLimits(const EdgePointOptions& options, float usual_px)
      : strong(std::max(options.max_scatter_px,
                        std::min(options.scatter_over_usual * usual_px, options.max_usual_scatter_px))),
        faint(options.max_faint_scatter_px) {}
};

Quality quality_of(const EdgePointOptions& options, const ScatterLimits& limits, const EventLine& line) {
  if (!has_edge(line)) return Quality::none;
  const bool strong = is_strong(options, line.edge);
  if (!(line.edge.scatter_px <= (strong ? limits.strong : limits.faint))) return Quality::blurred;
  return strong ? Quality::strong : Quality::faint;
}

/// From the first place of an edge to its last, at one of its times.
struct Direction {
  float x, y, length;
  Direction(const LineEdge& edge, int time)
      : x(edge.x[time][2] - edge.x[time][0]), y(edge.y[time][2] - edge.y[time][0]), length(std::sqrt(x * x + y * y)) {}
};

/// The side of the normal (-y, x) on which the edge is dark.
int dark_side(const EventLine& line) { return (line.polarity > 0) == (line.edge.speed_px_per_s > 0) ? 1 : -1; }

/// @param between_us from an edge's first time to its second
void add_edge(const EdgePointOptions& options, const EventLine& line, int time, float between_us,
              const LineMatch& match, bool other_flank, LinePoint* points, EdgePoint* edges) {
  constexpr float kFaintEvents = 1.5F;
  constexpr float kMicrosecondsPerSecond = 1e6F;
  constexpr float kPlaceOnLine = 0.5F;  // places count from -1 to 1
  const LineEdge& edge = line.edge;
  const Direction direction(edge, time);
  const float faint = options.faint_sigma_px * std::clamp(kFaintEvents + 1 - edge.events_per_crossing, 0.0F, 1.0F);
  // An error of both times alike counts twice as one of each.
  const float faint_variance = 2 * faint * faint;
  const int dark = dark_side(line);
  const int turned = match.flipped ? -1 : 1;
  for (std::size_t i = 0; i < kPointsPerEdge; ++i) {
    points[i].u_px = static_cast<double>(edge.x[time][i]);
    points[i].v_px = static_cast<double>(edge.y[time][i]);
    const float variance = edge.sigma_px[i] * edge.sigma_px[i] + faint_variance / kEdgePlaceWeights[i];
    points[i].sigma_px = static_cast<double>(std::sqrt(variance));
    points[i].line = match.model_line;
    edges[i].normal_x = -direction.y / direction.length;
    edges[i].normal_y = direction.x / direction.length;
    // A line that comes nearer or turns moves faster at one end, and what is late lies further behind there.
    edges[i].speed_px_per_s =
        ((edge.x[1][i] - edge.x[0][i]) * edges[i].normal_x + (edge.y[1][i] - edge.y[0][i]) * edges[i].normal_y) /
        between_us * kMicrosecondsPerSecond;
    edges[i].along = static_cast<float>(turned) * kPlaceOnLine * kEdgePlaces[i];
    edges[i].events = edge.events_per_crossing;
    edges[i].dark = static_cast<std::int8_t>(dark);
    edges[i].model_side = static_cast<std::int8_t>(turned * dark);
    edges[i].polarity = line.polarity;
    edges[i].other_flank = other_flank;
  }
}

/// Whether `other` may be the opposite flank of a drawn line, as near and as parallel as that; how far it is.
bool is_other_flank(const EdgePointOptions& options, const EventLine& line, const EventLine& other, float* distance_px,
                    bool* turned) {
  constexpr float kMinCosine = 0.998F;  // 3.6 degrees
  constexpr float kMinWidthPx = 0.5F;
  if (line.polarity * other.polarity >= 0) return false;
  const Direction a(line.edge, 0);
  const Direction b(other.edge, 0);
  const float cosine = (a.x * b.x + a.y * b.y) / (a.length * b.length);
  if (std::fabs(cosine) < kMinCosine) return false;
  *turned = cosine < 0;
  if ((line.edge.speed_px_per_s > 0) != (other.edge.speed_px_per_s * cosine > 0)) return false;
  const float x = other.edge.x[0][1] - line.edge.x[0][1];
  const float y = other.edge.y[0][1] - line.edge.y[0][1];
  const float along = (x * a.x + y * a.y) / a.length;
  const float across = (y * a.x - x * a.y) / a.length;
  if (std::fabs(along) > 0.5F * std::max(a.length, b.length)) return false;
  *distance_px = across * static_cast<float>(dark_side(line));
  return *distance_px > kMinWidthPx && *distance_px < options.max_drawn_width_px;
}

/// Makes the points of one window after another.
class PointMaker {
 public:
  /// @param reserved  points that matches may need
  PointMaker(const EdgePointOptions& options, const ScatterLimits& limits, std::size_t reserved, Span<LinePoint> points,
             Span<EdgePoint> edges, EdgePointStats* stats)
      : options_(options), limits_(limits), reserved_(reserved), points_(points), edges_(edges), stats_(stats) {}

  [[nodiscard]] std::size_t count() const { return count_; }

  /// @param matches of the window, their lines within it
  void add_view(const LineWindow& window, Span<const LineMatch> matches, int time) {
    std::uint32_t strong = 0;
    for (const LineMatch& match : matches) {
      if (quality_of(options_, limits_, window.lines[match.line]) == Quality::strong) ++strong;
    }
    for (const LineMatch& match : matches) {
      const EventLine& line = window.lines[match.line];
      const Quality quality = quality_of(options_, limits_, line);
      const bool needless = quality == Quality::faint && strong >= options_.strong_lines;
      if (time == 0) count(quality, needless);
      reserved_ -= kPointsPerEdge;
      if (quality < Quality::faint || needless) continue;
      add(window, line, match, false, time);
      add_other_flank(window, matches, match, time);
    }
  }

 private:
  void add(const LineWindow& window, const EventLine& line, const LineMatch& match, bool other_flank, int time) {
    const float between_us = kEdgeTime * static_cast<float>(window.end_us - window.begin_us);
    add_edge(options_, line, time, between_us, match, other_flank, &points_[count_], &edges_[count_]);
    count_ += kPointsPerEdge;
  }

  void add_other_flank(const LineWindow& window, Span<const LineMatch> matches, const LineMatch& match, int time) {
    const EventLine* nearest = nullptr;
    float least = options_.max_drawn_width_px;
    LineMatch flank = match;
    for (std::size_t i = 0; i < window.lines.size(); ++i) {
      const EventLine& other = window.lines[i];
      float distance = 0;
      bool turned = false;
      if (quality_of(options_, limits_, other) < Quality::faint ||
          !is_other_flank(options_, window.lines[match.line], other, &distance, &turned) || distance >= least) {
        continue;
      }
      const bool matched = std::any_of(matches.begin(), matches.end(), [&](const LineMatch& m) { return m.line == i; });
      if (matched) continue;
      nearest = &other;
      least = distance;
      flank.flipped = match.flipped != turned;
    }
    if (nearest == nullptr) return;
    const bool has_room = count_ + kPointsPerEdge + reserved_ <= std::min(points_.size(), edges_.size());
    if (has_room) add(window, *nearest, flank, true, time);
    if (!has_room) ++stats_->flanks_dropped;
    if (has_room && time == 0) ++stats_->flanks;
  }

  void count(Quality quality, bool needless) {
    ++stats_->lines;
    if (quality == Quality::none) ++stats_->without_edge;
    if (quality == Quality::blurred) ++stats_->blurred;
    if (needless) ++stats_->faint;
  }

  const EdgePointOptions& options_;
  const ScatterLimits limits_;
  std::size_t reserved_;  // for matches to come
  Span<LinePoint> points_;
  Span<EdgePoint> edges_;
  EdgePointStats* stats_;
  std::size_t count_ = 0;
};

/// Whether all matches name a line of a window and are ordered by window.
bool are_valid(Span<const LineWindow> windows, Span<const LineMatch> matches) {
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (matches[i].window >= windows.size() || matches[i].line >= windows[matches[i].window].lines.size()) return false;
    if (i > 0 && matches[i - 1].window > matches[i].window) return false;
  }
  return true;
}

}  // namespace

Status make_edge_points(const EdgePointOptions& options, Span<const LineWindow> windows, Span<const LineMatch> matches,
                        const EdgePointRoom& room, ViewsMade* made, EdgePointStats* stats) {
  const std::size_t needed = kEdgePointsPerMatch * matches.size();
  if (room.points.size() < needed || room.edges.size() < needed) return Status::capacity_exceeded;
  if (!are_valid(windows, matches)) return Status::invalid_argument;
  EdgePointStats counted;
  const ScatterLimits limits(options, usual_scatter_px(options, windows, matches));
  PointMaker maker(options, limits, needed, room.points, room.edges, &counted);
  std::size_t num_views = 0;
  for (std::size_t first = 0, last = 0; first < matches.size(); first = last) {
    const std::uint16_t index = matches[first].window;
    const LineWindow& window = windows[index];
    while (last < matches.size() && matches[last].window == index) ++last;
    if (num_views + 2 > room.views.size()) return Status::capacity_exceeded;
    const auto half_us = 0.5 * static_cast<double>(window.end_us - window.begin_us);
    for (int time = 0; time < 2; ++time) {
      const std::size_t start = maker.count();
      maker.add_view(window, matches.subspan(first, last - first), time);
      const double place = 1 + (time == 0 ? -1 : 1) * static_cast<double>(kEdgeTime);
      room.views[num_views++] = {window.begin_us + static_cast<std::int64_t>(half_us * place),
                                 static_cast<std::uint32_t>(start), static_cast<std::uint32_t>(maker.count() - start)};
    }
  }
  *made = {maker.count(), num_views};
  if (stats != nullptr) *stats = counted;
  return Status::ok;
}

}  // namespace lecalib
