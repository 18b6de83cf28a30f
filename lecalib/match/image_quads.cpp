// SPDX-License-Identifier: MIT
#include "lecalib/match/image_quads.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

constexpr std::uint16_t kNoCorner = 0xffff;
/// Pieces of one line: each end of the shorter within this many units of the longer one's line, and the gap between
/// them at most this share of their joint length.
constexpr double kJoinUnits = 1.5;
constexpr double kJoinGap = 0.5;
/// Smallest share of the longest side that the shortest side may have.
constexpr double kMinSideRatio = 0.04;

Vec2 end_of(const ImageEdge& edge, std::size_t end) { return Eigen::Map<const Vec2>(edge.end[end]); }
double distance_to(const ImageEdge& edge, const Vec2& p) {
  return edge.normal[0] * p.x() + edge.normal[1] * p.y() + edge.normal[2];
}

ImageEdge make_edge(const Vec2& a, const Vec2& b, double support_px) {
  ImageEdge edge{};
  Eigen::Map<Vec2>(edge.end[0]) = a;
  Eigen::Map<Vec2>(edge.end[1]) = b;
  const Vec2 d = b - a;
  edge.length_px = d.norm();
  edge.normal[0] = -d.y() / edge.length_px;
  edge.normal[1] = d.x() / edge.length_px;
  edge.normal[2] = -(edge.normal[0] * a.x() + edge.normal[1] * a.y());
  edge.support_px = support_px;
  return edge;
}

/// @return true, and the union in *joined, when `piece` continues `edge`
bool join(const ImageEdge& edge, const ImageEdge& piece, double unit_px, ImageEdge* joined) {
  if (piece.length_px > edge.length_px) return false;
  for (std::size_t e = 0; e < 2; ++e) {
    if (std::abs(distance_to(edge, end_of(piece, e))) > kJoinUnits * unit_px) return false;
  }
  const Vec2 u = (end_of(edge, 1) - end_of(edge, 0)) / edge.length_px;
  const double s0 = u.dot(end_of(piece, 0) - end_of(edge, 0));
  const double s1 = u.dot(end_of(piece, 1) - end_of(edge, 0));
  const double low = std::min(s0, s1);
  const double high = std::max(s0, s1);
  const double gap = std::max(low - edge.length_px, -high);
  if (gap < -0.25 * piece.length_px) return false;  // beside it rather than behind it
  if (gap > kJoinGap * (edge.length_px + piece.length_px)) return false;
  const Vec2 a = low < 0.0 ? end_of(piece, s0 < s1 ? 0 : 1) : end_of(edge, 0);
  const Vec2 b = high > edge.length_px ? end_of(piece, s0 < s1 ? 1 : 0) : end_of(edge, 1);
  *joined = make_edge(a, b, edge.support_px + piece.support_px);
  return true;
}

class QuadFinder {
 public:
  QuadFinder(const ImageQuadOptions& options, ImageQuadWorkspace* workspace)
      : options_(options), workspace_(*workspace), corners_(workspace->corners), quads_(workspace->quads) {}

  void add_edges(Span<const FlatLine> lines, ImageQuadStats* stats) {
    for (const FlatLine& line : lines) {
      if (!line.usable) continue;
      const Vec2 a(line.x[1][0], line.y[1][0]);
      const Vec2 b(line.x[1][2], line.y[1][2]);
      push(make_edge(a, b, line.length_px), stats);
    }
    // One pass over pairs: two pieces are joined, the union may take in further ones as it is visited itself.
    for (std::size_t i = 0; i < num_edges_; ++i) {
      for (std::size_t j = 0; j < num_edges_; ++j) {
        ImageEdge joined;
        if (i == j || !join(workspace_.edges[i], workspace_.edges[j], options_.unit_px, &joined)) continue;
        if (joined.length_px < workspace_.edges[i].length_px + options_.unit_px) continue;
        push(joined, stats);
      }
    }
  }

  void find_corners() {
    for (std::size_t i = 0; i < num_edges_; ++i) {
      for (std::size_t j = i + 1; j < num_edges_; ++j) add_corner(i, j);
    }
    const Span<std::uint16_t> first = workspace_.first.first(2 * num_edges_);
    std::fill(first.begin(), first.end(), kNoCorner);
    for (std::size_t c = 0; c < corners_.size(); ++c) {
      for (std::size_t side = 0; side < 2; ++side) {
        std::uint16_t& head = first[2U * corners_[c].edge[side] + corners_[c].end[side]];
        corners_[c].next[side] = head;
        head = static_cast<std::uint16_t>(c);
      }
    }
  }

  /// Each middle corner (b, c), each corner (a, b) at b's other end, each corner (c, d) at c's other end: a quad a b c
  /// d.
  void find_quads() {
    for (std::size_t m = 0; m < corners_.size(); ++m) {
      const std::size_t b = corners_[m].edge[0];
      const std::size_t c = corners_[m].edge[1];
      const std::size_t b_far = 1U - corners_[m].end[0];
      const std::size_t c_far = 1U - corners_[m].end[1];
      for (std::uint16_t at_b = workspace_.first[2 * b + b_far]; at_b != kNoCorner; at_b = next_at(at_b, b, b_far)) {
        const std::size_t a = other_edge(at_b, b);
        for (std::uint16_t at_c = workspace_.first[2 * c + c_far]; at_c != kNoCorner; at_c = next_at(at_c, c, c_far)) {
          const std::size_t d = other_edge(at_c, c);
          if (a == c || d == b || a == d) continue;
          add_quad({a, b, c, d}, at_b, m, at_c);
        }
      }
    }
  }

  [[nodiscard]] const BoundedBest<ImageQuad>& quads() const { return quads_; }
  [[nodiscard]] const BoundedBest<ImageCorner>& corners() const { return corners_; }

 private:
  void push(const ImageEdge& edge, ImageQuadStats* stats) {
    if (num_edges_ == workspace_.edges.size()) {
      ++stats->edges_dropped;
      return;
    }
    workspace_.edges[num_edges_++] = edge;
  }

  [[nodiscard]] double tolerance_px(double share, double length_px) const {
    return std::max(options_.end_units * options_.unit_px, share * length_px);
  }

  [[nodiscard]] bool intersection(std::size_t i, std::size_t j, Vec2* out) const {
    const double* m = workspace_.edges[i].normal;
    const double* n = workspace_.edges[j].normal;
    const double sine = m[0] * n[1] - m[1] * n[0];
    if (std::abs(sine) < options_.min_sine) return false;
    *out = Vec2(m[1] * n[2] - n[1] * m[2], n[0] * m[2] - m[0] * n[2]) / sine;
    return true;
  }

  void add_corner(std::size_t i, std::size_t j) {
    Vec2 point;
    if (!intersection(i, j, &point)) return;
    ImageCorner corner{};
    Eigen::Map<Vec2>(corner.point) = point;
    const std::size_t edges[2] = {i, j};
    for (std::size_t side = 0; side < 2; ++side) {
      const ImageEdge& edge = workspace_.edges[edges[side]];
      const double d0 = (point - end_of(edge, 0)).norm();
      const double d1 = (point - end_of(edge, 1)).norm();
      const double gap = std::min(d0, d1);
      const bool is_overhang = std::max(d0, d1) < edge.length_px;
      if (gap > tolerance_px(is_overhang ? options_.overhang_share : options_.gap_share, edge.length_px)) return;
      corner.edge[side] = static_cast<std::uint16_t>(edges[side]);
      corner.end[side] = d0 <= d1 ? 0 : 1;
      corner.gap_px += gap;
    }
    corners_.offer(corner, [](const ImageCorner& a, const ImageCorner& b) { return a.gap_px < b.gap_px; });
  }

  [[nodiscard]] std::uint16_t next_at(std::uint16_t corner, std::size_t edge, std::size_t end) const {
    const ImageCorner& c = corners_[corner];
    return c.edge[0] == edge && c.end[0] == end ? c.next[0] : c.next[1];
  }
  [[nodiscard]] std::size_t other_edge(std::uint16_t corner, std::size_t edge) const {
    const ImageCorner& c = corners_[corner];
    return c.edge[0] == edge ? c.edge[1] : c.edge[0];
  }
  /// Index of the corner where two edges meet; kNoCorner when it is not in the list.
  [[nodiscard]] std::uint16_t corner_between(std::size_t a, std::size_t d) const {
    for (std::size_t end = 0; end < 2; ++end) {
      for (std::uint16_t c = workspace_.first[2 * a + end]; c != kNoCorner; c = next_at(c, a, end)) {
        if (other_edge(c, a) == d) return c;
      }
    }
    return kNoCorner;
  }

  void add_quad(const std::size_t (&edges)[4], std::uint16_t at_b, std::size_t middle, std::uint16_t at_c) {
    // A quad with four real corners is found from each of them: the one with the smallest index counts.
    const std::uint16_t closing = corner_between(edges[0], edges[3]);
    if (closing != kNoCorner && std::min({at_b, at_c, closing}) < middle) return;
    Vec2 corner[4];
    corner[0] = Eigen::Map<const Vec2>(corners_[at_b].point);
    corner[1] = Eigen::Map<const Vec2>(corners_[middle].point);
    corner[2] = Eigen::Map<const Vec2>(corners_[at_c].point);
    if (!intersection(edges[3], edges[0], &corner[3])) return;
    ImageQuad quad{};
    if (!is_convex(corner)) return;
    if (!measure_sides(edges, corner, &quad)) return;
    for (int i = 0; i < 4; ++i) Eigen::Map<Vec2>(quad.corner[i]) = corner[i];
    quads_.offer(quad, [](const ImageQuad& p, const ImageQuad& q) { return p.covered_px > q.covered_px; });
  }

  static bool is_convex(const Vec2 (&corner)[4]) {
    int positive = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const Vec2 a = corner[(i + 1) % 4] - corner[i];
      const Vec2 b = corner[(i + 2) % 4] - corner[(i + 1) % 4];
      positive += a.x() * b.y() - a.y() * b.x() > 0.0 ? 1 : 0;
    }
    return positive == 0 || positive == 4;
  }

  /// Side i runs from corner i - 1 to corner i along edge i; its edge must cover it and not go far beyond it.
  bool measure_sides(const std::size_t (&edges)[4], const Vec2 (&corner)[4], ImageQuad* quad) const {
    double shortest = 1e300;
    double longest = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      const ImageEdge& edge = workspace_.edges[edges[i]];
      const Vec2& from = corner[(i + 3) % 4];
      const Vec2 d = corner[i] - from;
      const double length = d.norm();
      shortest = std::min(shortest, length);
      longest = std::max(longest, length);
      const double s0 = d.dot(end_of(edge, 0) - from) / length;
      const double s1 = d.dot(end_of(edge, 1) - from) / length;
      const double low = std::min(s0, s1);
      const double high = std::max(s0, s1);
      const double reach = tolerance_px(options_.overhang_share, edge.length_px);
      if (low < -reach || high > length + reach) return false;
      const double overlap = std::min(high, length) - std::max(low, 0.0);
      const double covered = overlap * std::min(1.0, edge.support_px / edge.length_px);
      if (covered < options_.min_coverage * length) return false;
      quad->covered_px += covered;
    }
    return shortest > kMinSideRatio * longest;
  }

  ImageQuadOptions options_;
  ImageQuadWorkspace& workspace_;
  std::size_t num_edges_ = 0;
  BoundedBest<ImageCorner> corners_;
  BoundedBest<ImageQuad> quads_;
};

}  // namespace

Span<const ImageQuad> find_image_quads(Span<const FlatLine> lines, const ImageQuadOptions& options,
                                       ImageQuadWorkspace* workspace, ImageQuadStats* stats) {
  QuadFinder finder(options, workspace);
  finder.add_edges(lines, stats);
  finder.find_corners();
  finder.find_quads();
  stats->corners_dropped += finder.corners().dropped();
  stats->quads_dropped += finder.quads().dropped();
  return finder.quads().view();
}

}  // namespace lecalib
