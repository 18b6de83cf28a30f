// SPDX-License-Identifier: MIT
/// lecalib live: calibrates a camera while it streams.
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "calibrate.hpp"
#include "camera_stream.hpp"
#include "commands.hpp"
#include "lecalib/host/cpu_clock.hpp"
#include "lecalib/host/text.hpp"
#include "lecalib/usb/live_decoder.hpp"

namespace lecalib::command {
namespace {

struct LiveOptions {
  CalibrateOptions calibrate;
  CameraOptions camera;
};

/// Events of a camera that streams.
class CameraSource : public EventSource {
 public:
  explicit CameraSource(const CameraOptions& options) : stream_(options) { begin(); }

  [[nodiscard]] SensorSize sensor() const override { return stream_.camera().sensor(); }
  Span<const Event> read() override;
  [[nodiscard]] bool has_gap() const override { return decoder_.has_gap(); }
  void show(const MonoCalibrator& calibrator, Progress* progress) const override;
  [[nodiscard]] DecoderStats stats() const override { return decoder_.stats(); }
  [[nodiscard]] std::uint64_t decode_cpu_ns() const override { return decode_cpu_ns_; }
  [[nodiscard]] const CameraStream& stream() const { return stream_; }
  /// What was lost on the way, as lines for people; empty if nothing was.
  [[nodiscard]] std::string losses() const;
  void count_dropped(host::Diagnostics* diagnostics) const;

 private:
  void begin() { check_decoded(decoder_.begin(stream_.camera().file_header())); }
  void check_decoded(Status status) const;
  bool take_buffer();

  CameraStream stream_;
  usb::LiveDecoder decoder_;
  int restarts_ = 0;
  std::uint64_t decode_cpu_ns_ = 0;
};

Span<const Event> CameraSource::read() {
  while (true) {
    Span<const Event> events;
    const std::uint64_t begin_ns = host::thread_cpu_ns();
    check_decoded(decoder_.next(&events));
    decode_cpu_ns_ += host::thread_cpu_ns() - begin_ns;
    if (!events.empty() || !take_buffer()) return events;
  }
}

void CameraSource::check_decoded(Status status) const {
  if (is_error(status))
    fail({std::string("the camera sent what cannot be decoded: expected ") + decoder_.error().expected});
}

/// @return false at the end of the stream
bool CameraSource::take_buffer() {
  if (Interrupt::came()) {  // now, not once all that waits is worked on
    stream_.abandon();
    return false;
  }
  const usb::BufferRing::Buffer buffer = stream_.read();
  if (stream_.restarts() != restarts_) {
    restarts_ = stream_.restarts();
    begin();
  }
  decoder_.take(buffer, stream_.waiting());
  return !buffer.bytes.empty();
}

void CameraSource::show(const MonoCalibrator& calibrator, Progress* progress) const {
  const MonoStats& stats = calibrator.stats();
  std::string text = std::to_string(stats.lines) + " lines in " + std::to_string(stats.windows.windows) + " windows";
  const usb::LeftOut& left_out = decoder_.left_out();
  if (left_out.times > 0) {
    const double share = static_cast<double>(left_out.events) / static_cast<double>(decoder_.stats().events);
    text += ", " + host::fixed(100 * share, 0) + " % left out";
  }
  stream_.show(progress, text);
}

std::string CameraSource::losses() const {
  const usb::LeftOut& left_out = decoder_.left_out();
  if (left_out.times == 0) return stream_.losses();
  const std::string buffers = left_out.buffers > 0 ? " and " + std::to_string(left_out.buffers) + " buffers" : "";
  return std::to_string(left_out.events) + " of " + std::to_string(decoder_.stats().events) + " events" + buffers +
         " left out, in " + std::to_string(left_out.times) + " stretches: this machine did not keep up\n" +
         stream_.losses();
}

void CameraSource::count_dropped(host::Diagnostics* diagnostics) const {
  const usb::LeftOut& left_out = decoder_.left_out();
  diagnostics->dropped.push_back({"events_left_out", left_out.events});
  diagnostics->dropped.push_back({"buffers", stream_.dropped() + left_out.buffers});
}

void run_live(const LiveOptions& options) {
  (void)options.camera.settings();  // words that cannot be read are said before the camera is touched
  run_calibration(options.calibrate, [&](const host::Model& model, host::CalibrationReport* report) {
    std::vector<std::unique_ptr<EventSource>> sources;
    sources.push_back(std::make_unique<CameraSource>(options.camera));
    auto& source = static_cast<CameraSource&>(*sources.front());
    const usb::CameraInfo& info = source.stream().camera().info();
    report->diagnostics.inputs.push_back(info.name + " " + info.serial);
    calibrate_from(sources, options.calibrate, model, report);
    source.count_dropped(&report->diagnostics);
    const std::string& fault = source.stream().fault();
    if (!fault.empty()) std::fprintf(stderr, "lecalib: %s: calibrated from what came before\n", fault.c_str());
    std::fputs(source.losses().c_str(), stderr);
  });
}

}  // namespace

void add_live(CLI::App& app) {
  CLI::App* command = app.add_subcommand("live", "Calibrate a live camera");
  const auto options = std::make_shared<LiveOptions>();
  command->footer(
      "Lines are found while the camera streams; at the end of --seconds, or by Ctrl-C, the camera is solved for from\n"
      "an even share of all windows, as many as there is room for. What this machine cannot keep up with is left out.");
  add_model_options(command, &options->calibrate);
  add_camera_options(command, &options->camera);
  add_solver_options(command, &options->calibrate);
  command->callback([options] { run_live(*options); });
}

}  // namespace lecalib::command
