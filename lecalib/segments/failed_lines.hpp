// SPDX-License-Identifier: MIT
/// Texture offers the same line again and again: what has failed once need not be grown from its other end as well.
#pragma once

#include <cstddef>

#include "lecalib/core/span.hpp"
#include "lecalib/segments/moving_line.hpp"

namespace lecalib {

/// Lines that were grown and did not stand the tests; the last ones, as many as the memory holds.
class FailedLines {
 public:
  explicit FailedLines(Span<MovingLine> memory) : lines_(memory) {}

  void add(const MovingLine& line) {
    if (lines_.empty()) return;
    lines_[next_] = line;
    next_ = (next_ + 1) % lines_.size();
    count_ += count_ < lines_.size() ? 1 : 0;
  }

  /// Whether the guess lies on one of them at mid window, within its extent, and goes and moves as it does there.
  [[nodiscard]] bool holds(const MovingLine& guess) const {
    for (std::size_t i = 0; i < count_; ++i) {
      if (lies_on(lines_[i], guess)) return true;
    }
    return false;
  }

 private:
  static bool lies_on(const MovingLine& line, const MovingLine& guess);

  Span<MovingLine> lines_;
  std::size_t next_ = 0;
  std::size_t count_ = 0;
};

}  // namespace lecalib
