// SPDX-License-Identifier: MIT
#include "lecalib/segments/cell_seeds.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

constexpr float kCell = kCloudCellPx;
constexpr float kHalfCell = 0.5F * kCell;
constexpr float kScoreFloorPx2 = 0.25F;    // thickness below which all edges are equally sharp: the pixel grid's
constexpr float kMinTimeVariance = 1e-3F;  // of tau: events of one instant tell no speed
constexpr float kMinVariancePx2 = 0.05F;
constexpr int kRefineRounds = 3;
constexpr float kMinFreeShare = 0.15F;    // of a block's events: less is what lines there have left over
constexpr float kTwinVariancePx2 = 0.6F;  // thinner edges are one

/// The edge of a block: a line that moves with (vx, vy) per unit of tau.
struct BlockEdge {
  float mx, my, mt;     ///< mean
  float ux, uy;         ///< unit direction
  float speed;          ///< across the line, along (-uy, ux), px per unit of tau
  float across, along;  ///< variances, px^2

  [[nodiscard]] float distance(float x, float y, float t) const {
    return (y - my) * ux - (x - mx) * uy - (t - mt) * speed;
  }
};

void add_event(CellMoments* m, float x, float y, float t) {
  m->n += 1;
  m->x += x;
  m->y += y;
  m->t += t;
  m->xx += x * x;
  m->xy += x * y;
  m->yy += y * y;
  m->xt += x * t;
  m->yt += y * t;
  m->tt += t * t;
}

/// Adds a cell's sums to a block's, whose origin lies (-dx, -dy) from the cell's. Those of an empty cell may be
/// anything.
void add_cell(CellMoments* m, const CellMoments& cell, float dx, float dy) {
  if (!(cell.n > 0)) return;
  m->n += cell.n;
  m->x += cell.x + cell.n * dx;
  m->y += cell.y + cell.n * dy;
  m->t += cell.t;
  m->xx += cell.xx + 2 * dx * cell.x + cell.n * dx * dx;
  m->yy += cell.yy + 2 * dy * cell.y + cell.n * dy * dy;
  m->xy += cell.xy + dx * cell.y + dy * cell.x + cell.n * dx * dy;
  m->xt += cell.xt + dx * cell.t;
  m->yt += cell.yt + dy * cell.t;
  m->tt += cell.tt;
}

/// @return false when the events have no direction
bool edge_of(const CellMoments& m, BlockEdge* out) {
  const float inverse = 1 / m.n;
  BlockEdge edge;  // NOLINT(cppcoreguidelines-pro-type-member-init): all of it is written
  edge.mx = m.x * inverse;
  edge.my = m.y * inverse;
  edge.mt = m.t * inverse;
  const float tt = m.tt * inverse - edge.mt * edge.mt;
  const float xt = m.xt * inverse - edge.mx * edge.mt;
  const float yt = m.yt * inverse - edge.my * edge.mt;
  const float per_variance = 1 / (tt + kMinTimeVariance);
  const float vx = xt * per_variance;
  const float vy = yt * per_variance;
  const float a = m.xx * inverse - edge.mx * edge.mx - vx * xt;
  const float b = m.xy * inverse - edge.mx * edge.my - vx * yt;
  const float c = m.yy * inverse - edge.my * edge.my - vy * yt;
  const float half = 0.5F * (a - c);
  const float root = std::sqrt(half * half + b * b);
  edge.across = 0.5F * (a + c) - root;
  edge.along = 0.5F * (a + c) + root;
  // Of the two forms of the larger eigenvalue's vector, the one that does not cancel.
  const float dx = half >= 0 ? half + root : b;
  const float dy = half >= 0 ? b : root - half;
  const float square = dx * dx + dy * dy;
  if (!(square > 1e-12F)) return false;
  const float scale = 1 / std::sqrt(square);
  edge.ux = dx * scale;
  edge.uy = dy * scale;
  edge.speed = vy * edge.ux - vx * edge.uy;
  *out = edge;
  return true;
}

float cell_centre(std::size_t index) { return static_cast<float>(index) * kCell + kHalfCell - 0.5F; }

/// Sums of one row of cells of one polarity; of empty ones n alone.
void sum_row(const EventCloud& cloud, std::size_t first_cell, std::size_t row, CellMoments* out) {
  const float oy = cell_centre(row);
  const std::uint32_t* const start = cloud.cell_start.data() + first_cell + row * cloud.cols;
  for (std::size_t col = 0; col < cloud.cols; ++col) {
    const std::uint32_t first = start[col];
    const std::uint32_t end = start[col + 1];
    if (first == end) {
      out[col].n = 0;
      continue;
    }
    CellMoments m{};
    const float ox = cell_centre(col);
    for (std::uint32_t i = first; i < end; ++i) {
      add_event(&m, static_cast<float>(cloud.x[i]) - ox, static_cast<float>(cloud.y[i]) - oy, cloud.tau(i));
    }
    out[col] = m;
  }
}

struct Better {
  bool operator()(const CellSeed& a, const CellSeed& b) const {
    return a.score > b.score || (a.score == b.score && a.block < b.block);
  }
};
constexpr Better better;

/// Keeps the best seeds: in a heap, once there are as many as find room.
void keep(const SeedWorkspace& ws, const CellSeed& seed, std::size_t* count, std::uint32_t* dropped) {
  if (*count < ws.seeds.size()) {
    ws.seeds[(*count)++] = seed;
    if (*count == ws.seeds.size()) std::make_heap(ws.seeds.begin(), ws.seeds.end(), better);
    return;
  }
  ++*dropped;
  if (ws.seeds.empty() || !better(seed, ws.seeds[0])) return;
  std::pop_heap(ws.seeds.begin(), ws.seeds.end(), better);
  ws.seeds[*count - 1] = seed;
  std::push_heap(ws.seeds.begin(), ws.seeds.end(), better);
}

/// The free events of a block, x and y from its middle; of many, an even share.
class FreeEvents {
 public:
  FreeEvents(const EventCloud& cloud, std::uint32_t block, Span<const std::uint8_t> owner)
      : cloud_(cloud), owner_(owner.data()), cells_{block, block + cloud.cols} {
    std::uint32_t all = 0;
    for (const std::uint32_t cell : cells_) all += cloud.cell_start[cell + 2] - cloud.cell_start[cell];
    const std::uint32_t stride = 1 + all / kMaxCount;
    // Most blocks have none, so they are counted before any is listed.
    std::size_t count = 0;
    for (const std::uint32_t cell : cells_) {
      const std::uint32_t end = cloud.cell_start[cell + 2];
      for (std::uint32_t i = cloud.cell_start[cell]; i < end; i += stride) count += owner_[i] == 0 ? 1 : 0;
    }
    stride_ = stride;
    all_ = static_cast<float>(all);
    count_ = count;
  }

  void list(float ox, float oy) {
    std::size_t k = 0;
    for (const std::uint32_t cell : cells_) {
      const std::uint32_t end = cloud_.cell_start[cell + 2];
      for (std::uint32_t i = cloud_.cell_start[cell]; i < end; i += stride_) {
        if (owner_[i] != 0) continue;
        x_[k] = static_cast<float>(cloud_.x[i]) - ox;
        y_[k] = static_cast<float>(cloud_.y[i]) - oy;
        t_[k++] = cloud_.tau(i);
      }
    }
  }

  [[nodiscard]] std::size_t count() const { return count_; }
  /// Of the block's events.
  [[nodiscard]] float share() const { return static_cast<float>(count_ * stride_) / all_; }
  /// Events of the block that one in the list stands for.
  [[nodiscard]] float weight() const { return static_cast<float>(stride_); }

  template <class Visit>
  void for_each(Visit visit) const {
    for (std::size_t k = 0; k < count_; ++k) visit(x_[k], y_[k], t_[k]);
  }

  /// Sums of those within `band_px` of the edge (all of them where edge is null).
  [[nodiscard]] CellMoments sum(const BlockEdge* edge, float band_px) const {
    CellMoments out{};
    for_each([&](float x, float y, float t) {
      if (edge == nullptr || std::fabs(edge->distance(x, y, t)) <= band_px) add_event(&out, x, y, t);
    });
    return out;
  }

 private:
  static constexpr std::uint32_t kMaxCount = 160;

  const EventCloud& cloud_;
  const std::uint8_t* owner_;
  std::uint32_t cells_[2];  // the left one of each row
  std::uint32_t stride_;
  float all_;
  std::size_t count_ = 0;
  float x_[kMaxCount + 2], y_[kMaxCount + 2], t_[kMaxCount + 2];  // two rows of cells, each with a rest
};

/// Of two parallel edges that share a block, a regression sees one thick edge midway between them.
/// @param[in,out] edge  put on the denser one of the two
/// @return half of the way between them, px; 0, edge unchanged, where there are no two
float choose_twin(const FreeEvents& events, BlockEdge* edge) {
  constexpr int kBins = 24;
  constexpr float kBinPx = 0.5F;
  constexpr int kLeastApart = 4;       // bins: nearer edges are one to a sensor's pixels
  constexpr float kLeastOther = 0.3F;  // of the denser edge's peak
  constexpr float kMaxValley = 0.4F;   // of the other's
  float counts[kBins + 2] = {};
  events.for_each([&](float x, float y, float t) {
    const float place = edge->distance(x, y, t) / kBinPx + 0.5F * kBins;
    if (place > 0 && place < kBins) counts[static_cast<int>(place) + 1] += 1;
  });
  float smooth[kBins];
  int first = 0;
  for (int b = 0; b < kBins; ++b) {
    smooth[b] = counts[b] + 2 * counts[b + 1] + counts[b + 2];
    if (smooth[b] > smooth[first]) first = b;
  }
  int second = -1;
  for (int b = 0; b < kBins; ++b) {
    if ((b <= first - kLeastApart || b >= first + kLeastApart) && (second < 0 || smooth[b] > smooth[second]))
      second = b;
  }
  float valley = smooth[second];
  for (int b = std::min(first, second); b <= std::max(first, second); ++b) valley = std::min(valley, smooth[b]);
  if (smooth[second] < kLeastOther * smooth[first] || valley > kMaxValley * smooth[second]) return 0;
  const float shift = (static_cast<float>(first) + 0.5F - 0.5F * kBins) * kBinPx;
  edge->mx -= shift * edge->uy;
  edge->my += shift * edge->ux;
  return 0.5F * kBinPx * std::fabs(static_cast<float>(first - second));
}

/// Whether the band holds more events than chance would put there.
bool stands_out(const CellMoments& m, const FreeEvents& events, float band_px, float noise_floor,
                const SeedOptions& options) {
  constexpr float kBlockArea = 4 * kCell * kCell;
  const float covered = std::min(0.9F, 2 * band_px * 2 * kCell / kBlockArea * 1.2F);  // 1.2: the edge lies aslant
  const float on_edge = m.n * events.weight();
  const float free_events = static_cast<float>(events.count()) * events.weight();
  const float beside = std::max((free_events - on_edge) / (1 - covered), noise_floor * kBlockArea);
  return on_edge >= options.min_over_background * beside * covered + 3;
}

}  // namespace

std::size_t rank_seeds(const EventCloud& cloud, const SeedOptions& options, const SeedWorkspace& workspace,
                       std::uint32_t* dropped) {
  std::size_t count = 0;
  const std::size_t cols = cloud.cols;
  for (std::size_t polarity = 0; polarity < 2; ++polarity) {
    const std::size_t first_cell = polarity * cloud.cells();
    CellMoments* above = workspace.rows.data();
    CellMoments* below = workspace.rows.data() + cols;
    sum_row(cloud, first_cell, 0, above);
    for (std::size_t row = 0; row + 1 < cloud.rows; ++row) {
      sum_row(cloud, first_cell, row + 1, below);
      for (std::size_t col = 0; col + 1 < cols; ++col) {
        const float n = above[col].n + above[col + 1].n + below[col].n + below[col + 1].n;
        if (n < static_cast<float>(options.min_events)) continue;
        CellMoments m{};
        add_cell(&m, above[col], -kHalfCell, -kHalfCell);
        add_cell(&m, above[col + 1], kHalfCell, -kHalfCell);
        add_cell(&m, below[col], -kHalfCell, kHalfCell);
        add_cell(&m, below[col + 1], kHalfCell, kHalfCell);
        BlockEdge edge;  // NOLINT(cppcoreguidelines-pro-type-member-init): written, or not read
        if (!edge_of(m, &edge)) continue;
        const float score = (edge.along - edge.across) / (edge.across + kScoreFloorPx2) * std::sqrt(n);
        if (score <= options.min_score) continue;
        keep(workspace, {score, static_cast<std::uint32_t>(first_cell + row * cols + col)}, &count, dropped);
      }
      std::swap(above, below);
    }
  }
  if (count < workspace.seeds.size()) std::make_heap(workspace.seeds.begin(), workspace.seeds.begin() + count, better);
  std::sort_heap(workspace.seeds.begin(), workspace.seeds.begin() + count, better);
  std::fill(workspace.failures.begin(), workspace.failures.end(), std::uint8_t{0});
  return count;
}

bool refine_seed(const EventCloud& cloud, const SeedOptions& options, const CellSeed& seed,
                 Span<const std::uint8_t> owner, MovingLine* out) {
  const bool is_on = seed.block >= cloud.cells();
  const std::size_t cell = seed.block - (is_on ? cloud.cells() : 0);
  const float ox = cell_centre(cell % cloud.cols) + kHalfCell;
  const float oy = cell_centre(cell / cloud.cols) + kHalfCell;
  FreeEvents events(cloud, seed.block, owner);
  if (events.share() < kMinFreeShare) return false;
  events.list(ox, oy);
  const float weight = events.weight();
  CellMoments m{};
  BlockEdge edge{};
  float band_px = 0;
  float max_band_px = 1e9F;
  for (int round = 0; round < kRefineRounds; ++round) {
    m = events.sum(round == 0 ? nullptr : &edge, band_px);
    if (m.n * weight < static_cast<float>(options.min_events) || !edge_of(m, &edge)) return false;
    const float sigma = std::sqrt(std::max(edge.across, kMinVariancePx2));
    if (round == 0 && edge.across > kTwinVariancePx2) {
      const float apart = choose_twin(events, &edge);
      if (apart > 0) max_band_px = apart;
    }
    band_px = round == 0 ? std::clamp(2.2F * sigma, 2.0F, 4.0F) : std::clamp(2.5F * sigma, 1.5F, 2.8F);
    band_px = std::min(band_px, max_band_px);
  }
  if (edge.across > options.max_variance_px2 || edge.along < options.min_elongation * std::max(edge.across, 1.0F) ||
      m.n < options.min_share * static_cast<float>(events.count()) ||
      !stands_out(m, events, band_px, cloud.noise_floor[is_on ? 1 : 0], options)) {
    return false;
  }
  MovingLine line;
  line.cx = ox + edge.mx;
  line.cy = oy + edge.my;
  line.ux = edge.ux;
  line.uy = edge.uy;
  line.m[0] = -edge.mt * edge.speed;
  line.m[2] = edge.speed;
  line.low[0] = line.low[1] = -kCell;
  line.high[0] = line.high[1] = kCell;
  line.thickness_px = std::sqrt(std::max(edge.across, kMinVariancePx2));
  line.polarities = is_on ? 2 : 1;
  line.events = static_cast<std::uint32_t>(m.n * weight);
  *out = line;
  return true;
}

bool has_failed(const EventCloud& cloud, const SeedWorkspace& workspace, const CellSeed& seed) {
  for (const std::uint32_t row : {seed.block, seed.block + cloud.cols}) {
    for (const std::uint32_t cell : {row, row + 1}) {
      if ((workspace.failures[cell / 8] >> (cell % 8) & 1U) != 0) return true;
    }
  }
  return false;
}

void mark_failed(const EventCloud& cloud, const SeedWorkspace& workspace, const CellSeed& seed) {
  for (const std::uint32_t row : {seed.block, seed.block + cloud.cols}) {
    for (const std::uint32_t cell : {row, row + 1}) {
      std::uint8_t& marks = workspace.failures[cell / 8];
      marks = static_cast<std::uint8_t>(marks | 1U << (cell % 8));
    }
  }
}

}  // namespace lecalib
