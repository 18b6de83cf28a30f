// SPDX-License-Identifier: MIT
/// What a recording shows so far, and what it lacks.
///
/// While events are collected only the lines in the image are known: where they were seen and how far they moved. Once
/// the object is found, its poses tell how it was tilted and how far away it was. What is advised then is what would
/// narrow the least known of fx, fy, cx, cy most (see next_view.hpp): no rule of thumb, and nothing is advised that
/// brings little.
#pragma once

#include <cstdint>

#include "lecalib/core/records.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/match/line_matcher.hpp"

namespace lecalib {

inline constexpr int kCoverageColumns = 8;
inline constexpr int kCoverageRows = 6;

/// One thing to do next. Values are stable.
enum class CoverageHint : std::uint8_t {
  none = 0,
  show_object = 1,  ///< hardly any straight edges are seen: bring the object into view
  move = 2,         ///< edges are seen in few places: move the camera or the object
  fill_left = 3,    ///< show the object in this part of the image
  fill_right = 4,
  fill_top = 5,
  fill_bottom = 6,
  tilt = 7,  ///< tilt the object, or look at it from another side
  roll = 8,  ///< turn the camera on its side
  come_closer = 9,
  move_away = 10,
  more_contrast = 11,  ///< most edges make about one event per pixel: more light, or an object of more contrast
  enough = 12,         ///< the camera is known well
};
inline constexpr std::size_t kNumCoverageHints = 13;
/// The hint's name: "fill_left". Never null.
const char* to_string(CoverageHint hint) noexcept;

inline constexpr std::size_t kMaxHintsAtOnce = 4;

/// Fixed size, for firmware to keep and to send.
struct Coverage {
  std::uint32_t windows = 0;         ///< in which lines were looked for
  std::uint32_t useful_windows = 0;  ///< with at least 4 lines
  /// Windows with a line in each cell of the image, rows from the top.
  std::uint16_t cells[kCoverageRows][kCoverageColumns] = {};
  float covered_share = 0;  ///< of the cells, with a line in two windows or more
  float travel_px = 0;      ///< how far lines moved across themselves, summed over the windows

  // Of the windows in which the object was found; 0 before it is looked for.
  std::uint32_t matched_windows = 0;
  float tilt_deg = 0;        ///< largest angle between two directions from which it was seen
  float roll_deg = 0;        ///< largest turn about the camera's axis between two of them
  float distance_min_m = 0;  ///< of the model's centre
  float distance_max_m = 0;

  /// fx fy cx cy: one sigma, as shares of the focal length and of the image's width. What the poses seen can give at
  /// best, or that of the solution where there is one. 0: not known.
  float sigma_share[4] = {};
  std::uint8_t worst = 0xFF;  ///< index of the one that is furthest from good, or 0xFF: not known

  CoverageHint hints[kMaxHintsAtOnce] = {};  ///< the most useful one first; none behind the last
  [[nodiscard]] std::size_t num_hints() const;
};

/// Counts where lines are seen, window by window.
class CoverageMap {
 public:
  void clear(std::uint16_t width, std::uint16_t height);
  void add(Span<const EventLine> lines);
  [[nodiscard]] const Coverage& seen() const { return seen_; }

 private:
  Coverage seen_;
  std::uint16_t width_ = 0, height_ = 0;
};

/// Hints from lines in the image alone: fills `covered_share` and `hints`.
void advise_collecting(Coverage* coverage);

/// What is known of the camera once the object was found.
struct CoverageSolution {
  Camera camera;  ///< the best there is, however rough
  Span<const ModelLine> model;
  /// Of the intrinsics, row-major, with 0 where one is held; null: what the poses can give at best is used instead.
  const double* covariance = nullptr;
  bool solved = false;  ///< the camera is good enough to be given away
  bool faint = false;   ///< most edges of the object make about one event per crossing
};

/// Hints from the poses of the windows in which the object was found: fills what stands in Coverage from
/// `matched_windows` on. Without poses nothing is changed.
/// Complexity O(poses (poses + model lines)).
void advise_found(const CoverageSolution& solution, Span<const WindowPoses> poses, Coverage* coverage);

}  // namespace lecalib
