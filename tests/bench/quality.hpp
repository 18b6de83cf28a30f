// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "bench/scenes.hpp"
#include "lecalib/core/records.hpp"

namespace lecalib::bench {

/// How detected lines compare with the true ones, each window end for itself.
///
/// A detected line lies on a true one when nine points of it, bend included, are less than 2 px beside it on average,
/// most of them between its ends. A true line is found when a detected one lies on it and covers more than half of it.
class Quality {
 public:
  void add(const Scene& scene, Span<const EventLine> lines);

  [[nodiscard]] bool is_known() const { return asked_ > 0; }
  /// Share of the true lines that are found.
  [[nodiscard]] double recall() const { return share(found_, asked_); }
  /// Share of the detected lines that lie on a true one; 1 when there is none.
  [[nodiscard]] double precision() const { return detected_ > 0 ? share(right_, detected_) : 1; }
  /// Median over the true lines found of the nearest detected one's mean distance, px; 0 when there is none.
  [[nodiscard]] double median_px() const;

 private:
  static double share(std::size_t part, std::size_t all) {
    return static_cast<double>(part) / static_cast<double>(all);
  }
  void add_end(const std::vector<const Curve*>& truth, const std::vector<Curve>& detected);

  std::size_t asked_ = 0, found_ = 0, detected_ = 0, right_ = 0;
  std::vector<double> distances_px_;
};

}  // namespace lecalib::bench
