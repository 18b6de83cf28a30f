// SPDX-License-Identifier: MIT
// Calibrates a camera from an event recording with nothing but static memory: on a Cortex-M without an operating
// system, or on any computer. Prints the camera, and all doubles of the result by their bits.
#include <cstddef>

#include "board.hpp"
#include "clip.hpp"
#include "lecalib/events/evt3_decoder.hpp"
#include "lecalib/events/stream_head.hpp"
#include "lecalib/pipeline/mono_calibrator.hpp"
#include "text.hpp"

namespace {

using namespace lecalib;

constexpr Capacities kCapacities = [] {
  Capacities c;
  c.sensor_width = 320, c.sensor_height = 320;
  c.events_per_window = 7000, c.lines_per_window = 24, c.windows = 16, c.model_lines = 16;
  c.edges = false;  // windows of so few events are thinned and show none
  return c;
}();
/// Shorter windows than usual, so that most keep all of their events.
constexpr float kTravelPx = 3;
alignas(kArenaAlign) std::byte memory[required_bytes(kCapacities)];
MonoCalibrator calibrator;

/// The edges of a box of 0.4 x 0.3 x 0.25 m that the camera sees.
constexpr ModelLine kBox[] = {
    {{0, 0, 0}, {0.4, 0, 0}},  {{0, 0, 0.25}, {0.4, 0, 0.25}}, {{0, 0.3, 0.25}, {0.4, 0.3, 0.25}},
    {{0, 0, 0}, {0, 0.3, 0}},  {{0, 0, 0.25}, {0, 0.3, 0.25}}, {{0.4, 0, 0.25}, {0.4, 0.3, 0.25}},
    {{0, 0, 0}, {0, 0, 0.25}}, {{0.4, 0, 0}, {0.4, 0, 0.25}},  {{0, 0.3, 0}, {0, 0.3, 0.25}}};

/// Gives the clip's events in small pieces, as a sensor's driver would.
class EventSource {
 public:
  Status open() {
    Status status = head_.read(&bytes_);
    if (status == Status::in_progress) status = head_.finish();
    if (status != Status::ok) return status;
    if (head_.facts().format != EventFormat::evt3) return Status::unsupported_format;
    decoder_ = Evt3Decoder(head_.facts().size);
    begin_ = head_.unread();
    return Status::ok;
  }

  /// The next events; none at the end.
  Span<const Event> next() {
    std::size_t count = 0;
    for (Span<const std::uint8_t>* input : {&begin_, &bytes_}) {
      if (count == 0 && decoder_.decode(input, events_, &count) != Status::ok) return {};
    }
    if (count == 0 && decoder_.finish(events_, &count) != Status::ok) return {};
    return {events_, count};
  }

 private:
  StreamHead head_;
  Evt3Decoder decoder_{SensorSize{}};
  Span<const std::uint8_t> bytes_ = clip();
  Span<const std::uint8_t> begin_;  ///< bytes that the head took and the events begin with
  Event events_[64];
};

/// A main loop: each turn takes some events or does one bounded piece of work. A product does other things in between.
Status calibrate() {
  EventSource source;
  if (const Status status = source.open(); status != Status::ok) return status;
  MonoOptions options;
  options.window.travel_px = kTravelPx;
  if (const Status status = calibrator.init(memory, kCapacities, options, kBox); status != Status::ok) return status;
  Span<const Event> events;
  bool more_to_come = true;
  for (;;) {
    if (more_to_come && events.empty()) {
      events = source.next();
      more_to_come = !events.empty();
      if (!more_to_come && calibrator.finish() != Status::ok) return Status::wrong_state;
    }
    if (more_to_come && calibrator.push(&events) == Status::ok) continue;
    const Status status = calibrator.step();
    if (status == Status::ok || is_error(status)) return status;
  }
}

void print_camera(const CalibrationResult& result) {
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    Text line;
    line.add(kIntrinsicNames[i]).add(" ").add_decimal(result.camera.*kIntrinsics[i]);
    line.add(" +- ").add_decimal(result.sigma[i]).add(result.assumed[i] ? " (assumed)\n" : "\n");
    board::print(line.c_str());
  }
  Text line;
  line.add("rms ").add_decimal(result.rms_px).add(" px over ").add(std::uint64_t{result.views.size()}).add(" views\n");
  board::print(line.c_str());
}

void print_bits(const char* name, Span<const double> values) {
  for (std::size_t i = 0; i < values.size(); i += 6) {
    Text line;
    line.add("bits ").add(name);
    for (const double value : values.subspan(i, values.size() - i < 6 ? values.size() - i : 6)) {
      line.add(" ").add_bits(value);
    }
    board::print(line.add("\n").c_str());
  }
}

/// Every double of the result: the same on all targets.
void print_bits(const CalibrationResult& result) {
  double intrinsics[kNumIntrinsics];
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) intrinsics[i] = result.camera.*kIntrinsics[i];
  print_bits("camera", intrinsics);
  print_bits("sigma", result.sigma);
  print_bits("covariance", result.covariance);
  const double fit[] = {result.rms_px, result.chi2_per_dof, result.condition};
  print_bits("fit", fit);
  for (const ViewResult& view : result.views) {
    print_bits("R", view.T_cam_world.R);
    print_bits("t", view.T_cam_world.t);
  }
}

}  // namespace

int main() {
  const Status status = calibrate();
  CalibrationResult result;
  (void)calibrator.result(&result);
  board::print(Text().add("lecalib: ").add(to_string(status)).add("\n").c_str());
  if (status == Status::ok) print_camera(result);
  print_bits(result);
  Text used;
  used.add("memory ").add(std::uint64_t{sizeof memory}).add(" bytes, stack ").add(std::uint64_t{board::stack_used()});
  board::print(used.add(" bytes\n").c_str());
  return status == Status::ok ? 0 : 1;
}
