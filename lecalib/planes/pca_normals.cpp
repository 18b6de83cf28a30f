// SPDX-License-Identifier: MIT
#include "lecalib/planes/pca_normals.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/trigonometry.hpp"
#include "lecalib/planes/plane_moments.hpp"

namespace lecalib {
namespace {

/// Rounds of the robust fit: all neighbours, then twice those within a band about the last plane.
constexpr int kPlaneRounds = 3;
/// The band in units of the last thickness, and its limits, px. The upper limits keep a parallel edge out.
constexpr float kBandThickness = 2.2F;
constexpr float kMinBandPx = 1.5F;
constexpr float kMaxBandPx[kPlaneRounds] = {0, 3.5F, 2.5F};

bool valid(const NormalOptions& o) {
  return o.neighbourhood.min_radius_px > 0 && o.neighbourhood.max_radius_px >= o.neighbourhood.min_radius_px &&
         o.neighbourhood.min_count <= kMaxNeighbours && o.min_support >= 3 && o.max_thickness_px > 0 &&
         o.max_offset_px > 0;
}

/// Distance of an event, given relative to the moments' origin, to the plane.
float distance(const PlaneFit& plane, float x, float y, float z) {
  return (x - plane.centre.x) * plane.normal.x + (y - plane.centre.y) * plane.normal.y +
         (z - plane.centre.z) * plane.normal.z;
}

/// Robust plane of the neighbours, relative to `origin`.
/// @return how many lie on it, 0 when there is none
std::size_t fit_surface(const EventCloud& cloud, const Point3& origin, Span<const std::uint32_t> neighbours,
                        std::uint32_t min_support, PlaneFit* plane) {
  PlaneMoments moments;
  for (int round = 0; round < kPlaneRounds; ++round) {
    const float band =
        round == 0 ? 0 : std::clamp(kBandThickness * std::sqrt(plane->variance[0]), kMinBandPx, kMaxBandPx[round]);
    const float last = moments.n;
    moments = {};
    for (const std::uint32_t i : neighbours) {
      const float x = static_cast<float>(cloud.x[i]) - origin.x;
      const float y = static_cast<float>(cloud.y[i]) - origin.y;
      const float z = cloud.z(i) - origin.z;
      if (round > 0 && std::fabs(distance(*plane, x, y, z)) > band) continue;
      moments.add(x, y, z);
    }
    if (round > 0 && moments.n == last) break;  // nobody left and nobody came: the plane stays
    if (moments.n < static_cast<float>(min_support) || !fit_plane(moments, plane)) return 0;
  }
  return static_cast<std::size_t>(moments.n);
}

/// Noise events expected in the slab about a surface, in a neighbourhood's ball.
float expected_noise(const EventCloud& cloud, bool on, const Neighbourhood& neighbourhood) {
  const float per_px3 = cloud.noise_floor[on ? 1 : 0] / (cloud.depth_px * static_cast<float>(neighbourhood.stride));
  return per_px3 * 2 * kMaxBandPx[kPlaneRounds - 1] * static_cast<float>(kPi) * neighbourhood.radius_px *
         neighbourhood.radius_px;
}

bool is_moving_surface(const PlaneFit& plane, std::size_t support, std::size_t neighbours, float noise,
                       const NormalOptions& o) {
  const float offset = distance(plane, 0, 0, 0);
  return static_cast<float>(support) >= o.min_support_share * static_cast<float>(neighbours) &&
         static_cast<float>(support) >= o.min_over_noise * noise &&
         plane.variance[0] <= o.max_thickness_px * o.max_thickness_px &&
         plane.variance[0] <= o.max_flatness * plane.variance[1] && std::fabs(plane.normal.z) <= o.max_normal_z &&
         std::fabs(offset) <= o.max_offset_px;
}

}  // namespace

Status estimate_normals(const EventCloud& cloud, const NormalOptions& options, Span<SurfacePoint> out,
                        std::size_t* count, NormalStats* stats) {
  NormalStats unused;
  if (stats == nullptr) stats = &unused;
  *stats = {};
  if (!valid(options)) return Status::invalid_argument;
  if (out.empty()) return Status::buffer_too_small;

  std::uint32_t neighbour_storage[kMaxNeighbours];
  Neighbour scratch[kMaxNeighbours];
  const Span<std::uint32_t> neighbours(neighbour_storage);
  const std::size_t stride = (cloud.size() + out.size() - 1) / out.size();
  std::size_t found = 0;
  std::uint32_t cell = 0;
  for (std::size_t i = 0; i < cloud.size(); i += stride) {
    while (cloud.cell_start[cell + 1] <= i) ++cell;
    ++stats->queries;
    const Point3 origin = cloud.point(i);
    const bool on = cloud.is_on(i);
    const Neighbourhood near =
        find_neighbourhood(cloud, on ? 1 : 0, origin, options.neighbourhood, Span<Neighbour>(scratch), neighbours);
    if (near.count < options.min_support) {
      ++stats->isolated;
      continue;
    }
    PlaneFit plane{};
    const std::size_t support = fit_surface(cloud, origin, neighbours.first(near.count), options.min_support, &plane);
    if (support == 0 || !is_moving_surface(plane, support, near.count, expected_noise(cloud, on, near), options)) {
      ++stats->not_flat;
      continue;
    }
    const float offset = distance(plane, 0, 0, 0);
    out[found++] = {
        {origin.x - offset * plane.normal.x, origin.y - offset * plane.normal.y, origin.z - offset * plane.normal.z},
        plane.normal,
        plane.variance[0],
        cell};
  }
  stats->skipped = static_cast<std::uint32_t>(cloud.size()) - stats->queries;
  *count = found;
  return Status::ok;
}

}  // namespace lecalib
