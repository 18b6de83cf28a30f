// SPDX-License-Identifier: MIT
/// Where two edges of one polarity cross at a small angle, nobody can tell for a long stretch whose the events are. The
/// line that was found first holds those on its side, and what is left to the other one stands off from it: a fit that
/// took them would turn away.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/span.hpp"
#include "lecalib/segments/event_lanes.hpp"
#include "lecalib/segments/line_equations.hpp"
#include "lecalib/segments/line_workspace.hpp"
#include "lecalib/segments/moving_line.hpp"

namespace lecalib {

struct SharingOptions {
  /// Sine of the angle at which lines cross (0.03 to 0.2: 1.7 to 11.5 degrees). Lines at smaller angles are rows of
  /// edges or repeats, and merging's; at larger ones the stretch is short and growth bridges it.
  float min_sine = 0.03F;
  float max_sine = 0.2F;
  float reach_px = 150;           ///< between the crossing and either line's nearer end, px: further ones hide nothing
  float max_shared_share = 0.6F;  ///< of a line: of what is more, only the middle is left out
};

/// Whether the lines cross at a small angle, at mid window, where one may hide the other.
bool may_hide(const MovingLine& a, const MovingLine& b, const SharingOptions& options);

/// The stretches that a line shares with those that cross it.
class SharedStretches {
 public:
  SharedStretches() = default;
  /// @param lines  all of the window; must outlive this
  /// @param own    ids of those that are no others: the line itself and its pieces
  SharedStretches(const SharingOptions& options, Span<const MovingLine> lines, const MovingLine& line,
                  const OwnerFilter& own);

  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  /// What is known of a line beforehand: a lens bends lines that run so close nearly alike. Without that a short piece
  /// could bend anywhere in a stretch that says nothing.
  [[nodiscard]] LinePriors priors(const LinePriors& of_any, const MovingLine& line) const noexcept;

  /// Whether the line may have an event of another owner, which neighbours of it took: in a shared stretch only.
  [[nodiscard]] bool may_have(const MovingLine& line, std::uint8_t owner, float s_px, float tau) const noexcept {
    return !empty() && is_other(owner) && any_holds(line, s_px, tau);
  }
  /// Whether the place at s along `line` lies in one. It is that of the line, not of an event: which events are left
  /// out must not depend on where they scatter.
  [[nodiscard]] bool hold(const MovingLine& line, float s_px, float tau) const noexcept {
    return !empty() && any_holds(line, s_px, tau);
  }

  /// The same for several places at once. @param count  up to kBlock @return a bit for each place that lies in one
  [[nodiscard]] std::uint32_t hold_each(const MovingLine& line, const float* s_px, const float* tau,
                                        std::size_t count) const noexcept;
  static constexpr std::size_t kBlock = detail::kEventBlock;

  /// How much of the line they hold, 0 to 1.
  [[nodiscard]] float share_of(const MovingLine& line) const noexcept;

 private:
  [[nodiscard]] bool is_other(std::uint8_t owner) const noexcept;
  [[nodiscard]] bool any_holds(const MovingLine& line, float s_px, float tau) const noexcept;

  // Of more, those count for nothing that were found last, from the weakest seeds: a line that so many others cross at
  // small angles has hardly a stretch of its own, and of what is shared beyond max_shared_share only the middle goes.
  static constexpr int kMaxOthers = 6;
  const MovingLine* others_[kMaxOthers] = {};
  float reach_px_[kMaxOthers] = {};
  int count_ = 0;
};

}  // namespace lecalib
