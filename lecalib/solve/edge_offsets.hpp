// SPDX-License-Identifier: MIT
/// What displaces the points of moving edges from the model's lines, in all views alike: estimated with the camera.
///
///     displacement along a point's normal
///       = D (d0 + w + u + f g + (6 f^2 - 1/2) (b0 + b) - ln(|v| / v0) c0) - sign(v) a0 - v tau
///
/// with D the side on which the edge is dark, v the point's speed and f its place along the line from -1/2 to 1/2; d0,
/// b0, a0 and tau are shared by all lines, c0 by all of one polarity, u, g and b belong to a model line's edges of one
/// polarity, w to a drawn line: one that is dark between two flanks, whose middle is the model's.
///
/// Residuals are linear in the offsets. With camera and poses eliminated, one linear solution beside a converged
/// refinement gives the offsets; the points move by it and the refinement goes on. Together they find the minimum over
/// all, and what the offsets leave uncertain goes into the camera's covariance.
///
/// A pose of its own in each view takes up a shift along the motion: tau and a0 are then no better known than
/// beforehand, and do no harm. An equal u all around a flat outline is its size, hence its distance.
#pragma once

#include <cstdint>

#include "lecalib/core/arena.hpp"
#include "lecalib/core/records.hpp"
#include "lecalib/math/eigen.hpp"
#include "lecalib/solve/calibration_data.hpp"
#include "lecalib/solve/drawn_lines.hpp"
#include "lecalib/solve/refine.hpp"

namespace lecalib {

/// One sigma of each offset beforehand. All > 0.
struct EdgeOffsetOptions {
  double dark_px = 0.10;          ///< d0
  double trailing_px = 0.05;      ///< a0
  double bend_px = 0.05;          ///< b0: what fires near a line's ends lies further towards the dark, or less far
  double latency_ms = 0.15;       ///< tau, about ...
  double mean_latency_ms = 0.05;  ///< ... this
  /// c0 of OFF edges and of ON edges, one sigma and mean. Pixels are slow in the dark, where ON edges begin: in two
  /// simulators ON edges lie 0.06 to 0.1 px less far towards the dark where they are e times as fast, OFF edges -0.03
  /// to 0.03, over speeds from 20 to 800 px/s.
  double off_by_speed_px = 0.04, mean_off_by_speed_px = 0;
  double on_by_speed_px = 0.04, mean_on_by_speed_px = 0.07;
  double line_px = 0.07;        ///< u, for two and a half events per crossing and more ...
  double faint_line_px = 0.15;  ///< ... and for one and a half or less
  /// g, from end to end, and b of OFF edges and of ON edges; how large they are in a recording is estimated. What lies
  /// behind an object is darker at one end than at the other, and OFF edges end there, where pixels are slow.
  double off_tilt_px = 0.2, off_bend_px = 0.05;
  double on_tilt_px = 0.09, on_bend_px = 0.04;
  double half_width_px = 2;  ///< w
  DrawnLineOptions drawn;
  /// A line whose u lies further out, in sigmas beforehand, is not the edge that fires: a rim in relief, a shadow. > 0
  double max_sigmas = 3.5;
};

inline constexpr std::size_t kSharedOffsets = 6;   ///< d0, a0, b0, c0 of OFF and of ON, tau
inline constexpr std::size_t kOffsetsPerLine = 7;  ///< w, and u, g and b of either polarity
inline constexpr std::size_t kMaxOffsetTerms = 9;  ///< of one point

struct EdgeOffsetCapacities {
  std::size_t model_lines = 64;
};

/// n = kSharedOffsets + kOffsetsPerLine x model lines.
struct EdgeOffsetWorkspace {
  Span<double> value, sigma;   ///< [n] sigma: beforehand, of tilts and bends as estimated
  Span<std::uint16_t> slot;    ///< [kOffsetsPerLine x model lines] place among the offsets in use
  Span<std::uint16_t> active;  ///< [n] scratch: the offsets of one view
  Span<double> matrix;         ///< [n (n + 1) / 2] normal equations, lower triangle by rows
  Span<double> gradient;       ///< [n]
  Span<double> by_camera;      ///< [n x 9]
  Span<double> by_pose;        ///< [n x 6] scratch: of one view
};

template <class Carver>
constexpr bool carve(Carver& carver, const EdgeOffsetCapacities& c, EdgeOffsetWorkspace* out) {
  const std::size_t slots = kOffsetsPerLine * c.model_lines;
  const std::size_t n = kSharedOffsets + slots;
  return carver.carve(n, &out->value) && carver.carve(n, &out->sigma) && carver.carve(slots, &out->slot) &&
         carver.carve(n, &out->active) && carver.carve(n * (n + 1) / 2, &out->matrix) &&
         carver.carve(n, &out->gradient) && carver.carve(kNumIntrinsics * n, &out->by_camera) &&
         carver.carve(6 * n, &out->by_pose);
}

/// Whether the workspace has room for the offsets of so many model lines.
constexpr bool has_room(const EdgeOffsetWorkspace& ws, std::size_t model_lines) {
  const std::size_t slots = kOffsetsPerLine * model_lines;
  const std::size_t n = kSharedOffsets + slots;
  return ws.value.size() >= n && ws.sigma.size() >= n && ws.slot.size() >= slots && ws.active.size() >= n &&
         ws.matrix.size() >= n * (n + 1) / 2 && ws.gradient.size() >= n && ws.by_camera.size() >= kNumIntrinsics * n &&
         ws.by_pose.size() >= 6 * n;
}

/// The offsets that displace one point, with their factors.
struct OffsetTerms {
  std::uint16_t index[kMaxOffsetTerms];
  double factor[kMaxOffsetTerms];
  std::size_t count = 0;
};

class EdgeOffsets {
 public:
  /// Finds which offsets there are; all begin at what is known beforehand.
  /// @param data with an EdgePoint for each point; outlives the offsets
  /// @param workspace for as many model lines, at least
  void init(const CalibrationData& data, const EdgeOffsetOptions& options, const EdgeOffsetWorkspace& workspace);

  [[nodiscard]] std::size_t size() const { return size_; }
  /// Values, sigmas and scratch, for who moves the offsets together with more than one camera.
  [[nodiscard]] const EdgeOffsetWorkspace& workspace() const { return workspace_; }
  /// What an offset is expected to be beforehand.
  [[nodiscard]] double mean(std::size_t offset) const;
  [[nodiscard]] OffsetTerms terms(std::size_t point) const;
  /// Of a point, along its normal, px.
  [[nodiscard]] double displacement(std::size_t point) const;
  /// The points where they are without the offsets. @param out [data.points]
  void correct(Span<LinePoint> out) const;

  /// Moves the offsets to the minimum of the refinement's quadratic model, in which camera and poses follow them.
  /// @param refiner    at the points as correct() gave them last
  /// @param largest_px the largest change of an offset
  /// @return false, nothing changed, where the equations are singular
  bool solve(const Refiner& refiner, double* largest_px);

  /// Adds to the camera's covariance what the offsets leave uncertain: A cov(offsets) A', with A the camera's answer to
  /// them. By a pointer that init() sets, so that a program which never has offsets does not hold the code.
  /// @param scale of cov(offsets)
  /// @return false, *sum unchanged, where the equations are singular
  bool add_covariance(const Refiner& refiner, double scale, Mat9* sum) {
    return (this->*add_covariance_)(refiner, scale, sum);
  }

  /// Marks the strays of lines that are not drawn ones.
  void mark_strays(Span<std::uint8_t> marks) const;

  /// Marks the points of lines that are not the edge that fires, see max_sigmas: the worst, and those more than half as
  /// far out; the rest is to be judged anew without them, from the beginning: the offsets' values are as after init()
  /// then.
  /// @return whether there are any
  bool mark_wrong_lines(Span<std::uint8_t> marks);

 private:
  bool do_add_covariance(const Refiner& refiner, double scale, Mat9* sum);
  void restart();
  void add_line(std::size_t line);
  void add(std::size_t slot, double sigma);
  [[nodiscard]] double sigmas_off(std::size_t line, bool on) const;
  bool reduce(const Refiner& refiner);
  [[nodiscard]] double tilt_px(bool on) const { return on ? options_.on_tilt_px : options_.off_tilt_px; }
  [[nodiscard]] double line_bend_px(bool on) const { return on ? options_.on_bend_px : options_.off_bend_px; }
  void estimate_size(std::size_t which, bool on, double beforehand_px, double prior_weight);
  [[nodiscard]] double inverse_entry(std::size_t i);

  CalibrationData data_;
  EdgeOffsetOptions options_;
  EdgeOffsetWorkspace workspace_;
  std::size_t size_ = 0;
  bool (EdgeOffsets::*add_covariance_)(const Refiner& refiner, double scale, Mat9* sum) = nullptr;
};

}  // namespace lecalib
