// SPDX-License-Identifier: MIT
/// Points are counted into cells (bilinear), the counts smoothed, their gradient taken. Cells with a marked gradient
/// grow into regions of one gradient direction, the steepest first; a rectangle about each region is the segment. As in
/// LSD, angles are compared as unit vectors, the order is a counting sort, and the growth has its own queue.
#include "lecalib/segments/segment_detector.hpp"

#include <algorithm>
#include <cmath>

namespace lecalib {
namespace {

constexpr std::size_t kMinCells = 64;
constexpr std::size_t kMaxCells = 65535;  // of 16-bit indices
constexpr int kEmptyCells = 2;            // empty cells around the points, so that their area ends inside of the image
constexpr std::size_t kGradientBins = 256;
constexpr float kCellGrowth = 1.25F;

struct Box {
  float min_x, min_y, max_x, max_y;
};

Box bounding_box(Span<const PlanePoint> points) {
  Box box{points[0].x, points[0].y, points[0].x, points[0].y};
  for (const PlanePoint& p : points) {
    box = {std::min(box.min_x, p.x), std::min(box.min_y, p.y), std::max(box.max_x, p.x), std::max(box.max_y, p.y)};
  }
  return box;
}

class DensityImage {
 public:
  DensityImage(const SegmentOptions& options, const SegmentWorkspace& workspace) : options_(options), ws_(workspace) {}

  void build(Span<const PlanePoint> points) {
    choose_grid(points);
    const std::size_t size = static_cast<std::size_t>(cols_) * static_cast<std::size_t>(rows_);
    std::fill(ws_.counts.begin(), ws_.counts.begin() + size, 0.0F);
    for (const PlanePoint& p : points) splat(p);
    smooth();
    differentiate();
    occupied_mean_ = mean_over_occupied(size);
  }

  [[nodiscard]] int cols() const { return cols_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] float cell_px() const { return cell_px_; }
  [[nodiscard]] float min_gradient() const { return options_.min_gradient * occupied_mean_; }
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(cols_) * static_cast<std::size_t>(rows_); }
  [[nodiscard]] PlanePoint position(float col, float row) const {
    return {min_x_ + col * cell_px_, min_y_ + row * cell_px_};
  }

 private:
  void choose_grid(Span<const PlanePoint> points) {
    const Box box = bounding_box(points);
    const float width = box.max_x - box.min_x;
    const float height = box.max_y - box.min_y;
    const float area = std::max(width, 1.0F) * std::max(height, 1.0F);
    const float side = std::sqrt(options_.points_per_cell * area / static_cast<float>(points.size()));
    cell_px_ = std::clamp(side, options_.min_cell_px, options_.max_cell_px);
    for (;; cell_px_ *= kCellGrowth) {
      cols_ = static_cast<int>(width / cell_px_) + 2 * kEmptyCells + 2;
      rows_ = static_cast<int>(height / cell_px_) + 2 * kEmptyCells + 2;
      if (static_cast<std::size_t>(cols_) * static_cast<std::size_t>(rows_) <= ws_.image.size()) break;
    }
    min_x_ = box.min_x - static_cast<float>(kEmptyCells) * cell_px_;
    min_y_ = box.min_y - static_cast<float>(kEmptyCells) * cell_px_;
  }

  [[nodiscard]] std::size_t at(int col, int row) const { return static_cast<std::size_t>(row * cols_ + col); }

  void splat(const PlanePoint& p) {
    const float col = (p.x - min_x_) / cell_px_;
    const float row = (p.y - min_y_) / cell_px_;
    const int c = static_cast<int>(col);
    const int r = static_cast<int>(row);
    const float fc = col - static_cast<float>(c);
    const float fr = row - static_cast<float>(r);
    ws_.counts[at(c, r)] += (1 - fc) * (1 - fr);
    ws_.counts[at(c + 1, r)] += fc * (1 - fr);
    ws_.counts[at(c, r + 1)] += (1 - fc) * fr;
    ws_.counts[at(c + 1, r + 1)] += fc * fr;
  }

  /// 3 x 3 binomial; the outermost cells stay empty.
  void smooth() {
    for (std::size_t i = 0; i < size(); ++i) ws_.image[i] = {};
    const auto line = [&](int c, int r) {
      return ws_.counts[at(c - 1, r)] + 2 * ws_.counts[at(c, r)] + ws_.counts[at(c + 1, r)];
    };
    for (int r = 1; r + 1 < rows_; ++r) {
      for (int c = 1; c + 1 < cols_; ++c) {
        ws_.image[at(c, r)].density = (line(c, r - 1) + 2 * line(c, r) + line(c, r + 1)) * (1.0F / 16);
      }
    }
  }

  /// Central differences, per cell.
  void differentiate() {
    for (int r = 1; r + 1 < rows_; ++r) {
      for (int c = 1; c + 1 < cols_; ++c) {
        DensityCell& cell = ws_.image[at(c, r)];
        cell.gradient_x = 0.5F * (ws_.image[at(c + 1, r)].density - ws_.image[at(c - 1, r)].density);
        cell.gradient_y = 0.5F * (ws_.image[at(c, r + 1)].density - ws_.image[at(c, r - 1)].density);
      }
    }
  }

  [[nodiscard]] float mean_over_occupied(std::size_t size) const {
    float sum = 0;
    float squares = 0;
    for (std::size_t i = 0; i < size; ++i) {
      sum += ws_.image[i].density;
      squares += ws_.image[i].density * ws_.image[i].density;
    }
    return sum > 0 ? squares / sum : 0;  // weighted by itself, so that the empty cells do not count
  }

  const SegmentOptions& options_;
  const SegmentWorkspace& ws_;
  float cell_px_ = 1;
  float min_x_ = 0, min_y_ = 0;
  int cols_ = 0, rows_ = 0;
  float occupied_mean_ = 0;
};

float gradient_norm(const DensityCell& cell) {
  return std::sqrt(cell.gradient_x * cell.gradient_x + cell.gradient_y * cell.gradient_y);
}

/// Cells whose gradient is marked, the steepest first (to 1/256 of the steepest). @return how many
std::size_t order_by_gradient(const SegmentWorkspace& ws, std::size_t size, float min_gradient) {
  float steepest = 0;
  for (std::size_t i = 0; i < size; ++i) steepest = std::max(steepest, gradient_norm(ws.image[i]));
  if (!(steepest > 0) || steepest < min_gradient) return 0;
  const float scale = static_cast<float>(kGradientBins - 1) / steepest;
  const auto bin = [&](std::size_t i) {
    return kGradientBins - 1 - static_cast<std::size_t>(gradient_norm(ws.image[i]) * scale);
  };
  std::uint32_t start[kGradientBins + 1] = {};
  for (std::size_t i = 0; i < size; ++i) ++start[bin(i) + 1];
  for (std::size_t b = 0; b < kGradientBins; ++b) start[b + 1] += start[b];
  for (std::size_t i = 0; i < size; ++i) ws.order[start[bin(i)]++] = static_cast<std::uint16_t>(i);
  std::size_t marked = 0;
  while (marked < size && gradient_norm(ws.image[ws.order[marked]]) >= min_gradient) ++marked;
  return marked;
}

class SupportRegions {
 public:
  SupportRegions(const DensityImage& image, const SegmentOptions& options, const SegmentWorkspace& workspace)
      : image_(image), options_(options), ws_(workspace) {}

  /// Grows the region of one gradient direction about a cell; its members stand in the queue.
  std::size_t grow(std::uint16_t seed) {
    direction_x_ = direction_y_ = 0;
    std::size_t members = 0;
    add(seed, &members);
    for (std::size_t head = 0; head < members; ++head) {
      const int col = ws_.queue[head] % image_.cols();
      const int row = ws_.queue[head] / image_.cols();
      for (int r = row - 1; r <= row + 1; ++r) {
        for (int c = col - 1; c <= col + 1; ++c) try_add(c, r, &members);
      }
    }
    return members;
  }

  /// The rectangle about the members: centre and axis weighted by the gradient, length and width by extent.
  PlaneSegment rectangle(std::size_t members) const {
    float w = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
    for (std::size_t i = 0; i < members; ++i) {
      const float g = gradient_norm(ws_.image[ws_.queue[i]]);
      const PlanePoint p = cell_position(ws_.queue[i]);
      w += g;
      x += g * p.x;
      y += g * p.y;
    }
    x /= w;
    y /= w;
    for (std::size_t i = 0; i < members; ++i) {
      const float g = gradient_norm(ws_.image[ws_.queue[i]]);
      const PlanePoint p = cell_position(ws_.queue[i]);
      xx += g * (p.x - x) * (p.x - x);
      xy += g * (p.x - x) * (p.y - y);
      yy += g * (p.y - y) * (p.y - y);
    }
    // The larger eigenvalue's direction of [xx xy; xy yy], in closed form.
    const float half = 0.5F * (xx - yy);
    const float root = std::sqrt(half * half + xy * xy);
    float ux = half >= 0 ? half + root : xy;
    float uy = half >= 0 ? xy : root - half;
    const float norm = std::sqrt(ux * ux + uy * uy);
    ux = norm > 0 ? ux / norm : 1;
    uy = norm > 0 ? uy / norm : 0;
    float low = 0, high = 0, left = 0, right = 0;
    for (std::size_t i = 0; i < members; ++i) {
      const PlanePoint p = cell_position(ws_.queue[i]);
      const float s = (p.x - x) * ux + (p.y - y) * uy;
      const float d = (p.y - y) * ux - (p.x - x) * uy;
      low = std::min(low, s);
      high = std::max(high, s);
      left = std::min(left, d);
      right = std::max(right, d);
    }
    const float norm_g = std::sqrt(direction_x_ * direction_x_ + direction_y_ * direction_y_);
    return {{x + low * ux, y + low * uy},
            {x + high * ux, y + high * uy},
            right - left + image_.cell_px(),
            direction_x_ / norm_g,
            direction_y_ / norm_g};
  }

 private:
  [[nodiscard]] PlanePoint cell_position(std::uint16_t cell) const {
    const int col = cell % image_.cols();
    const int row = cell / image_.cols();
    return image_.position(static_cast<float>(col), static_cast<float>(row));
  }

  void try_add(int col, int row, std::size_t* members) {
    if (col < 0 || row < 0 || col >= image_.cols() || row >= image_.rows()) return;
    const auto i = static_cast<std::uint16_t>(row * image_.cols() + col);
    if (ws_.taken[i] != 0) return;
    const DensityCell& cell = ws_.image[i];
    const float norm = gradient_norm(cell);
    if (norm < image_.min_gradient()) return;
    const float norm_region = std::sqrt(direction_x_ * direction_x_ + direction_y_ * direction_y_);
    const float product = cell.gradient_x * direction_x_ + cell.gradient_y * direction_y_;
    if (product >= options_.min_cosine * norm * norm_region) add(i, members);
  }

  void add(std::uint16_t i, std::size_t* members) {
    ws_.taken[i] = 1;
    ws_.queue[(*members)++] = i;
    direction_x_ += ws_.image[i].gradient_x;
    direction_y_ += ws_.image[i].gradient_y;
  }

  const DensityImage& image_;
  const SegmentOptions& options_;
  const SegmentWorkspace& ws_;
  float direction_x_ = 0, direction_y_ = 0;  // sum of the members' gradients
};

bool valid(const SegmentOptions& o) {
  return o.min_cell_px > 0 && o.max_cell_px >= o.min_cell_px && o.points_per_cell > 0 && o.min_gradient > 0;
}

}  // namespace

Status find_plane_segments(Span<const PlanePoint> points, const SegmentOptions& options,
                           const SegmentWorkspace& workspace, Span<PlaneSegment> out, std::size_t* count,
                           SegmentStats* stats) {
  SegmentStats unused;
  if (stats == nullptr) stats = &unused;
  if (points.empty() || !valid(options) || workspace.image.size() > kMaxCells) return Status::invalid_argument;
  if (workspace.image.size() < kMinCells) return Status::buffer_too_small;

  DensityImage image(options, workspace);
  image.build(points);
  const std::size_t marked = order_by_gradient(workspace, image.size(), image.min_gradient());
  std::fill(workspace.taken.begin(), workspace.taken.begin() + image.size(), std::uint8_t{0});
  SupportRegions regions(image, options, workspace);
  std::size_t found = 0;
  for (std::size_t i = 0; i < marked; ++i) {
    if (workspace.taken[workspace.order[i]] != 0) continue;
    const std::size_t members = regions.grow(workspace.order[i]);
    const PlaneSegment segment = regions.rectangle(members);
    const float dx = segment.b.x - segment.a.x;
    const float dy = segment.b.y - segment.a.y;
    const float length = std::sqrt(dx * dx + dy * dy);
    const float cell = image.cell_px();
    const float cells_in_rectangle = (length + cell) * segment.width_px / (cell * cell);
    if (length < options.min_length_px) {
      ++stats->too_short;
    } else if (static_cast<float>(members) < options.min_aligned_share * cells_in_rectangle) {
      ++stats->not_straight;
    } else if (found == out.size()) {
      ++stats->dropped;
    } else {
      out[found++] = segment;
    }
  }
  *count = found;
  stats->segments += static_cast<std::uint32_t>(found);
  return Status::ok;
}

}  // namespace lecalib
