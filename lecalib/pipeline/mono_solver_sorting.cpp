// SPDX-License-Identifier: MIT
/// Which points and lines are right, by their residuals: a part of MonoSolver.
#include <algorithm>
#include <cmath>

#include "lecalib/pipeline/mono_solver.hpp"

namespace lecalib {
namespace {

/// Largest residual, robust sigmas, of a right point: one in 10^4 has more. An edge's sigmas are careful ones, and
/// what is no edge of the model is often near to one.
constexpr double kRightSpreads = 5.0;
constexpr double kRightEdgeSpreads = 4.0;
constexpr double kLeastEdgeSpread = 0.6;

/// Largest rms residual, robust sigmas, of a right line's points from the solution without it: of two points one line
/// in 10^5 has more, and one in 4000 where some twenty others tell the sigma.
constexpr double kRightLineSpreads = 3.5;

/// Of the largest misfit of a view: what is below is judged anew once the worst are out.
constexpr double kShareOfWorst = 0.5;

}  // namespace

/// Sorts points and lines of the views used: a point beyond the limit by its standardised residual is wrong, and so is
/// a whole line where half of its points are, or which badly fits the solution without it.
/// @return whether one has changed sides
bool MonoSolver::sort_lines() {
  const Span<float> sizes = workspace_.feet;  // the next refinement begins without
  ReducedSystem system;
  if (!refiner_.standardised_residuals(sizes) || !refiner_.reduced_system(&system)) return false;
  const double spread = spread_of(sizes);
  bool changed = false;
  for (std::size_t v = 0; v < data_.views.size(); ++v) {
    if (!workspace_.guess.views[v].used) continue;
    judge_view(system, v, spread, sizes);
    if (sort_view(v, sizes)) changed = true;
  }
  return changed;
}

/// Of trusted sigmas, that are not narrowed below it.
double MonoSolver::least_spread() const { return has_edges() ? kLeastEdgeSpread : 1.0; }

/// Turns the standardised residuals of a view into shares of what is allowed: each point's own, or its line's.
void MonoSolver::judge_view(const ReducedSystem& system, std::size_t index, double spread, Span<float> sizes) {
  const View& view = data_.views[index];
  const Span<LineSums> sums = workspace_.guess.sums;
  const double limit = (has_edges() ? kRightEdgeSpreads : kRightSpreads) *
                       (options_.covariance.trust_sigma ? std::max(spread, least_spread()) : spread);
  for (LineSums& sum : sums) sum.judgement = {};
  for (std::size_t i = view.first; i < view.first + view.count; ++i) {
    sizes[i] = static_cast<float>(std::abs(static_cast<double>(sizes[i])) / limit);
    const std::uint32_t wrong = sizes[i] > 1.0F ? 1 : 0;
    LineJudgement& line = sums[data_.points[i].line].judgement;
    line.wrong_of_all += wrong;
    if (workspace_.left_out[i] != 0) continue;
    ++line.count;
    line.wrong += wrong;
  }
  for (std::size_t l = 0; l < data_.model.size(); ++l) {
    // Where a point is wrong by itself, its line is judged without it, once that is out.
    LineJudgement& line = sums[l].judgement;
    if ((line.count > 0 ? line.wrong : line.wrong_of_all) == 0) line.size = line_size(system, index, l, spread);
  }
  for (std::size_t i = view.first; i < view.first + view.count; ++i) {
    sizes[i] = std::max(sizes[i], static_cast<float>(sums[data_.points[i].line].judgement.size));
  }
}

/// The rms of a line's residuals from the solution without it, as a share of what is allowed. A wrong line spoils the
/// spread of all, so it is measured by what the others leave without it.
double MonoSolver::line_size(const ReducedSystem& system, std::size_t view, std::size_t line, double spread) const {
  std::size_t points = 0;
  const double misfit = std::max(0.0, refiner_.line_misfit(system, view, static_cast<std::uint16_t>(line), &points));
  if (points == 0) return 0.0;
  const auto num_free = std::count(policy_.free, policy_.free + kNumIntrinsics, true);
  const double unknowns = 6.0 * static_cast<double>(views_used_) + static_cast<double>(num_free);
  const double dof = static_cast<double>(refiner_.points_used()) - unknowns - static_cast<double>(points);
  double variance = spread * spread;
  if (dof >= kMinScaleDof) variance = std::min(variance, std::max(0.0, refiner_.data_cost() - misfit) / dof);
  variance =
      std::max(variance, options_.covariance.trust_sigma ? least_spread() * least_spread() : kMinSpread * kMinSpread);
  return std::sqrt(misfit / (static_cast<double>(points) * variance)) / kRightLineSpreads;
}

bool MonoSolver::sort_view(std::size_t index, Span<const float> sizes) {
  const View& view = data_.views[index];
  const Span<LineSums> sums = workspace_.guess.sums;
  // The worst ones spoil what the others leave, so they go first.
  double worst = 0.0;
  for (std::size_t i = view.first; i < view.first + view.count; ++i) {
    if (workspace_.left_out[i] == 0) worst = std::max(worst, static_cast<double>(sizes[i]));
  }
  const auto is_wrong = [&](std::size_t i) {
    const auto size = static_cast<double>(sizes[i]);
    return size > 1.0 && (workspace_.left_out[i] != 0 || size > kShareOfWorst * worst);
  };
  for (LineSums& sum : sums) sum.judgement = {};
  for (std::size_t i = view.first; i < view.first + view.count; ++i) {
    LineJudgement& line = sums[data_.points[i].line].judgement;
    ++line.count;
    if (is_wrong(i)) ++line.wrong;
  }
  bool changed = false;
  for (std::size_t i = view.first; i < view.first + view.count; ++i) {
    const LineJudgement& line = sums[data_.points[i].line].judgement;
    const bool wrong_edge = has_edges() && workspace_.wrong_edges[i] != 0;
    const std::uint8_t wrong = wrong_edge || 2 * line.wrong >= line.count || is_wrong(i) ? 1 : 0;
    changed = changed || wrong != workspace_.left_out[i];
    workspace_.left_out[i] = wrong;
  }
  if (count_lines(data_, view, sums) < kMinPosedLines) workspace_.guess.views[index].used = false;
  return changed;
}

}  // namespace lecalib
