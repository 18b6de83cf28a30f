// SPDX-License-Identifier: MIT
/// The residual of the whole calibration: how far a measured pixel lies from the distorted image of a model line.
/// Everything is computed forward, from the ideal to the distorted image: no noisy point is ever un-distorted, so the
/// residual is in the pixels that were measured and stays defined up to the fold of the distortion.
#pragma once

#include "lecalib/core/records.hpp"
#include "lecalib/math/camera_model.hpp"
#include "lecalib/math/eigen.hpp"

namespace lecalib {

using Row6 = Eigen::Matrix<double, 1, 6>;
using Row9 = Eigen::Matrix<double, 1, 9>;

/// A 3D line in the camera frame in Pluecker's coordinates. Its ideal image is { m : moment . (m, 1) = 0 }.
struct CameraLine {
  Vec3 moment = Vec3::Zero();     ///< X_p x X_q
  Vec3 direction = Vec3::Zero();  ///< X_q - X_p
};

inline Vec3 start_of(const ModelLine& line) { return Eigen::Map<const Vec3>(line.p); }
inline Vec3 end_of(const ModelLine& line) { return Eigen::Map<const Vec3>(line.q); }

/// The model line seen from a camera with x_cam = R x_world + t.
CameraLine line_in_camera(const Mat3& R, const Vec3& t, const ModelLine& line);

/// The part of a line's ideal image inside the valid radius: origin + s direction, |s| <= half_length. Worth holding
/// where many points lie on one line.
struct IdealLine {
  Vec2 normal;
  Vec2 direction;
  Vec2 origin;  ///< the line's point nearest to the principal point
  double offset;
  double scale;  ///< moment = scale (normal, offset)
  double half_length;
  double knee = kUnboundedRadius;  ///< see straightened_line()
};

/// @param radius_limit at most valid_radius() of the camera
/// @return false, *out unchanged, where no part of the line lies inside
bool ideal_line(const CameraLine& line, double radius_limit, IdealLine* out);

/// Slope of the radial curve at its knee: what is mapped to less than a tenth of its size is no good image.
inline constexpr double kKneeSlope = 0.1;

/// As ideal_line(), on a radial curve that goes on straight from `knee` = radius_of_slope(camera, kKneeSlope) on. The
/// refinement moves through cameras whose fold lies inside of lines that are seen; with the fold, such lines have no
/// image or one that ends, and the cost jumps.
/// @return false, *out unchanged, where the line lies further out than half as far again as the knee
bool straightened_line(const CameraLine& line, double knee, IdealLine* out);

/// The point of a line's distorted image nearest to a measured pixel.
struct LineFoot {
  Vec2 ideal;   ///< normalised coordinates, on the ideal line, inside the valid radius
  Vec2 pixel;   ///< its distorted image
  Vec2 normal;  ///< unit normal of the distorted line there, px
};

/// Finds the foot of `pixel` on the image of `line`: from the point of the ideal line that faces the roughly
/// un-distorted pixel, by Gauss-Newton steps along the line.
/// @param radius_limit at most valid_radius(camera)
/// @return false, *foot unchanged, where no part of the ideal line lies inside radius_limit
bool find_foot(const Camera& camera, double radius_limit, const CameraLine& line, const Vec2& pixel, LineFoot* foot);

/// As above, with the ideal line at hand, and to 0.1 px along the line: for those who only look at distances.
/// @return false, *foot unchanged, where the line's image has no tangent
bool find_foot(const Camera& camera, const IdealLine& ideal, const Vec2& pixel, LineFoot* foot);

/// Residual and derivatives of one measured pixel, as a row of a least-squares problem.
struct LineResidual {
  static constexpr int kPose = 1;        ///< first column of the derivatives by the pose
  static constexpr int kIntrinsics = 7;  ///< and by the intrinsics
  double row[16];

  /// normal . (pixel - foot)
  [[nodiscard]] double value_px() const { return row[0]; }
  /// By (w, v) of the update x_cam' = exp(w) x_cam + v.
  [[nodiscard]] Eigen::Map<const Row6> d_pose() const { return Eigen::Map<const Row6>(row + kPose); }
  /// In the order of kIntrinsics.
  [[nodiscard]] Eigen::Map<const Row9> d_intrinsics() const { return Eigen::Map<const Row9>(row + kIntrinsics); }
};

/// As find_foot, with the residual's derivatives. The foot minimises the distance, so its motion along the line drops
/// out (envelope theorem) and the derivatives are those at a fixed foot: with m~ = (foot.ideal, 1) and the line's
/// moment N and direction D, the line moves at the foot by d(N . m~) = w . (N x m~) + v . (D x m~).
/// @return false, *out unchanged, where no part of the ideal line lies inside radius_limit
bool line_residual(const Camera& camera, double radius_limit, const CameraLine& line, const Vec2& pixel,
                   LineResidual* out);

/// What a search remembers of a point before its first one.
inline constexpr float kNoFoot = 3e38F;

/// As above, with the ideal line at hand, and begun where the last search for this point ended: while a refinement
/// settles, feet hardly move, so that 0.1 px along the line is near enough for each of its steps.
/// @param[in,out] foot kNoFoot at first; null: there is no other step, and the foot is found at once
/// @return false, *out unchanged, where the line's image has no tangent
bool line_residual(const Camera& camera, const CameraLine& line, const IdealLine& ideal, const Vec2& pixel, float* foot,
                   LineResidual* out);

}  // namespace lecalib
