// SPDX-License-Identifier: MIT
#include "lecalib/math/distortion_fit.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/cholesky.hpp"
#include "lecalib/math/radial_curve.hpp"

namespace lecalib {
namespace {

/// Radii at which two curves are compared: the curves are smooth, so that more would tell nothing else.
constexpr int kRadii = 64;

constexpr int kMaxTerms = 3;

/// A point of a radial curve. `slope` is d(distorted)/d(ideal).
struct CurvePoint {
  double ideal, distorted, slope;
};

/// The i-th of kRadii points out to the distorted radius `radius`. False from where the curve has ended.
bool curve_point(const Camera& camera, double limit, double radius, int i, CurvePoint* out) {
  const double distorted = radius * (i + 0.5) / kRadii;
  const double ideal = undistort_radius(camera, distorted, limit);
  if (!(ideal < limit)) return false;
  const RadialFactor factor = radial_at(camera, ideal * ideal);
  *out = {ideal, distorted, factor.value + 2.0 * ideal * ideal * factor.by_q};
  return true;
}

/// Each model is linear in its coefficients: left = sum over j of k_j basis(j), both in units of the distorted radius.
struct LinearRow {
  double left;
  Vec3 basis;
};

LinearRow row_of(DistortionModel model, const CurvePoint& p) {
  const double r = model == DistortionModel::brown ? p.ideal : p.distorted;
  const double q = r * r;
  switch (model) {
    case DistortionModel::brown: return {p.distorted - r, r * q * Vec3(1.0, q, q * q)};
    case DistortionModel::polynomial: return {p.slope * (p.ideal - r), p.slope * r * q * Vec3(1.0, q, q * q)};
    case DistortionModel::division: break;
  }
  const double gain = p.slope * p.ideal / r;  // of d(r) = -r^2 / r_d d(r_d / r)
  return {gain * (r - p.ideal), gain * p.ideal * q * Vec3(1.0, 0.0, 0.0)};
}

}  // namespace

double image_radius(const Camera& c) {
  const double x = std::max(std::abs(c.cx), std::abs(c.width - 1 - c.cx)) / c.fx;
  const double y = std::max(std::abs(c.cy), std::abs(c.height - 1 - c.cy)) / c.fy;
  return std::sqrt(x * x + y * y);
}

Camera in_model(const Camera& camera, DistortionModel model, double radius, int terms) {
  if (camera.model == model) return camera;
  Camera out = camera;
  out.model = model;
  for (std::size_t i = 4; i < kNumIntrinsics; ++i) out.*kIntrinsics[i] = 0.0;
  const int used = model == DistortionModel::division ? 1 : std::clamp(terms, 1, kMaxTerms);
  Mat3 normal = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  const double limit = valid_radius(camera);
  for (int i = 0; i < kRadii; ++i) {
    CurvePoint point;
    if (!curve_point(camera, limit, radius, i, &point)) break;
    const LinearRow row = row_of(model, point);
    normal += point.distorted * row.basis * row.basis.transpose();  // as many pixels as the ring is long
    right += point.distorted * row.left * row.basis;
  }
  for (int j = used; j < kMaxTerms; ++j) {
    normal.row(j).setZero();
    normal.col(j).setZero();
    normal(j, j) = 1.0;
    right(j) = 0.0;
  }
  Cholesky<3> factor;
  if (!factor.factor(normal)) return out;
  const Vec3 k = factor.solve(right);
  out.k1 = k(0);
  out.k2 = k(1);
  out.k3 = k(2);
  return out;
}

double largest_difference_px(const Camera& camera, const Camera& other, double radius) {
  double largest = 0.0;
  const double limit = valid_radius(camera);
  for (int i = 0; i < kRadii; ++i) {
    CurvePoint point;
    if (!curve_point(camera, limit, radius, i, &point)) break;
    const double distorted = point.ideal * radial_at(other, point.ideal * point.ideal).value;
    largest = std::max(largest, std::abs(distorted - point.distorted));
  }
  return largest * std::max(camera.fx, camera.fy);
}

}  // namespace lecalib
