// SPDX-License-Identifier: MIT
/// The records that stages hand to each other. Plain data, no behaviour; units in the names where they are not obvious.
/// Conventions: integer pixel coordinates at pixel centres, x right, y down; camera frame x right, y down, z forward;
/// metres, radians, microseconds.
#pragma once

#include <cstddef>
#include <cstdint>

#include "lecalib/core/span.hpp"

namespace lecalib {

/// One event. 16 bytes.
struct Event {
  std::int64_t t_us;
  std::uint16_t x, y;
  std::uint8_t polarity;  ///< 1 ON (brighter), 0 OFF (darker)
};

/// What a trigger says of the signal.
enum class TriggerKind : std::uint8_t {
  falling,
  rising,
  pulse,
  other,  ///< not told, or not of an external signal: frames, exposures, generators
};

/// A signal at an input of the camera, or of its own.
struct TriggerEvent {
  std::int64_t t_us;
  std::uint8_t channel;  ///< the input; in AEDAT 4 the number of the signal's source
  TriggerKind kind;
};

/// One measurement of the camera's inertial sensor, about and along the camera's axes. NaN: not measured.
struct ImuSample {
  std::int64_t t_us;
  float gyro_rad_s[3];
  float accel_m_s2[3];  ///< the force that holds the camera: (0, -9.8, 0) for one that stands upright
  float temperature_c;
};

/// Events of [begin_us, end_us), in order of time; an event may precede begin_us by the sensor's own disorder.
struct EventWindow {
  std::int64_t begin_us = 0;
  std::int64_t end_us = 0;
  Span<const Event> events;
};

/// A straight segment in the (distorted) image, px.
struct Segment {
  float x1, y1, x2, y2;
};

/// The two times of a LineEdge, in half windows before and after the window's middle.
inline constexpr float kEdgeTime = 0.36F;

/// Where the edge of a line is, at two times of its window and three places along it: what a fit that is linear in time
/// and quadratic along the line knows, in six places whose errors are not correlated.
struct LineEdge {
  float x[2][3], y[2][3];         ///< px, distorted; [time][place], along the line in the order of its end points
  float sigma_px[3] = {};         ///< one sigma of the position at each of the places, what crossings share included
  float scatter_px = 0;           ///< robust one sigma of one crossing
  float events_per_crossing = 0;  ///< mean
  float speed_px_per_s = 0;       ///< along (-dy, dx), with (dx, dy) from place 0 to place 2
  std::uint32_t crossings = 0;    ///< 0: there is no edge
};

/// One moving line of a window, at the window's two ends. begin.(x1, y1) and end.(x1, y1) belong to the same end of the
/// line. The end points lie on the fitted curve, which stands beside the chord, along its normal (-dy, dx) / length, by
///     4 f (1 - f) (bend + g skew + g^2 peak),   f from 0 to 1 along it, g = 2 f - 1
struct EventLine {
  Segment begin;
  Segment end;
  float bend_px;         ///< at mid window: how far the curve's middle stands beside the chord's
  float sigma_begin_px;  ///< one sigma of the position across the line, at the window's begin
  float sigma_end_px;
  std::uint32_t events;      ///< events that support the line
  std::int8_t polarity;      ///< +1 ON, -1 OFF, 0 both
  float bend_change_px = 0;  ///< how much more the line bends at the window's end than at its begin
  float skew_px = 0, peak_px = 0;
  LineEdge edge = {};  ///< of the events one by one; what stands above is of all together
};

/// Stands for the events in a stretch of a line and a part of its window: their mean, for fits that want more than the
/// line's ends.
struct LineSample {
  float x, y;      ///< px, distorted
  float time;      ///< 0 at the window's begin, 1 at its end
  float sigma_px;  ///< one sigma of the position across the line, without what all events of the line have in common
};

/// The lines of one window.
struct LineWindow {
  std::int64_t begin_us = 0;
  std::int64_t end_us = 0;
  Span<const EventLine> lines;
};

/// A straight line segment of the calibration object, metres, world frame.
struct ModelLine {
  double p[3];
  double q[3];
};

/// x_cam = R x_world + t. R row-major.
struct Pose {
  double R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  double t[3] = {0, 0, 0};
};

/// Number of intrinsics, in the order fx fy cx cy k1 k2 p1 p2 k3.
inline constexpr std::size_t kNumIntrinsics = 9;

/// How a lens moves a point at the ideal radius r (normalised coordinates) to the distorted radius r_d. Barrel
/// distortion has k1 < 0 in Brown's and in the division model, k1 > 0 in the polynomial.
enum class DistortionModel : std::uint8_t {
  brown,       ///< r_d = r (1 + k1 r^2 + k2 r^4 + k3 r^6), and tangential terms p1, p2
  polynomial,  ///< r = r_d (1 + k1 r_d^2 + k2 r_d^4 + k3 r_d^6)
  division,    ///< r = r_d / (1 + k1 r_d^2), Fitzgibbon's
};
inline constexpr std::size_t kNumDistortionModels = 3;
inline constexpr const char* kDistortionModelNames[kNumDistortionModels] = {"brown", "polynomial", "division"};

/// Pinhole with distortion; Brown's is ideal to distorted, with OpenCV's names. [Liu24] eq. 8 calls (p1, p2, k3)
/// (k3, k4, k5). Coefficients that the model does not have are 0.
struct Camera {
  std::uint16_t width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  DistortionModel model = DistortionModel::brown;
};

/// Where each intrinsic stands in whatever holds one value for each.
enum IntrinsicIndex : std::uint8_t { kFx, kFy, kCx, kCy, kK1, kK2, kP1, kP2, kK3 };

/// The intrinsics by index, for loops over parameters: camera.*kIntrinsics[i].
inline constexpr double Camera::*kIntrinsics[kNumIntrinsics] = {&Camera::fx, &Camera::fy, &Camera::cx,
                                                                &Camera::cy, &Camera::k1, &Camera::k2,
                                                                &Camera::p1, &Camera::p2, &Camera::k3};
inline constexpr const char* kIntrinsicNames[kNumIntrinsics] = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};

/// Which intrinsics a camera of each model has.
inline constexpr bool kHasIntrinsic[kNumDistortionModels][kNumIntrinsics] = {
    {true, true, true, true, true, true, true, true, true},
    {true, true, true, true, true, true, false, false, true},
    {true, true, true, true, true, false, false, false, false}};

/// A measured point on the image of model line `line`; only its position across the line counts.
struct LinePoint {
  double u_px, v_px;
  double sigma_px;     ///< one sigma across the line, > 0
  std::uint16_t line;  ///< index into the model
};

/// The points of one instant, [first, first + count) of the point array; the camera has one pose.
struct View {
  std::int64_t t_us;
  std::uint32_t first;
  std::uint32_t count;
};

/// "Detected line `line` of window `window` shows model line `model_line`." flipped: its first end point is nearer to
/// q.
struct LineMatch {
  std::uint16_t window;
  std::uint16_t line;
  std::uint16_t model_line;
  bool flipped;
};

}  // namespace lecalib
