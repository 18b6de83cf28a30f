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

/// Views that the search looks at, at most: they agree on the focal length, and a start need not be exact.
constexpr std::size_t kMaxSearchViews = 12;

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

/// Whether two focal lengths lead to the same end.
bool is_near(double a, double b) { return a < kSameStart * b && b < kSameStart * a; }

bool is_same_camera(const StartCandidate& a, const StartCandidate& b) {
  return a.fx == b.fx && a.fy == b.fy && a.straightening == b.straightening;
}

/// Whether planes are seen under several orientations, from their normals in the camera frame.
class Orientations {
 public:
  void add(const Vec3& normal) {
    if (!has_first_) first_ = normal;
    has_first_ = true;
    if (std::abs(normal.dot(first_)) < kSameOrientationCos) several_ = true;
  }
  [[nodiscard]] ViewGeometry geometry() const { return several_ ? ViewGeometry::planes : ViewGeometry::one_plane_pose; }

 private:
  Vec3 first_ = Vec3::Zero();
  bool has_first_ = false;
  bool several_ = false;
};

/// The pose of a view for a known camera from its linear solution; adds its points to *sum, which may be null.
bool pose_view(const CalibrationData& data, const View& view, const LinearView& linear, const Camera& camera,
               Pose* pose, Visibility* sum) {
  if (linear.shape == ModelShape::collinear) return false;
  if (linear.shape == ModelShape::non_planar) {
    if (!pose_from_projection(Eigen::Map<const Mat34>(linear.projection), camera, pose)) return false;
    if (sum != nullptr) add_visibility(data, view, camera, *pose, kCapPx, sum);
    return true;
  }
  const Pose plane = pose_from_homography(Eigen::Map<const Mat3>(linear.projection), camera, Vec2::Zero());
  const Mat3 axes = Eigen::Map<const Mat3>(linear.axes);
  const Vec3 origin = Eigen::Map<const Vec3>(linear.origin);
  Mat3 R = rotation_of(plane);
  Vec3 t = translation_of(plane);
  *pose = make_pose(R * axes, t - R * axes * origin);
  Visibility seen;
  add_visibility(data, view, camera, *pose, kCapPx, &seen);
  // The homography fits the plane before and behind the camera alike: the side where most of the points are is taken.
  const bool behind = 2 * seen.in_front < seen.points;
  if (behind) seen.in_front = seen.points - seen.in_front;
  if (sum != nullptr) {
    sum->points += seen.points;
    sum->in_front += seen.in_front;
    sum->cost += seen.cost;
  }
  if (!behind) return true;
  R.leftCols<2>() *= -1.0;
  t = -t;
  *pose = make_pose(R * axes, t - R * axes * origin);
  return true;
}

}  // namespace

void InitialGuess::init(const CalibrationData& data, const InitialGuessOptions& options,
                        const InitialGuessWorkspace& workspace) {
  LECALIB_ASSERT(workspace.views.size() == data.views.size() && workspace.linear.size() == data.views.size());
  *this = InitialGuess();
  data_ = data;
  options_ = options;
  workspace_ = workspace;
  stride_ = (data.views.size() + kMaxSearchViews - 1) / kMaxSearchViews;
}

Straightening InitialGuess::straightening() const {
  const double x = centre_x(data_);
  const double y = centre_y(data_);
  return {x, y, std::sqrt(x * x + y * y), kStraightenings[straightening_]};
}

Status InitialGuess::step() {
  const bool searching = candidates_taken_ == 0;
  if (next_view_ < data_.views.size()) {
    solve_view(next_view_);
    next_view_ += searching ? stride_ : 1;
    return Status::in_progress;
  }
  if (!searching || stride_ == 1) solved_ = straightening_;
  if (!searching) return settle();
  try_straightening();
  return next_straightening();
}

Status InitialGuess::next_straightening() {
  constexpr int kCount = static_cast<int>(sizeof(kStraightenings) / sizeof(kStraightenings[0]));
  const auto by_rms = [](const StartCandidate& a, const StartCandidate& b) { return a.rms_px < b.rms_px; };
  std::make_heap(candidates_, candidates_ + num_candidates_, by_rms);  // std::sort recurses
  std::sort_heap(candidates_, candidates_ + num_candidates_, by_rms);
  const double ends_px = exhaustive_ ? options_.good_enough_px : promising_px();
  const bool good = num_candidates_ > 0 && candidates_[0].rms_px <= ends_px;
  if (!exhaustive_ && !good) {
    exhaustive_ = true;
    sweep_focal_lengths();
  }
  if (straightening_ + 1 < kCount && !good) {
    begin_straightening(straightening_ + 1);
    return Status::in_progress;
  }
  if (begin_next_candidate()) return Status::in_progress;
  if (stride_ > 1) {  // the choice of views was unlucky: once more with all of them
    stride_ = 1;
    begin_straightening(0);
    return Status::in_progress;
  }
  const bool enough = most_planar_lines_ >= kMinPlanarLines || most_spatial_lines_ >= kMinNonPlanarLines;
  return enough ? Status::degenerate_geometry : Status::too_few_lines;
}

void InitialGuess::begin_straightening(int index) {
  straightening_ = index;
  solved_ = kNone;
  next_view_ = 0;
  focal_matrix_.setZero();
  focal_vector_.setZero();
}

double InitialGuess::promising_px() const {
  return std::max(options_.good_enough_px, options_.promising_share * data_.width);
}

bool InitialGuess::begin_next_candidate() {
  if (!exhaustive_ && candidates_taken_ > 0) {
    tried_ = candidates_[0];
    exhaustive_ = true;
    num_candidates_ = candidates_taken_ = 0;
    begin_straightening(0);
    return true;
  }
  if (candidates_taken_ >= num_candidates_) return false;
  straightening_ = candidates_[candidates_taken_++].straightening;
  next_view_ = solved_ == straightening_ ? data_.views.size() : 0;
  if (solved_ != straightening_) solved_ = kNone;
  return true;
}

/// Gives every view with a linear solution its pose for the candidate's camera.
Status InitialGuess::settle() {
  const StartCandidate& candidate = candidates_[candidates_taken_ - 1];
  camera_ = camera_for(candidate.fx, candidate.fy);
  rms_px_ = candidate.rms_px;
  const bool posed = is_same_camera(candidate, posed_);
  posed_ = candidate;
  bool any = false;
  for (std::size_t v = 0; v < data_.views.size(); ++v) {
    RefineView& view = workspace_.views[v];
    if (!posed) view.used = pose_view(data_, data_.views[v], workspace_.linear[v], camera_, &view.pose, nullptr);
    any = any || view.used;
  }
  return any ? Status::ok : Status::degenerate_geometry;
}

/// Keeps one candidate per focal length, roughly, and the best of these.
void InitialGuess::keep_candidate(const StartCandidate& candidate) {
  if (is_same_camera(candidate, tried_)) return;
  StartCandidate* place = nullptr;
  for (std::size_t i = 0; i < num_candidates_; ++i) {
    if (is_near(candidates_[i].fx, candidate.fx)) place = &candidates_[i];
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

/// The linear solution of a view; planar views also add their two equations for the focal lengths.
void InitialGuess::solve_view(std::size_t index) {
  LinearView& view = workspace_.linear[index];
  view = {};
  view.shape = ModelShape::collinear;
  std::size_t count = 0;
  const Straightening straight = straightening();
  fit_view_lines(data_, data_.views[index], straight, workspace_.sums, workspace_.lines, &count);
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
    find_focal_lengths(M, straight.centre_x, straight.centre_y, &view.fx, &view.fy);
  }
  view.shape = frame.shape;
}

void InitialGuess::try_straightening() {
  try_spatial_focal_lengths();
  try_planar_focal_lengths();
  double best_px = kCapPx;
  for (std::size_t i = 0; i < num_candidates_; ++i) best_px = std::min(best_px, candidates_[i].rms_px);
  if (exhaustive_ && straightening_ == 0 && best_px > options_.good_enough_px) sweep_focal_lengths();
}

void InitialGuess::try_spatial_focal_lengths() {
  const auto median = [this](double LinearView::*focal) {
    std::size_t count = 0;
    for (std::size_t v = 0; v < data_.views.size(); v += stride_) {
      const LinearView& view = workspace_.linear[v];
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

/// One focal length for both axes, as pixels are square, and one each where these differ by so much that they lead to
/// another end.
void InitialGuess::try_planar_focal_lengths() {
  const double scale = straightening().half_diagonal;
  double f = 0.0;
  double fx = 0.0;
  double fy = 0.0;
  const bool shared = solve_focal_length(focal_matrix_, focal_vector_, &f);
  if (shared) try_camera(scale * f, scale * f);
  if (!solve_focal_lengths(focal_matrix_, focal_vector_, &fx, &fy)) return;
  if (!(shared && is_near(fx, f) && is_near(fy, f))) try_camera(scale * fx, scale * fy);
}

void InitialGuess::sweep_focal_lengths() {
  for (const double degrees : kSweepDeg) {
    const double f = 0.5 * data_.width / tangent(deg_to_rad(0.5 * degrees));
    try_camera(f, f);
  }
}

Camera InitialGuess::camera_for(double fx, double fy) const {
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
  return camera;
}

/// Poses the search's views for a camera with these focal lengths and keeps it as a candidate by its cost.
void InitialGuess::try_camera(double fx, double fy) {
  const double widest = 0.5 * data_.width / tangent(deg_to_rad(0.5 * options_.max_view_deg));
  const double narrowest = 0.5 * data_.width / tangent(deg_to_rad(0.5 * options_.min_view_deg));
  if (!(fx >= widest && fx <= narrowest && fy >= widest && fy <= narrowest)) return;
  const Camera camera = camera_for(fx, fy);
  Visibility sum;
  for (std::size_t v = 0; v < data_.views.size(); v += stride_) {
    RefineView& view = workspace_.views[v];
    view.used = pose_view(data_, data_.views[v], workspace_.linear[v], camera, &view.pose, &sum);
  }
  posed_ = {};
  if (sum.points == 0) return;
  const StartCandidate candidate{fx, fy, std::sqrt(sum.cost / static_cast<double>(sum.points)), straightening_};
  if (stride_ == 1) posed_ = candidate;
  keep_candidate(candidate);
}

ViewGeometry InitialGuess::geometry() const {
  Orientations orientations;
  for (std::size_t v = 0; v < data_.views.size(); ++v) {
    const LinearView& linear = workspace_.linear[v];
    if (!workspace_.views[v].used) continue;
    if (linear.shape == ModelShape::non_planar) return ViewGeometry::spatial;
    orientations.add(rotation_of(workspace_.views[v].pose) * Eigen::Map<const Mat3>(linear.axes).row(2).transpose());
  }
  return orientations.geometry();
}

ViewGeometry classify_views(const CalibrationData& data, Span<const RefineView> views, Span<LineSums> sums,
                            Span<ViewLine> lines) {
  const Straightening none{centre_x(data), centre_y(data), 1.0, 0.0};
  Orientations orientations;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!views[v].used) continue;
    std::size_t count = 0;
    fit_view_lines(data, data.views[v], none, sums, lines, &count);
    const ModelFrame frame = find_model_frame(data.model, Span<const ViewLine>(lines).first(count));
    if (frame.shape == ModelShape::non_planar) return ViewGeometry::spatial;
    orientations.add(rotation_of(views[v].pose) * frame.axes.row(2).transpose());
  }
  return orientations.geometry();
}

}  // namespace lecalib
