// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lecalib/math/cholesky.hpp"
#include "lecalib/math/so3.hpp"
#include "lecalib/math/trigonometry.hpp"
#include "lecalib/solve/next_view.hpp"

namespace lecalib {
namespace {

constexpr std::size_t kUsefulLines = 4;
/// Windows after which missing lines or motion are no accident of the begin.
constexpr std::uint32_t kFirstWindows = 4;
/// Lines that wander over less than so many times the cells of one window have hardly moved.
constexpr float kLeastWander = 1.5F;
/// ... unless they are everywhere.
constexpr float kEverywhere = 0.7F;
/// Columns or rows of cells at each side that belong to an edge of the image.
constexpr int kEdgeCells = 2;

/// What a good calibration knows: one sigma of fx, fy as a share of them, and of cx, cy as one of the width.
constexpr double kGoodShare[4] = {0.005, 0.005, 0.01, 0.01};
/// A move that makes sigma so many times smaller than staying does is worth advising ...
constexpr double kWorthwhile = 1.15;
/// ... unless another one is better still by this factor.
constexpr double kMuchWorse = 1.3;

/// What points of edges are off, px, and what is known of any camera: see ParameterPolicy.
constexpr double kSigmaPx = 0.1;
constexpr double kAspectSigma = 0.005;
constexpr double kCentreShare = 0.05;
constexpr double kLensSigma[] = {0.5, 0.1, 1e-3, 1e-3};  ///< k1 k2 p1 p2

void advise(CoverageHint hint, Coverage* coverage) {
  for (CoverageHint& place : coverage->hints) {
    if (place != CoverageHint::none) continue;
    place = hint;
    return;
  }
}

/// Share of the cells of a rectangle that have lines in two windows or more.
float share_of(const Coverage& coverage, int row, int rows, int column, int columns) {
  int covered = 0;
  for (int r = row; r < row + rows; ++r) {
    for (int c = column; c < column + columns; ++c) covered += coverage.cells[r][c] >= 2 ? 1 : 0;
  }
  return static_cast<float>(covered) / static_cast<float>(rows * columns);
}

struct ImageSide {
  CoverageHint hint;
  int row, rows, column, columns;
};
constexpr ImageSide kImageSides[] = {
    {CoverageHint::fill_left, 0, kCoverageRows, 0, kEdgeCells},
    {CoverageHint::fill_right, 0, kCoverageRows, kCoverageColumns - kEdgeCells, kEdgeCells},
    {CoverageHint::fill_top, 0, kEdgeCells, 0, kCoverageColumns},
    {CoverageHint::fill_bottom, kCoverageRows - kEdgeCells, kEdgeCells, 0, kCoverageColumns},
};

/// Ranges of tilt, roll and distance.
void measure_poses(const CoverageSolution& solution, Span<const WindowPoses> poses, Coverage* coverage) {
  Vec3 centre = Vec3::Zero();
  for (const ModelLine& line : solution.model) {
    centre += Eigen::Map<const Vec3>(line.p) + Eigen::Map<const Vec3>(line.q);
  }
  centre /= 2.0 * static_cast<double>(solution.model.size());
  double nearest = 1e300, farthest = 0, least_roll = 0, most_roll = 0, least_cosine = 1;
  const Mat3 R_first = rotation_of(poses[0].begin);
  for (const WindowPoses& window : poses) {
    const Mat3 R = rotation_of(window.begin);
    const double distance = (R * centre + translation_of(window.begin)).norm();
    nearest = std::min(nearest, distance);
    farthest = std::max(farthest, distance);
    const double roll = so3_log(R * R_first.transpose()).z();
    least_roll = std::min(least_roll, roll);
    most_roll = std::max(most_roll, roll);
    // The camera's axis, in the object's frame: a turn about the axis leaves it where it is.
    for (const WindowPoses& other : poses) {
      least_cosine = std::min(least_cosine, R.row(2).dot(rotation_of(other.begin).row(2)));
    }
  }
  const double sine = std::sqrt(std::max(0.0, 1.0 - least_cosine * least_cosine));
  coverage->matched_windows = static_cast<std::uint32_t>(poses.size());
  coverage->tilt_deg = static_cast<float>(rad_to_deg(arc_tan2(sine, least_cosine)));
  coverage->roll_deg = static_cast<float>(rad_to_deg(most_roll - least_roll));
  coverage->distance_min_m = static_cast<float>(nearest);
  coverage->distance_max_m = static_cast<float>(farthest);
}

/// What is known of any camera before it is used.
Mat9 prior_information(const Camera& camera) {
  Mat9 information = Mat9::Identity();
  const double aspect = 1.0 / (kAspectSigma * kAspectSigma);
  const double width = camera.width;
  information(0, 0) = aspect / (camera.fx * camera.fx) + 0.25 / (width * width);
  information(1, 1) = aspect / (camera.fy * camera.fy) + 0.25 / (width * width);
  information(0, 1) = information(1, 0) = -aspect / (camera.fx * camera.fy);
  information(2, 2) = information(3, 3) = 1.0 / (kCentreShare * kCentreShare * width * width);
  for (int i = 0; i < 4; ++i) information(4 + i, 4 + i) = 1.0 / (kLensSigma[i] * kLensSigma[i]);
  return information;
}

/// Information about the intrinsics: that of the solution, or what the poses can give at best.
/// @return false where there is none
bool information_of(const CoverageSolution& solution, Span<const WindowPoses> poses, bool (&held)[9], Mat9* out) {
  for (std::size_t i = 0; i < 9; ++i) {
    held[i] = solution.covariance != nullptr ? !(solution.covariance[10 * i] > 0.0) : i == 8;
  }
  if (solution.covariance != nullptr) {
    Mat9 covariance = Eigen::Map<const Mat9>(solution.covariance);  // symmetric: either order of its entries will do
    for (Eigen::Index i = 0; i < 9; ++i) {
      if (held[i]) covariance(i, i) = 1.0;
    }
    Cholesky<9> factor;
    if (!factor.factor(covariance)) return false;
    *out = factor.solve(Mat9(Mat9::Identity()));
    return true;
  }
  Mat9 seen = Mat9::Zero();
  for (const WindowPoses& window : poses) {
    (void)add_view_information(solution.camera, solution.model, window.begin, kSigmaPx, &seen);
  }
  seen.row(8).setZero();
  seen.col(8).setZero();
  *out = prior_information(solution.camera) + seen;
  return true;
}

/// Fills sigma_share and worst. @return how many times the worst one's sigma is what a good calibration has; infinite
/// where nothing is known of it
double judge_sigmas(const CoverageSolution& solution, const Mat9& information, Coverage* coverage) {
  Cholesky<9> factor;
  if (!factor.factor(information)) return std::numeric_limits<double>::infinity();
  const Mat9 covariance = factor.solve(Mat9(Mat9::Identity()));
  const double scale[4] = {solution.camera.fx, solution.camera.fy, 1.0 * solution.camera.width,
                           1.0 * solution.camera.width};
  double worst = 0.0;
  for (int i = 0; i < 4; ++i) {
    const double share = std::sqrt(covariance(i, i)) / scale[i];
    coverage->sigma_share[i] = static_cast<float>(share);
    if (share / kGoodShare[i] <= worst) continue;
    worst = share / kGoodShare[i];
    coverage->worst = static_cast<std::uint8_t>(i);
  }
  return worst;
}

constexpr CoverageHint hint_of(std::size_t move) {
  switch (static_cast<ViewMove>(move)) {
    case ViewMove::stay: return CoverageHint::none;
    case ViewMove::tilt: return CoverageHint::tilt;
    case ViewMove::roll: return CoverageHint::roll;
    case ViewMove::closer: return CoverageHint::come_closer;
    case ViewMove::away: return CoverageHint::move_away;
    case ViewMove::left: return CoverageHint::fill_left;
    case ViewMove::right: return CoverageHint::fill_right;
    case ViewMove::top: return CoverageHint::fill_top;
    case ViewMove::bottom: return CoverageHint::fill_bottom;
  }
  return CoverageHint::none;
}

/// The moves that narrow the worst parameter most, the best first.
void advise_moves(const MoveForecast& forecast, Coverage* coverage) {
  bool given[kNumViewMoves] = {};
  const double stay = forecast.sigma[static_cast<std::size_t>(ViewMove::stay)];
  double first = 0.0;
  for (std::size_t round = 0; round + 1 < kMaxHintsAtOnce; ++round) {
    std::size_t best = kNumViewMoves;
    for (std::size_t m = 0; m < kNumViewMoves; ++m) {
      if (!given[m] && (best == kNumViewMoves || forecast.sigma[m] < forecast.sigma[best])) best = m;
    }
    const double sigma = forecast.sigma[best];
    if (sigma * kWorthwhile > stay || (round > 0 && sigma > kMuchWorse * first)) return;
    if (round == 0) first = sigma;
    given[best] = true;
    advise(hint_of(best), coverage);
  }
}

}  // namespace

const char* to_string(CoverageHint hint) noexcept {
  switch (hint) {
    case CoverageHint::none: return "none";
    case CoverageHint::show_object: return "show_object";
    case CoverageHint::move: return "move";
    case CoverageHint::fill_left: return "fill_left";
    case CoverageHint::fill_right: return "fill_right";
    case CoverageHint::fill_top: return "fill_top";
    case CoverageHint::fill_bottom: return "fill_bottom";
    case CoverageHint::tilt: return "tilt";
    case CoverageHint::roll: return "roll";
    case CoverageHint::come_closer: return "come_closer";
    case CoverageHint::move_away: return "move_away";
    case CoverageHint::more_contrast: return "more_contrast";
    case CoverageHint::enough: return "enough";
  }
  return "unknown";
}

std::size_t Coverage::num_hints() const {
  std::size_t count = 0;
  while (count < kMaxHintsAtOnce && hints[count] != CoverageHint::none) ++count;
  return count;
}

void CoverageMap::clear(std::uint16_t width, std::uint16_t height) {
  seen_ = {};
  width_ = width;
  height_ = height;
}

void CoverageMap::add(Span<const EventLine> lines) {
  ++seen_.windows;
  if (lines.size() >= kUsefulLines) ++seen_.useful_windows;
  bool hit[kCoverageRows][kCoverageColumns] = {};
  const float cell_x = static_cast<float>(width_) / kCoverageColumns;
  const float cell_y = static_cast<float>(height_) / kCoverageRows;
  float travel = 0;
  for (const EventLine& line : lines) {
    const float x1 = 0.5F * (line.begin.x1 + line.end.x1), y1 = 0.5F * (line.begin.y1 + line.end.y1);
    const float dx = 0.5F * (line.begin.x2 + line.end.x2) - x1, dy = 0.5F * (line.begin.y2 + line.end.y2) - y1;
    const float length = std::sqrt(dx * dx + dy * dy);
    if (!(length > 0) || !(length < 1e6F)) continue;
    const float moved_x = 0.5F * (line.end.x1 + line.end.x2 - line.begin.x1 - line.begin.x2);
    const float moved_y = 0.5F * (line.end.y1 + line.end.y2 - line.begin.y1 - line.begin.y2);
    travel += std::fabs(moved_y * dx - moved_x * dy) / length;
    const int steps = 1 + static_cast<int>(2 * length / std::min(cell_x, cell_y));
    for (int i = 0; i <= steps; ++i) {
      const float s = static_cast<float>(i) / static_cast<float>(steps);
      const int column = static_cast<int>(std::floor((x1 + s * dx) / cell_x));
      const int row = static_cast<int>(std::floor((y1 + s * dy) / cell_y));
      if (column >= 0 && column < kCoverageColumns && row >= 0 && row < kCoverageRows) hit[row][column] = true;
    }
  }
  if (!lines.empty()) seen_.travel_px += travel / static_cast<float>(lines.size());
  for (int r = 0; r < kCoverageRows; ++r) {
    for (int c = 0; c < kCoverageColumns; ++c) {
      if (hit[r][c] && seen_.cells[r][c] < 0xffff) ++seen_.cells[r][c];
    }
  }
}

void advise_collecting(Coverage* coverage) {
  float visits = 0;
  for (const auto& row : coverage->cells) {
    for (const std::uint16_t cell : row) visits += static_cast<float>(cell);
  }
  coverage->covered_share = share_of(*coverage, 0, kCoverageRows, 0, kCoverageColumns);
  for (CoverageHint& hint : coverage->hints) hint = CoverageHint::none;
  if (coverage->windows < kFirstWindows) return;
  if (2 * coverage->useful_windows < coverage->windows) {
    advise(CoverageHint::show_object, coverage);
    return;
  }
  const float cells_at_once = visits / static_cast<float>(coverage->windows);
  constexpr float kCells = kCoverageRows * kCoverageColumns;
  if (coverage->covered_share * kCells < std::min(kLeastWander * cells_at_once, kEverywhere * kCells)) {
    advise(CoverageHint::move, coverage);
  }
  for (const ImageSide& side : kImageSides) {
    if (share_of(*coverage, side.row, side.rows, side.column, side.columns) < 0.25F) advise(side.hint, coverage);
  }
}

void advise_found(const CoverageSolution& solution, Span<const WindowPoses> poses, Coverage* coverage) {
  if (poses.empty() || solution.model.empty() || !(solution.camera.fx > 0.0)) return;
  measure_poses(solution, poses, coverage);
  bool held[9] = {};
  Mat9 information;
  if (!information_of(solution, poses, held, &information)) return;
  const double worst = judge_sigmas(solution, information, coverage);
  for (CoverageHint& hint : coverage->hints) hint = CoverageHint::none;
  if (solution.solved && worst <= 1.0) {
    advise(CoverageHint::enough, coverage);
    return;
  }
  if (solution.faint) advise(CoverageHint::more_contrast, coverage);
  // The window that shows most of the object stands for where it is; of equals the last.
  const WindowPoses* from = &poses[0];
  for (const WindowPoses& window : poses) {
    if (window.num_lines >= from->num_lines) from = &window;
  }
  MoveForecast forecast;
  if (coverage->worst < 4 &&
      forecast_moves(solution.camera, solution.model, information, held, from->begin, coverage->worst, &forecast)) {
    advise_moves(forecast, coverage);
  }
}

}  // namespace lecalib
