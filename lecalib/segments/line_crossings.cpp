// SPDX-License-Identifier: MIT
#include "lecalib/segments/line_crossings.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/chance.hpp"
#include "lecalib/math/robust_loss.hpp"
#include "lecalib/segments/corridor.hpp"
#include "lecalib/segments/shape_cells.hpp"

namespace lecalib {
namespace {

constexpr std::size_t kCellPixels = std::size_t{kCloudCellPx} * kCloudCellPx;
constexpr float kOffBandPx = 1;  // the corridor is that of the line, the band that of its shape

/// A place's weight is its share of the line.
constexpr float kPlaceBorder = kEdgePlaceWeights[1];

constexpr int kCrossingRounds = 4;
constexpr float kFirstSpreadPx = 0.5F;
constexpr float kLeastSpreadPx = 0.03F;
constexpr float kLeastBandPx = 0.25F;
constexpr float kBandSpreads = 3;

/// Which event of a crossing (from 0, and between two of them) stands where the intensity is half way.
class HalfWay {
 public:
  static constexpr std::size_t kMaxCount = 40;  // beyond, the bright end's step is the same

  HalfWay(float threshold, bool on) {
    const float step = 1 + threshold * (1 + threshold * (0.5F + threshold * (1.0F / 6 + threshold / 24)));  // e^theta
    float contrast = step;
    for (std::size_t n = 1; n <= kMaxCount; ++n) {
      contrast *= step;
      const float log_contrast = static_cast<float>(n + 1) * threshold;
      const float below_bright = natural_log(2 * contrast / (1 + contrast));
      const float way = on ? log_contrast - below_bright : below_bright;
      index_[n] = std::clamp(way / threshold - 1.5F, 0.0F, static_cast<float>(n - 1));
    }
  }

  [[nodiscard]] float time(const float* times, std::size_t n) const {
    const float at = index_[std::min(n, kMaxCount)];
    const auto k = static_cast<std::size_t>(at);
    if (k + 1 >= n) return times[n - 1];
    return times[k] + (at - static_cast<float>(k)) * (times[k + 1] - times[k]);
  }

 private:
  float index_[kMaxCount + 1] = {};
};

/// By how much virtual events trail their edge, px, by the mean number n of events in a crossing: what the first event
/// (OFF) or the last (ON) stands off half way, for a pixel that sees an edge blurred by 0.55 px (one sigma) and begins
/// anywhere within a threshold.
float trailing_px(bool on, float n) {
  constexpr int kLast = 5;
  constexpr float kCounts[] = {1.0F, 1.2F, 1.45F, 1.8F, 2.3F, 3.0F};
  constexpr float kShifts[2][kLast + 1] = {{0.51F, 0.37F, 0.265F, 0.165F, 0.075F, 0},
                                           {0.36F, 0.23F, 0.145F, 0.045F, 0.005F, 0}};
  const float* const shifts = kShifts[on ? 1 : 0];
  if (n <= kCounts[0]) return shifts[0];
  for (int i = 0; i < kLast; ++i) {
    if (n < kCounts[i + 1]) {
      return shifts[i] + (n - kCounts[i]) / (kCounts[i + 1] - kCounts[i]) * (shifts[i + 1] - shifts[i]);
    }
  }
  return shifts[kLast];
}

struct StraightLine {
  float mean, slope, middle;
  [[nodiscard]] float at(float u) const { return mean + slope * (u - middle); }
};

class CrossingFitter {
 public:
  CrossingFitter(const EventCloud& cloud, float window_us, const CrossingOptions& options,
                 const LineWorkspace& workspace, const MovingLine& line, const LineShape& shape)
      : cloud_(cloud),
        half_window_us_(0.5F * window_us),
        options_(options),
        ws_(workspace),
        line_(line),
        on_(line.polarities == 2),
        shape_(shape),
        motion_(shape.terms[2]),
        turn_(shape.terms[3]),
        half_way_(options.threshold, on_),
        cells_(shape_columns(shape)) {}

  /// Lists the complete crossings, one for each pixel.
  void collect() {
    const float travel = std::max(2 * std::fabs(motion_), 0.5F);
    const float swept = line_.length() * travel;
    const float per_pixel = static_cast<float>(line_.events) / swept;
    dark_margin_px_ =
        std::min(options_.dark_margin_px + options_.dark_margin_per_event_px * per_pixel, options_.max_dark_margin_px);
    stride_ = 1 + static_cast<std::uint32_t>(swept / static_cast<float>(ws_.along.size()));
    std::size_t cell = 0;
    const auto take_event = [&](const LineEvent& event) {
      const std::uint8_t owner = ws_.owner[event.index];
      if (owner != 0 && owner != line_.id) return;
      const float across = shape_at(shape_.terms, shape_.position(event.along_px), event.tau);
      if (!(std::fabs(event.across_px - across) <= options_.band_px)) return;
      const std::size_t x = cloud_.x[event.index];
      const std::size_t y = cloud_.y[event.index];
      const std::size_t here = (y >> kCloudCellShift) * cloud_.cols + (x >> kCloudCellShift);
      if (here != cell || listed_ == ws_.pixel.size()) take_cell(cell);
      cell = here;
      constexpr std::size_t kMask = kCloudCellPx - 1;
      ws_.pixel[listed_] = static_cast<std::uint8_t>((y & kMask) << kCloudCellShift | (x & kMask));
      ws_.times[listed_++] = event.tau;
    };
    for_each_near_line(cloud_, line_, shape_.low_px(), shape_.high_px(), options_.band_px + kOffBandPx,
                       line_.polarities, 1, take_event);
    take_cell(cell);
  }

  [[nodiscard]] std::uint32_t dropped() const { return dropped_; }

  /// Moves the shape from the events to the crossings. @return false with too few, or where the equations are singular
  bool fit(const LineShapeOptions& shape_options, const LinePriors& priors) {
    spread_px_ = kFirstSpreadPx;
    for (int round = 0; round < kCrossingRounds; ++round) {
      if (round == 1) drop_cut_crossings();
      if (count_ < options_.min_crossings) return false;
      sum_cells();
      if (round > 1) misfit2_ = cells_.misfit2(spread_px_ * spread_px_);
      ShapeEquations equations;
      cells_.add_to(&equations, spread_px_ * spread_px_, misfit2_);
      add_shape_priors(shape_options, priors, shape_, &equations);
      equations.add_prior(2, options_.motion_change_px, shape_.terms[2] - motion_);
      equations.add_prior(3, options_.motion_change_px, shape_.terms[3] - turn_);
      float change[kNumShapeTerms];
      if (!equations.solve(change)) return false;
      for (std::size_t i = 0; i < count_; ++i) ws_.across[i] -= shape_at(change, ws_.along[i], ws_.tau[i]);
      for (int i = 0; i < kNumShapeTerms; ++i) shape_.terms[i] += change[i];
      spread_px_ = std::max(spread(), kLeastSpreadPx);
      equations_ = equations;
    }
    return true;
  }

  [[nodiscard]] LineEdge edge() const {
    LineEdge out;
    const float speed = shape_.terms[2];
    const StraightLine events = events_along();
    float variance[3] = {};
    for (int t = 0; t < 2; ++t) {
      const float tau = t == 0 ? -kEdgeTime : kEdgeTime;
      for (int i = 0; i < 3; ++i) {
        const float u = kEdgePlaces[i];
        const float s = shape_.middle_px + u * shape_.half_px;
        const float trailing = trailing_px(on_, events.at(u));
        const float d = shape_at(shape_.terms, u, tau) + (speed > 0 ? trailing : -trailing);
        out.x[t][i] = line_.x(s, d);
        out.y[t][i] = line_.y(s, d);
        variance[i] += 0.5F * equations_.variance(u, tau);
      }
    }
    // What is shared moves both times alike; as an error of each by itself it counts twice.
    const float shared = options_.shared_error_px * std::max(1.0F, spread_px_ / options_.shared_error_scatter_px);
    std::size_t counts[3] = {};
    count_by_place(counts);
    for (int i = 0; i < 3; ++i) {
      const float wanted = options_.shared_crossings * kEdgePlaceWeights[i];
      const float few = std::max(1.0F, wanted / static_cast<float>(1 + counts[i]));
      out.sigma_px[i] = std::sqrt(variance[i] + 2 * few * shared * shared / kEdgePlaceWeights[i]);
    }
    out.scatter_px = spread_px_;
    out.events_per_crossing = events.mean;
    out.speed_px_per_s = speed / half_window_us_ * 1e6F;
    out.crossings = static_cast<std::uint32_t>(count_);
    return out;
  }

 private:
  /// Sorts the listed events of a cell by pixel, which keeps them in order of time, and takes each pixel's.
  void take_cell(std::size_t cell) {
    std::uint16_t ends[kCellPixels] = {};
    for (std::size_t i = 0; i < listed_; ++i) ++ends[ws_.pixel[i]];
    std::uint16_t sum = 0;
    for (std::uint16_t& end : ends) {
      const std::uint16_t events = end;
      end = sum;
      sum = static_cast<std::uint16_t>(sum + events);
    }
    float* const sorted = ws_.times.data() + ws_.pixel.size();
    for (std::size_t i = 0; i < listed_; ++i) sorted[ends[ws_.pixel[i]]++] = ws_.times[i];
    listed_ = 0;
    const auto x = static_cast<float>((cell % cloud_.cols) << kCloudCellShift);
    const auto y = static_cast<float>((cell / cloud_.cols) << kCloudCellShift);
    std::size_t first = 0;
    for (std::size_t p = 0; p < kCellPixels; first = ends[p], ++p) {
      if (ends[p] == first) continue;
      take_pixel(x + static_cast<float>(p & (kCloudCellPx - 1)), y + static_cast<float>(p >> kCloudCellShift),
                 sorted + first, ends[p] - first);
    }
  }

  void take_pixel(float x, float y, const float* times, std::size_t count) {
    const float s = line_.along(x, y);
    if (std::min(s - shape_.low_px(), shape_.high_px() - s) < end_margin_px()) return;
    const float u = shape_.position(s);
    const float d = line_.across(x, y);
    float half_travel = 0;
    if (!passes(u, d, &half_travel)) return;
    if (pixels_++ % stride_ != 0 || count_ == ws_.along.size()) {
      ++dropped_;
      return;
    }
    const float gap_us =
        std::clamp(options_.max_gap_px / half_travel * half_window_us_, options_.min_gap_us, options_.max_gap_us);
    const float gap = gap_us / half_window_us_;
    std::size_t best = 0;
    std::size_t most = 0;
    for (std::size_t i = 0, start = 0; i < count; ++i) {
      if (i + 1 < count && times[i + 1] - times[i] <= gap) continue;
      if (i + 1 - start > most) {
        most = i + 1 - start;
        best = start;
      }
      start = i + 1;
    }
    if (most > options_.max_events) return;
    const float tau = half_way_.time(times + best, most);
    ws_.along[count_] = u;
    ws_.tau[count_] = tau;
    ws_.crossing_events[count_] = static_cast<std::uint8_t>(most);
    ws_.across[count_++] = d - shape_at(shape_.terms, u, tau);
  }

  /// Collected by the shape of the events, which lies on the edge's dark side, pixels may have lost their events of the
  /// bright side to the window's begin or end. The edge itself, found by now, tells these.
  void drop_cut_crossings() {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const float u = ws_.along[i];
      const float d = ws_.across[i] + shape_at(shape_.terms, u, ws_.tau[i]);
      const float begin = shape_at(shape_.terms, u, -1);
      const float end = shape_at(shape_.terms, u, 1);
      const float on_bright_side = (on_ ? end - d : d - begin) * (end > begin ? 1.0F : -1.0F);
      if (on_bright_side < options_.edge_margin_px) continue;
      ws_.along[kept] = u;
      ws_.across[kept] = ws_.across[i];
      ws_.tau[kept] = ws_.tau[i];
      ws_.crossing_events[kept++] = ws_.crossing_events[i];
    }
    count_ = kept;
  }

  [[nodiscard]] float end_margin_px() const {
    constexpr float kMaxShare = 0.1F;
    return std::min(options_.end_margin_px, 2 * kMaxShare * shape_.half_px);
  }

  /// Whether the line passes the pixel entirely, in one direction.
  bool passes(float u, float d, float* half_travel) const {
    constexpr float kNearEnd = 0.9F;
    const float begin = shape_at(shape_.terms, u, -1);
    const float end = shape_at(shape_.terms, u, 1);
    const float travel = end - begin;
    const float first = shape_at(shape_.terms, u, -kNearEnd) - begin;
    const float last = end - shape_at(shape_.terms, u, kNearEnd);
    if (first * travel <= 0 || last * travel <= 0) return false;  // it turns back
    *half_travel = 0.5F * std::fabs(travel);
    const float before = travel > 0 ? d - begin : begin - d;
    const float after = std::fabs(travel) - before;
    return before >= (on_ ? dark_margin_px_ : options_.bright_margin_px) &&
           after >= (on_ ? options_.bright_margin_px : dark_margin_px_);
  }

  void sum_cells() {
    cells_.clear();
    const float band = std::max(kBandSpreads * spread_px_, kLeastBandPx);
    for (std::size_t i = 0; i < count_; ++i) {
      const float share = ws_.across[i] / band;
      const float weight = 1 - share * share;
      if (weight > 0) cells_.add(ws_.along[i], ws_.tau[i], weight, ws_.across[i]);
    }
  }

  /// Crossings in the stretch of the line that each place stands for. A line that turns has few where it hardly moves.
  void count_by_place(std::size_t (&counts)[3]) const {
    for (std::size_t i = 0; i < count_; ++i) {
      const float u = ws_.along[i];
      ++counts[u < -kPlaceBorder ? 0 : u < kPlaceBorder ? 1 : 2];
    }
  }

  /// Events in a crossing by its place: what lies behind an object changes along its outline, and contrast with it.
  [[nodiscard]] StraightLine events_along() const {
    float events = 0, places = 0, squares = 0, products = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const float n = ws_.crossing_events[i];
      const float u = ws_.along[i];
      events += n;
      places += u;
      squares += u * u;
      products += u * n;
    }
    const auto count = static_cast<float>(count_);
    const float middle = places / count;
    const float variance = squares - middle * places;
    return {events / count, variance > 0 ? (products - middle * events) / variance : 0.0F, middle};
  }

  [[nodiscard]] float spread() const {
    float* const sizes = ws_.times.data();
    for (std::size_t i = 0; i < count_; ++i) sizes[i] = std::fabs(ws_.across[i]);
    std::nth_element(sizes, sizes + count_ / 2, sizes + count_);
    return static_cast<float>(kGaussianOverMedian) * sizes[count_ / 2];
  }

  const EventCloud& cloud_;
  const float half_window_us_;
  const CrossingOptions& options_;
  const LineWorkspace& ws_;  // along, across and tau hold the crossings: u, residual, tau
  const MovingLine& line_;
  const bool on_;
  LineShape shape_;
  const float motion_, turn_;  // of the events' shape
  HalfWay half_way_;
  ShapeCells cells_;
  ShapeEquations equations_;
  float dark_margin_px_ = 0;
  std::uint32_t stride_ = 1;  // one of so many pixels is taken
  std::uint32_t pixels_ = 0;
  std::uint32_t dropped_ = 0;
  std::size_t listed_ = 0;  // events of the cell at hand
  std::size_t count_ = 0;   // crossings
  float spread_px_ = 0;     // robust, of a crossing
  float misfit2_ = 0;
};

}  // namespace

bool fit_crossings(const EventCloud& cloud, const CrossingFit& fit, const LineWorkspace& workspace,
                   const MovingLine& line, const LineShape& shape, LineEdge* out, std::uint32_t* dropped) {
  if (line.polarities != 1 && line.polarities != 2) return false;
  CrossingFitter fitter(cloud, fit.window_us, fit.crossings, workspace, line, shape);
  fitter.collect();
  *dropped += fitter.dropped();
  if (!fitter.fit(fit.shape, fit.priors)) return false;
  *out = fitter.edge();
  return true;
}

}  // namespace lecalib
