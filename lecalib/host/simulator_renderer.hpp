// SPDX-License-Identifier: MIT
/// The brightness that each pixel sees, by casting rays through the true lens.
#pragma once

#include <cstdint>
#include <vector>

#include "lecalib/core/records.hpp"
#include "lecalib/host/simulator_scene.hpp"

namespace lecalib::host {

/// Renders one scene from pose after pose. A pixel's brightness is the mean of 34 rays spread like the cubic B-spline,
/// which is a square pixel blurred by optics of 0.5 px (one sigma). Faces and figures have even brightness, so only
/// pixels near their outlines, now or at the pose before, can have changed: only those are rendered again.
class Renderer {
 public:
  /// @param scene must outlive the renderer
  Renderer(const Scene& scene, const Camera& camera);

  /// Moves the camera. @return the pixels (y * width + x) that were rendered again, valid until the next call.
  Span<const std::uint32_t> render(const Pose& pose);

  /// Row-major, > 0, in the units of the scene's radiance.
  [[nodiscard]] Span<const float> radiance() const { return radiance_; }

 private:
  /// Where rays of a pixel go: ideal coordinates at its centre, and their change per px.
  struct PixelRay {
    float x, y, dx_du, dx_dv, dy_du, dy_dv;
    bool defined;
  };
  /// a u + b v + c >= 0 inside.
  struct HalfPlane {
    double a, b, c;
  };
  struct FigureView {
    double u_min, u_max, v_min, v_max;
    std::size_t first_side, sides;  ///< of half_planes_
    float radiance;
  };
  /// A face before the camera of this pose: for the ray (x, y, 1) with depth . ray < 0 it is met at
  /// (u . ray, v . ray) / (depth . ray).
  struct FaceView {
    const Face* face;
    Vec3 u, v, depth;
    std::size_t first_figure;  ///< of figures_
  };
  struct RodView {
    Vec3 p, along, moment;  ///< in the camera's frame; moment = p x along
    double radius;
    float radiance;
  };

  void prepare_rays();
  void prepare_figures();
  void place(const Pose& pose);
  void mark_outlines(const Pose& pose);
  void mark_edge(const Vec3& p_cam, const Vec3& q_cam, double half_width);
  void mark_around(const Vec2& pixel, double reach);
  void mark(std::uint32_t pixel);
  [[nodiscard]] float pixel_radiance(const PixelRay& ray) const;
  [[nodiscard]] float ray_radiance(double x, double y) const;
  static bool meets(const RodView& rod, const Vec3& ray);
  [[nodiscard]] float figure_radiance(const FaceView& view, double u, double v) const;

  const Scene& scene_;
  Camera camera_;
  std::vector<Vec2> offsets_;  ///< of the rays in a pixel, px
  double reach_ = 0;           ///< an outline farther from a pixel's centre than this leaves it alone, px
  std::vector<PixelRay> rays_;
  Vec2 ideal_min_, ideal_max_;  ///< of all pixels' rays
  std::vector<HalfPlane> half_planes_;
  std::vector<FigureView> figures_;
  std::vector<std::size_t> first_figure_;  ///< of each face; one more entry than faces
  std::vector<FaceView> views_;
  std::vector<RodView> rods_;
  std::vector<float> radiance_;
  std::vector<std::uint32_t> marked_, marked_before_, changed_;
  std::vector<std::uint32_t> stamp_;  ///< the pose at which a pixel was marked last
  std::uint32_t pose_ = 0;
};

}  // namespace lecalib::host
