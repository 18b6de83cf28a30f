// SPDX-License-Identifier: MIT
#include "lecalib/solve/initial_guess.hpp"

#include <algorithm>
#include <cmath>

#include "lecalib/math/plane_homography.hpp"
#include "lecalib/math/so3.hpp"
#include "lecalib/math/trigonometry.hpp"
#include "lecalib/solve/visibility.hpp"

namespace lecalib {
namespace {

/// Division-model mu of the straightenings tried, 1 at the image corner; from mild to strong, barrel more often than
/// pincushion, as lenses are.
constexpr double kStraightenings[] = {0.0, 0.15, -0.15, 0.35, -0.35, 0.6};

/// Fields of view of the sweep, degrees.
constexpr double kSweepDeg[] = {20.0, 28.0, 38.0, 50.0, 62.0, 75.0, 90.0, 105.0, 120.0, 135.0};

/// Distances are capped for the choice among candidates, so that one bad line does not decide it.
constexpr double kCapPx = 100.0;

/// Ratio of focal lengths within which two starts lead to the same end.
constexpr double kSameStart = 1.25;

/// Planes within this angle count as one orientation.
constexpr double kSameOrientationCos = 0.9962;  // 5 degrees

/// The homography in units of half a diagonal about the image centre.
Mat3 centred(const Mat3& H, const Straightening& s) {
  Mat3 G = H;
  G.row(0) = (H.row(0) - s.centre_x * H.row(2)) / s.half_diagonal;
  G.row(1) = (H.row(1) - s.centre_y * H.row(2)) / s.half_diagonal;
  return G;
}

}  // namespace

void InitialGuess::init(const CalibrationData& data, const InitialGuessOptions& options,
                        const InitialGuessWorkspace& workspace) {
  LECALIB_ASSERT(workspace.views.size() == data.views.size() && workspace.linear.size() >= data.views.size());
  *this = InitialGuess();
  data_ = data;
  options_ = options;
  workspace_ = workspace;
  best_rms_px_ = kCapPx;
  for (RefineView& view : workspace_.views) view.used = false;
}

Straightening InitialGuess::straightening() const {
  const double x = centre_x(data_);
  const double y = centre_y(data_);
  return {x, y, std::sqrt(x * x + y * y), kStraightenings[straightening_]};
}

Status InitialGuess::step() {
  if (next_view_ < data_.views.size()) {
    solve_view(next_view_++);
    return Status::in_progress;
  }
  if (candidates_taken_ > 0) {
    const StartCandidate& candidate = candidates_[candidates_taken_ - 1];
    try_camera(candidate.fx, candidate.fy);
    return found_ ? Status::ok : Status::degenerate_geometry;
  }
  try_straightening();
  return next_straightening();
}

bool InitialGuess::begin_next_candidate() {
  if (candidates_taken_ == 0) {
    const auto by_rms = [](const StartCandidate& a, const StartCandidate& b) { return a.rms_px < b.rms_px; };
    std::sort(candidates_, candidates_ + num_candidates_, by_rms);
    candidates_taken_ = 1;  // the best one was the search's own answer
  }
  if (candidates_taken_ >= num_candidates_) return false;
  straightening_ = candidates_[candidates_taken_++].straightening;
  next_view_ = 0;
  found_ = false;
  return true;
}

/// Keeps one candidate per focal length, roughly, and the best of these.
void InitialGuess::keep_candidate(const StartCandidate& candidate) {
  StartCandidate* place = nullptr;
  for (std::size_t i = 0; i < num_candidates_; ++i) {
    const double ratio = candidates_[i].fx / candidate.fx;
    if (ratio < kSameStart && ratio * kSameStart > 1.0) place = &candidates_[i];
  }
  if (place == nullptr && num_candidates_ < kMaxStartCandidates) {
    candidates_[num_candidates_++] = candidate;
    return;
  }
  if (place == nullptr) {
    place = candidates_;
    for (StartCandidate& other : candidates_) {
      if (other.rms_px > place->rms_px) place = &other;
    }
  }
  if (candidate.rms_px < place->rms_px) *place = candidate;
}

Status InitialGuess::next_straightening() {
  constexpr int kCount = static_cast<int>(sizeof(kStraightenings) / sizeof(kStraightenings[0]));
  const bool good = found_ && best_rms_px_ <= options_.good_enough_px;
  if (++straightening_ < kCount && !good) {
    next_view_ = 0;
    focal_matrix_.setZero();
    focal_vector_.setZero();
    return Status::in_progress;
  }
  if (found_) return Status::ok;
  const bool enough = most_planar_lines_ >= kMinPlanarLines || most_spatial_lines_ >= kMinNonPlanarLines;
  return enough ? Status::degenerate_geometry : Status::too_few_lines;
}

/// The linear solution of a view; planar views also add their two equations for the focal lengths.
void InitialGuess::solve_view(std::size_t index) {
  LinearView& view = workspace_.linear[index];
  view = {};
  view.shape = ModelShape::collinear;
  std::size_t count = 0;
  const Straightening straight = straightening();
  fit_view_lines(data_, data_.views[index], straight, workspace_.moments, workspace_.lines, &count);
  const Span<const ViewLine> lines = Span<const ViewLine>(workspace_.lines).first(count);
  const ModelFrame frame = find_model_frame(data_.model, lines);
  Eigen::Map<Mat3>(view.axes) = frame.axes;
  Eigen::Map<Vec3>(view.origin) = frame.origin;
  if (frame.shape == ModelShape::planar) {
    most_planar_lines_ = std::max(most_planar_lines_, count);
    Mat3 H;
    if (!solve_planar_line_dlt(data_.model, lines, frame, &H)) return;
    Eigen::Map<Mat3>(view.projection) = H;
    add_focal_equations(centred(H, straight), &focal_matrix_, &focal_vector_);
  } else if (frame.shape == ModelShape::non_planar) {
    most_spatial_lines_ = std::max(most_spatial_lines_, count);
    Mat34 M;
    if (!solve_line_dlt(data_.model, lines, &M)) return;
    Eigen::Map<Mat34>(view.projection) = M;
    Decomposition parts;
    if (decompose_projection(M, straight.centre_x, straight.centre_y, &parts)) {
      view.fx = parts.fx;
      view.fy = parts.fy;
    }
  }
  view.shape = frame.shape;
}

void InitialGuess::try_straightening() {
  const bool found_before = found_;
  try_spatial_focal_lengths();
  try_planar_focal_lengths();
  if (!found_before && (!found_ || best_rms_px_ > options_.good_enough_px)) sweep_focal_lengths();
}

void InitialGuess::try_spatial_focal_lengths() {
  const auto median = [this](double LinearView::*focal) {
    std::size_t count = 0;
    for (const LinearView& view : workspace_.linear) {
      if (view.shape == ModelShape::non_planar && view.fx > 0.0) workspace_.focal_lengths[count++] = view.*focal;
    }
    if (count == 0) return 0.0;
    double* const first = workspace_.focal_lengths.data();
    std::nth_element(first, first + count / 2, first + count);
    return first[count / 2];
  };
  const double fx = median(&LinearView::fx);
  const double fy = median(&LinearView::fy);
  if (fx > 0.0 && fy > 0.0) try_camera(fx, fy);
}

void InitialGuess::try_planar_focal_lengths() {
  const double scale = straightening().half_diagonal;
  double fx = 0.0;
  double fy = 0.0;
  if (solve_focal_lengths(focal_matrix_, focal_vector_, &fx, &fy)) try_camera(scale * fx, scale * fy);
  if (solve_focal_length(focal_matrix_, focal_vector_, &fx)) try_camera(scale * fx, scale * fx);
}

void InitialGuess::sweep_focal_lengths() {
  for (const double degrees : kSweepDeg) {
    const double f = 0.5 * data_.width / tangent(deg_to_rad(0.5 * degrees));
    try_camera(f, f);
  }
}

/// Gives every view with a linear solution its pose for this camera, and keeps camera and poses when they are the best.
void InitialGuess::try_camera(double fx, double fy) {
  const double widest = 0.5 * data_.width / tangent(deg_to_rad(0.5 * options_.max_view_deg));
  const double narrowest = 0.5 * data_.width / tangent(deg_to_rad(0.5 * options_.min_view_deg));
  if (!(fx >= widest && fx <= narrowest && fy >= widest && fy <= narrowest)) return;
  const Straightening straight = straightening();
  Camera camera;
  camera.width = data_.width;
  camera.height = data_.height;
  camera.fx = fx;
  camera.fy = fy;
  camera.cx = straight.centre_x;
  camera.cy = straight.centre_y;
  // r_straight = r / (1 - m r^2) in normalised coordinates, inverted to two terms; this polynomial never folds.
  const double m = straight.mu * fx * fy / (straight.half_diagonal * straight.half_diagonal);
  camera.k1 = -m;
  camera.k2 = 2.0 * m * m;
  Visibility sum;
  sum.cap_px = kCapPx;
  for (std::size_t v = 0; v < data_.views.size(); ++v) {
    LinearView& linear = workspace_.linear[v];
    if (linear.shape == ModelShape::collinear) continue;
    if (!pose_view(v, camera, &workspace_.views[v].previous)) {
      linear.shape = ModelShape::collinear;  // a singular solution is none
      continue;
    }
    add_visibility(data_, data_.views[v], camera, workspace_.views[v].previous, &sum);
  }
  const double rms_px = std::sqrt(sum.cost / static_cast<double>(std::max<std::size_t>(sum.points, 1)));
  if (sum.points == 0) return;
  if (candidates_taken_ == 0) keep_candidate({fx, fy, rms_px, straightening_});
  if (found_ && !(rms_px < best_rms_px_)) return;
  found_ = true;
  best_rms_px_ = rms_px;
  best_camera_ = camera;
  for (std::size_t v = 0; v < data_.views.size(); ++v) {
    RefineView& view = workspace_.views[v];
    view.used = workspace_.linear[v].shape != ModelShape::collinear;
    view.pose = view.previous;
  }
}

bool InitialGuess::pose_view(std::size_t index, const Camera& camera, Pose* pose) const {
  const LinearView& linear = workspace_.linear[index];
  if (linear.shape == ModelShape::non_planar) {
    return pose_from_projection(Eigen::Map<const Mat34>(linear.projection), camera, pose);
  }
  const Pose plane = pose_from_homography(Eigen::Map<const Mat3>(linear.projection), camera, Vec2::Zero());
  const Mat3 axes = Eigen::Map<const Mat3>(linear.axes);
  const Vec3 origin = Eigen::Map<const Vec3>(linear.origin);
  Mat3 R = rotation_of(plane);
  Vec3 t = translation_of(plane);
  *pose = make_pose(R * axes, t - R * axes * origin);
  // The homography fits the plane before and behind the camera alike: the side where most of the points are is taken.
  Visibility sides;
  add_visibility(data_, data_.views[index], camera, *pose, &sides);
  if (2 * sides.in_front >= sides.points) return true;
  R.leftCols<2>() *= -1.0;
  t = -t;
  *pose = make_pose(R * axes, t - R * axes * origin);
  return true;
}

ViewGeometry classify_views(const CalibrationData& data, Span<const RefineView> views, Span<LineMoments> moments,
                            Span<ViewLine> lines) {
  const Straightening none{centre_x(data), centre_y(data), 1.0, 0.0};
  bool has_first = false;
  bool turned = false;
  Vec3 first = Vec3::Zero();
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!views[v].used) continue;
    std::size_t count = 0;
    fit_view_lines(data, data.views[v], none, moments, lines, &count);
    const ModelFrame frame = find_model_frame(data.model, Span<const ViewLine>(lines).first(count));
    if (frame.shape == ModelShape::non_planar) return ViewGeometry::spatial;
    const Vec3 normal = rotation_of(views[v].pose) * frame.axes.row(2).transpose();
    if (!has_first) first = normal;
    has_first = true;
    if (std::abs(normal.dot(first)) < kSameOrientationCos) turned = true;
  }
  return turned ? ViewGeometry::planes : ViewGeometry::one_plane_pose;
}

}  // namespace lecalib
