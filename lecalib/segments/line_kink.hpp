// SPDX-License-Identifier: MIT
/// Finds where a fitted line turns off, as it does when growth leaves one edge for another that crosses it at a small
/// angle.
#pragma once

namespace lecalib {

struct KinkOptions {
  float min_angle = 0.0175F;  ///< rad: less is bend that distortion makes
  float min_share = 0.5F;     ///< of what a smooth bend leaves unexplained that the kink must explain, 0 to 1
  float min_evidence = 30;    ///< chi^2 that it explains
};

/// Collects a line's residuals in columns along it.
class KinkFinder {
 public:
  /// @param low_px, high_px  the line's extent, along it
  KinkFinder(float low_px, float high_px) noexcept;

  /// Whether the line is long enough to tell.
  [[nodiscard]] bool can_tell() const noexcept { return count_ > 0; }

  /// Adds an event, its residual from the fit in px, with its weight in the fit (0 to 1).
  void add(float along_px, float residual_px, float weight) noexcept {
    const float u = (along_px - low_px_) * columns_per_px_;
    if (u < 0 || u >= end_) return;
    const int i = static_cast<int>(u);
    weight_[i] += weight;
    mean_[i] += weight * residual_px;
  }

  /// Of all hinges h(s) = max(0, s - c), looks for the one that explains most of the residuals, what a smooth bend (to
  /// the fourth power of s, as distortion makes) explains left aside.
  /// @param variance  of the events' residuals, px^2
  /// @param[out] at_px  the c of that hinge
  /// @return whether it is a kink; *at_px unchanged if not, as for lines too short to tell. Call once.
  bool find(const KinkOptions& options, float variance, float* at_px) noexcept;

 private:
  static constexpr int kMaxColumns = 32;

  [[nodiscard]] float unit_position(int column) const noexcept;
  [[nodiscard]] float dot(const float* a, const float* b) const noexcept;
  void remove(const float* unit, float* v) const noexcept;
  bool remove_smooth_part(float (*smooth)[kMaxColumns], int terms) noexcept;

  float low_px_;
  float columns_per_px_;
  float end_;  // as count_
  int count_;  // columns; 0 when the line is too short
  float weight_[kMaxColumns] = {};
  float mean_[kMaxColumns] = {};  // first the sum of weighted residuals
};

}  // namespace lecalib
