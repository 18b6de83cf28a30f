// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/stereo_calibrator.hpp"

#include <algorithm>

#include "lecalib/math/eigen.hpp"
#include "lecalib/math/so3.hpp"

namespace lecalib {
namespace {

/// How far the phases after collecting have come when they begin.
constexpr float kShareOfOneCamera = 0.45F;

/// See MonoCalibrator::result().
constexpr std::size_t kViewsPerWindow = 2;

bool same_time(const EventWindow& a, const EventWindow& b) { return a.begin_us == b.begin_us && a.end_us == b.end_us; }

}  // namespace

const char* to_string(StereoPhase phase) noexcept {
  switch (phase) {
    case StereoPhase::idle: return "idle";
    case StereoPhase::collecting: return "collecting";
    case StereoPhase::left: return "left";
    case StereoPhase::right: return "right";
    case StereoPhase::between: return "between";
    case StereoPhase::done: return "done";
    case StereoPhase::failed: return "failed";
  }
  return "unknown";
}

Status StereoCalibrator::init(Span<std::byte> memory, const StereoCapacities& capacities, const StereoOptions& options,
                              Span<const ModelLine> model) {
  phase_ = StereoPhase::idle;
  verdict_ = Status::wrong_state;
  if (!options.left.gyro_samples.empty() || !options.right.gyro_samples.empty() ||
      capacities.left.windows != capacities.right.windows) {
    return Status::invalid_argument;
  }
  Arena arena(memory);
  if (!carve(arena, capacities, &workspace_)) return Status::buffer_too_small;
  options_ = options;
  options_.left.windows_on_grid = options_.right.windows_on_grid = true;
  options_.right.window = options_.left.window;
  model_ = model;
  Status status = cameras_[0].init(workspace_.camera[0], capacities.left, options_.left, model);
  if (status == Status::ok) {
    status = cameras_[1].init(workspace_.camera[1], capacities.right, options_.right, model);
  }
  if (status != Status::ok) return status;
  result_ = StereoResult();
  for (Clock& clock : clocks_) clock = {};
  finished_[0] = finished_[1] = false;
  verdict_ = Status::in_progress;
  failed_in_ = StereoPhase::idle;
  phase_ = StereoPhase::collecting;
  return Status::ok;
}

Status StereoCalibrator::push(StereoSide side, Span<const Event>* events) {
  if (phase_ != StereoPhase::collecting || finished_[index_of(side)]) return Status::wrong_state;
  return cameras_[index_of(side)].push(events);
}

Status StereoCalibrator::finish(StereoSide side) {
  if (phase_ != StereoPhase::collecting) return Status::wrong_state;
  finished_[index_of(side)] = true;
  return Status::ok;
}

StereoSide StereoCalibrator::wanted() const {
  const bool left = !finished_[0] && cameras_[0].full_window() == nullptr;
  return left ? StereoSide::left : StereoSide::right;
}

Status StereoCalibrator::step() {
  switch (phase_) {
    case StereoPhase::collecting: return collect();
    case StereoPhase::left: return calibrate(StereoSide::left);
    case StereoPhase::right: return calibrate(StereoSide::right);
    case StereoPhase::between: {
      const Status status = refiner_.step();
      if (status == Status::in_progress) return status;
      result_.tie_chi2_per_dof = refiner_.solution().tie_chi2_per_dof;
      return status == Status::ok ? finish_between() : fail(status);
    }
    case StereoPhase::idle:
    case StereoPhase::done:
    case StereoPhase::failed: break;
  }
  return verdict_;
}

/// Windows of the same time are worked on together; what one camera has alone comes when the other one is past it.
/// Where clocks are set back, as between two recordings, times before that are past for both.
Status StereoCalibrator::collect() {
  const EventWindow* window[kStereoSides] = {};
  for (std::size_t side = 0; side < kStereoSides; ++side) {
    if (finished_[side]) (void)cameras_[side].close_window();
    window[side] = cameras_[side].full_window();
    if (window[side] == nullptr && !finished_[side]) return Status::need_more_data;
  }
  if (window[0] == nullptr && window[1] == nullptr) {
    for (MonoCalibrator& camera : cameras_) (void)camera.finish();
    phase_ = StereoPhase::left;
    return Status::in_progress;
  }
  if (window[0] == nullptr || window[1] == nullptr) return work_on(window[0] != nullptr, window[1] != nullptr);
  const std::uint32_t left_set_back = clocks_[0].times_set_back(*window[0]);
  const std::uint32_t right_set_back = clocks_[1].times_set_back(*window[1]);
  if (left_set_back != right_set_back) return work_on(left_set_back < right_set_back, right_set_back < left_set_back);
  if (same_time(*window[0], *window[1])) return work_on(true, true);
  const bool left_first = window[0]->begin_us != window[1]->begin_us ? window[0]->begin_us < window[1]->begin_us
                                                                     : window[0]->end_us < window[1]->end_us;
  return work_on(left_first, !left_first);
}

/// How often the clock was set back before the window.
std::uint32_t StereoCalibrator::Clock::times_set_back(const EventWindow& window) const {
  return set_back + (window.begin_us < begin_us ? 1 : 0);
}

/// Both banks are offered the same windows with the same information. A camera without lines of its own gets none; the
/// windows' length changes only between windows of both, so that both stay on one grid.
Status StereoCalibrator::work_on(bool left, bool right) {
  LineWindow lines[kStereoSides];
  const bool has[kStereoSides] = {left, right};
  float information = 0;
  for (std::size_t side = 0; side < kStereoSides; ++side) {
    const EventWindow* const window = has[side] ? cameras_[side].full_window() : nullptr;
    if (window == nullptr) continue;
    clocks_[side] = {clocks_[side].times_set_back(*window), window->begin_us};
    const Status status = cameras_[side].find_lines(&lines[side]);
    if (status != Status::ok) return fail(status);
    information += LineBank::information_of(lines[side].lines);
  }
  for (std::size_t side = 0; side < kStereoSides; ++side) {
    const LineWindow& other = lines[1 - side];
    cameras_[side].keep(has[side] ? lines[side] : LineWindow{other.begin_us, other.end_us, {}}, information);
  }
  if (!left || !right) return Status::in_progress;
  const std::int64_t length_us =
      std::min(cameras_[0].wanted_length_us(lines[0].lines), cameras_[1].wanted_length_us(lines[1].lines));
  for (MonoCalibrator& camera : cameras_) {
    const Status status = camera.set_window_length_us(length_us);
    if (status != Status::in_progress) return fail(status);
  }
  return Status::in_progress;
}

/// A step of one camera by itself.
Status StereoCalibrator::calibrate(StereoSide side) {
  const Status status = cameras_[index_of(side)].step();
  if (status == Status::in_progress) return status;
  if (status != Status::ok) return fail(status);
  if (side == StereoSide::left && cameras_[1].phase() != MonoPhase::done) {
    phase_ = StereoPhase::right;
    return Status::in_progress;
  }
  // Views of edges stand at other times than views of lines: where one camera has lines alone, both go by lines.
  for (const StereoSide other : {StereoSide::left, StereoSide::right}) {
    MonoCalibrator& camera = cameras_[index_of(other)];
    if (!camera.is_from_edges() || cameras_[0].is_from_edges() == cameras_[1].is_from_edges()) continue;
    phase_ = other == StereoSide::left ? StereoPhase::left : StereoPhase::right;
    const Status again = camera.use_lines();
    return again == Status::in_progress ? again : fail(again);
  }
  return begin_between();
}

/// Fills the workspace's pairs and poses with what both cameras have seen at the same time: in the same window, as both
/// banks keep the same ones. @return how many there are
std::size_t StereoCalibrator::pair_views() {
  CalibrationResult results[kStereoSides];
  for (std::size_t side = 0; side < kStereoSides; ++side) (void)cameras_[side].result(&results[side]);
  const Span<const WindowPoses> left = cameras_[0].matched_windows();
  const Span<const WindowPoses> right = cameras_[1].matched_windows();
  std::size_t count = 0;
  for (std::size_t l = 0, r = 0; l < left.size() && r < right.size();) {
    if (left[l].window != right[r].window) {
      ++(left[l].window < right[r].window ? l : r);
      continue;
    }
    for (std::size_t view = 0; view < kViewsPerWindow; ++view) {
      const auto at_left = static_cast<std::uint32_t>(kViewsPerWindow * l + view);
      const auto at_right = static_cast<std::uint32_t>(kViewsPerWindow * r + view);
      const ViewResult& seen_left = results[0].views[at_left];
      const ViewResult& seen_right = results[1].views[at_right];
      if (!seen_left.used || !seen_right.used) continue;
      workspace_.pairs[count] = {at_left, at_right, Pose()};
      workspace_.poses[count++] = {seen_left.T_cam_world, seen_right.T_cam_world, Pose(), false};
    }
    ++l;
    ++r;
  }
  return count;
}

Status StereoCalibrator::begin_between() {
  phase_ = StereoPhase::between;
  const std::size_t count = pair_views();
  const Span<const Pose> symmetries = workspace_.symmetries.first(find_symmetries(model_, workspace_.symmetries));
  Pose T_right_left;
  Status status = find_stereo_pose(workspace_.poses.first(count), symmetries, options_.pose, &T_right_left);
  result_.disagreeing = static_cast<std::uint32_t>(count);
  if (status != Status::ok) return fail(status);
  std::size_t agreeing = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (!workspace_.poses[i].agrees) continue;
    StereoPair pair = workspace_.pairs[i];
    pair.symmetry = workspace_.poses[i].symmetry;
    workspace_.pairs[agreeing++] = pair;
  }
  result_.instants = static_cast<std::uint32_t>(agreeing);
  result_.disagreeing = static_cast<std::uint32_t>(count - agreeing);
  StereoRefineOptions refine = options_.refine;
  refine.independent_views = options_.left.solver.covariance.independent_views;
  refine.line_errors = options_.left.solver.covariance.line_errors;
  refine.max_tie_chi2_per_dof = options_.left.solver.plausibility.max_chi2_per_dof;
  status = refiner_.init(cameras_[0].solver().stereo_camera(), cameras_[1].solver().stereo_camera(),
                         workspace_.pairs.first(agreeing), T_right_left, refine, workspace_.refiner);
  return status == Status::ok ? Status::in_progress : fail(status);
}

Status StereoCalibrator::finish_between() {
  const StereoSolution& solution = refiner_.solution();
  for (std::size_t side = 0; side < kStereoSides; ++side) cameras_[side].solver().take_stereo(solution, side);
  result_.T_right_left = solution.T_right_left;
  constexpr auto kAll = static_cast<Eigen::Index>(StereoSolution::kParameters);
  const Eigen::Map<const Eigen::Matrix<double, kAll, kAll, Eigen::RowMajor>> all(solution.covariance);
  Mat6 d_increment = Mat6::Identity();  // t' = exp(w) t + v
  d_increment.bottomLeftCorner<3, 3>() = -hat(translation_of(solution.T_right_left));
  const Mat6 half = d_increment.lazyProduct(Mat6(all.bottomRightCorner<6, 6>()));
  Eigen::Map<Mat6>(result_.covariance) = half.lazyProduct(d_increment.transpose());
  phase_ = StereoPhase::done;
  return verdict_ = Status::ok;
}

Status StereoCalibrator::fail(Status status) {
  failed_in_ = phase_;
  phase_ = StereoPhase::failed;
  return verdict_ = status;
}

Status StereoCalibrator::result(StereoResult* out) const {
  if (phase_ != StereoPhase::done && phase_ != StereoPhase::failed) return Status::wrong_state;
  StereoResult result = result_;
  const Status left = cameras_[0].result(&result.left);
  const Status right = cameras_[1].result(&result.right);
  result.left.status = left;
  result.right.status = right;
  result.status = verdict_;
  *out = result;
  return verdict_;
}

float StereoCalibrator::progress() const {
  switch (phase_) {
    case StereoPhase::left: return kShareOfOneCamera * cameras_[0].progress();
    case StereoPhase::right: return kShareOfOneCamera * (1 + cameras_[1].progress());
    case StereoPhase::between: return 2 * kShareOfOneCamera;
    case StereoPhase::done: return 1;
    case StereoPhase::idle:
    case StereoPhase::collecting:
    case StereoPhase::failed: break;
  }
  return 0;
}

}  // namespace lecalib
