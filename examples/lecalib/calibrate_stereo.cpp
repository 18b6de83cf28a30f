// SPDX-License-Identifier: MIT
/// lecalib calibrate EVENTS --right EVENTS: from recordings of two cameras to both and the pose between them.
#include <memory>
#include <vector>

#include "calibrate.hpp"
#include "event_options.hpp"
#include "lecalib/host/cpu_clock.hpp"
#include "lecalib/host/file_io.hpp"
#include "lecalib/host/heap_arena.hpp"
#include "lecalib/pipeline/stereo_calibrator.hpp"

namespace lecalib::command {
namespace {

using Sources = std::vector<std::unique_ptr<EventSource>>;

/// The events of one camera, file by file, as the calibrator asks for them.
class Feed {
 public:
  Feed(StereoSide side, const Sources& sources, Progress* progress)
      : side_(side), sources_(sources), progress_(progress) {}

  /// Gives the calibrator events until its window is full or there are none left.
  void advance(StereoCalibrator* calibrator) {
    while (true) {
      if (events_.empty() && !read()) {
        (void)calibrator->finish(side_);
        return;
      }
      if (calibrator->push(side_, &events_) != Status::ok) return;
      sources_[current_]->show(calibrator->camera(side_), progress_);
    }
  }

 private:
  bool read() {
    for (; current_ < sources_.size(); ++current_) {
      events_ = sources_[current_]->read();
      if (!events_.empty()) return true;
    }
    return false;
  }

  StereoSide side_;
  const Sources& sources_;
  Progress* progress_;
  Span<const Event> events_;
  std::size_t current_ = 0;
};

void collect(const Sources& left, const Sources& right, StereoCalibrator* calibrator) {
  Progress progress("reading events, finding lines");
  Feed feeds[kStereoSides] = {{StereoSide::left, left, &progress}, {StereoSide::right, right, &progress}};
  while (calibrator->phase() == StereoPhase::collecting) {
    const Status status = calibrator->step();
    if (status == Status::need_more_data) feeds[static_cast<std::size_t>(calibrator->wanted())].advance(calibrator);
  }
}

/// A recording that stands for both cameras would give an answer: nothing between them.
void refuse_same_files(const CalibrateOptions& options) {
  for (const std::string& left : options.events) {
    for (const std::string& right : options.right) {
      if (host::is_same_file(left, right)) fail({"is named as both cameras' recording", right});
    }
  }
}

}  // namespace

void calibrate_stereo(const CalibrateOptions& options, const host::Model& model, host::CalibrationReport* report) {
  refuse_same_files(options);
  const Sources left = open_recordings(options.events, options.sensor);
  const Sources right = open_recordings(options.right, options.sensor);
  std::vector<std::string>& inputs = report->diagnostics.inputs;
  inputs.insert(inputs.end(), options.events.begin(), options.events.end());
  inputs.insert(inputs.end(), options.right.begin(), options.right.end());
  const StereoCapacities capacities = {capacities_for(left.front()->sensor(), options, model),
                                       capacities_for(right.front()->sensor(), options, model)};
  StereoOptions stereo;
  stereo.left = mono_options(options, left.front()->sensor());
  stereo.right = mono_options(options, right.front()->sensor());
  stereo.right.matcher.hints.has_pose = false;  // nobody knows yet where the object is for the right camera
  const host::HeapArena block(required_bytes(capacities));
  const auto calibrator = std::make_unique<StereoCalibrator>();
  const Status ready = calibrator->init(block.memory(), capacities, stereo, model.lines);
  if (is_error(ready)) fail({std::string("cannot start with this model: ") + to_string(ready)});

  collect(left, right, calibrator.get());
  const std::uint64_t begin_ns = host::thread_cpu_ns();
  {
    Progress progress("matching and solving");
    while (calibrator->step() == Status::in_progress) progress.update(static_cast<double>(calibrator->progress()));
  }
  report_counts(left, calibrator->camera(StereoSide::left).stats(), "left.", &report->diagnostics);
  report_counts(right, calibrator->camera(StereoSide::right).stats(), "right.", &report->diagnostics);
  report->diagnostics.cpu_ms.push_back(
      {"match_and_solve", static_cast<double>(host::thread_cpu_ns() - begin_ns) * 1e-6});
  host::add_stereo_result(*calibrator, model.names, report);
}

}  // namespace lecalib::command
