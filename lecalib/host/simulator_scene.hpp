// SPDX-License-Identifier: MIT
/// What the simulated camera looks at: flat faces of even brightness with flat figures painted on them.
///
/// The target is convex and stands in a convex room, so after faces that turn their back are left out, the faces of the
/// target hide the room and nothing else hides anything: the first face of the list that a ray meets is what it sees.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "lecalib/core/records.hpp"
#include "lecalib/host/error.hpp"
#include "lecalib/host/model_file.hpp"
#include "lecalib/math/eigen.hpp"

namespace lecalib::host {

/// A convex polygon in the coordinates of its face, metres, corners counter-clockwise (u right, v up).
struct Figure {
  std::vector<Vec2> corners;
  float radiance;
};

/// A rectangle in space, seen from where its normal u x v points. Later figures cover earlier ones.
struct Face {
  Vec3 origin;
  Vec3 u, v;  ///< unit, at right angles
  double width, height;
  float radiance;
  std::vector<Figure> figures;

  [[nodiscard]] Vec3 normal() const { return u.cross(v); }
  [[nodiscard]] Vec3 point(const Vec2& uv) const { return origin + uv(0) * u + uv(1) * v; }
};

/// A round bar of even brightness: an edge of a target of which only the edges are known.
struct Rod {
  Vec3 p, q;
  double radius;
  float radiance;
};

/// The scene, and how a camera is to be put before it.
struct Scene {
  std::vector<Rod> rods;    ///< hide all faces
  std::vector<Face> faces;  ///< the target's first, then the room's
  std::size_t target_faces = 0;
  Vec3 center;     ///< of the target
  Vec3 view_from;  ///< unit, from the center to the camera
  Vec3 up;         ///< unit, what the camera has above it
};

/// Brightness of what no face covers, and of pixels whose ray the lens model does not define.
inline constexpr float kVoidRadiance = 0.02F;

/// Builds the scene of a target as make_target() describes it. The object's own corners are the model's:
///   rectangle      a bright printed sheet on a dark table
///   box            a box with labels and a shadow on the floor of a room
///   checkerboard   dark squares on a bright board
///   file           lines in one plane: dark strips on a board; otherwise: dark rods before a wall. The model's lines
///                  are the centres of strips and rods, which make events at both of their flanks.
Result<Scene> make_scene(std::string_view target, const Model& model);

}  // namespace lecalib::host
