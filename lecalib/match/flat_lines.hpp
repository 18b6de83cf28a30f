// SPDX-License-Identifier: MIT
/// Detected lines without their distortion. A flat point is what an ideal pinhole of focal length f would see, in px
/// from the principal point: a model line then lies on n . (x, y, f) = 0 with n the normal of its plane through the
/// camera.
///
/// While the camera is unknown, the lens is a division model (Fitzgibbon 2001) in pixels:
///     flat = d / (1 + lambda |d|^2),   d = pixel - centre
/// It needs no focal length, so one value of lambda serves every hypothesis about f.
#pragma once

#include "lecalib/core/records.hpp"
#include "lecalib/core/span.hpp"
#include "lecalib/math/eigen.hpp"

namespace lecalib {

/// The unknown camera of the search: square pixels, one coefficient of distortion.
struct Lens {
  double f_px = 0;
  double cx = 0, cy = 0;
  double lambda = 0;  ///< 1 / px^2; negative for barrel distortion
};

/// Number of parameters of a Lens, in the order f, lambda, cx, cy.
inline constexpr int kNumLens = 4;

/// The instants of a window at which its lines are looked at.
enum class Instant : std::uint8_t { begin = 0, middle = 1, end = 2 };
inline constexpr std::size_t kNumInstants = 3;

/// Points of a line at one instant: first end, middle of the bent line, second end.
inline constexpr std::size_t kLinePoints = 3;

/// One detected line: flat points, px.
struct FlatLine {
  double x[kNumInstants][kLinePoints];
  double y[kNumInstants][kLinePoints];
  double length_px;  ///< of the chord, at the window's middle
  double sigma_px;   ///< the larger one of the two ends
  bool usable;       ///< false where a point lies outside of the lens's domain, or the line has no length
};

/// Where the image's border lies in flat coordinates: the box through the middles of its four sides.
struct FlatFrame {
  double x0, y0, x1, y1;
};

/// The points of a line at one instant, distorted pixels. At the middle both ends are averaged.
void line_points(const EventLine& line, Instant instant, Vec2 points[kLinePoints]);

/// @param[out] d_lens flat's derivative by (lambda, cx, cy), 2 x 3, may be null
/// @return false, outputs unchanged, beyond the model's domain (1 + lambda |d|^2 < 0.1)
bool flatten(const Lens& lens, const Vec2& pixel, Vec2* flat, Eigen::Matrix<double, 2, 3>* d_lens = nullptr);

/// The pixel that flatten() maps to `flat`.
Vec2 unflatten(const Lens& lens, const Vec2& flat);

/// @param[out] out at least lines.size()
void flatten_lines(const Lens& lens, Span<const EventLine> lines, Span<FlatLine> out);
/// The same through a known camera; flat points then are its ideal coordinates times fx.
void flatten_lines(const Camera& camera, Span<const EventLine> lines, Span<FlatLine> out);

FlatFrame flat_frame(const Lens& lens, std::uint16_t width, std::uint16_t height);
FlatFrame flat_frame(const Camera& camera);

/// Brown's k1 and k2 that agree best with the lens over the distorted radii [0, radius_px].
Camera brown_camera(const Lens& lens, std::uint16_t width, std::uint16_t height, double radius_px);

/// The lens whose flat points agree best with a Brown camera's over the distorted radii [0, radius_px].
Lens division_lens(const Camera& camera, double radius_px);

}  // namespace lecalib
