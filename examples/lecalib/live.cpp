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
#include "lecalib/events/event_stream.hpp"
#include "lecalib/host/cpu_clock.hpp"

namespace lecalib::command {
namespace {

struct LiveOptions {
  CalibrateOptions calibrate;
  CameraOptions camera;
};

constexpr std::size_t kEventsPerRead = std::size_t{1} << 16;
/// Between the last event before a camera was plugged in anew and the first one after: no window holds both.
constexpr std::int64_t kRestartGapUs = 1'000'000;

/// Decodes the bytes of a camera as a file of the same bytes is decoded.
class CameraSource : public EventSource {
 public:
  explicit CameraSource(const CameraOptions& options) : stream_(options), events_(kEventsPerRead) { begin(); }

  [[nodiscard]] SensorSize sensor() const override { return stream_.camera().sensor(); }
  Span<const Event> read() override;
  void show(const MonoCalibrator& calibrator, Progress* progress) const override {
    const MonoStats& stats = calibrator.stats();
    stream_.show(progress,
                 std::to_string(stats.lines) + " lines in " + std::to_string(stats.windows.windows) + " windows");
  }
  [[nodiscard]] DecoderStats stats() const override;
  [[nodiscard]] std::uint64_t decode_cpu_ns() const override { return decode_cpu_ns_; }
  [[nodiscard]] CameraStream& stream() { return stream_; }

 private:
  void begin();
  bool next_bytes();

  CameraStream stream_;
  std::string header_;
  std::unique_ptr<EventStreamDecoder> decoder_;
  Span<const std::uint8_t> bytes_;  ///< to be decoded next, then held_
  Span<const std::uint8_t> held_;
  std::vector<Event> events_;
  std::int64_t shift_us_ = 0;
  std::int64_t last_us_ = 0;
  int restarts_ = 0;
  DecoderStats before_;  ///< of decoders that are over
  std::uint64_t decode_cpu_ns_ = 0;
};

void CameraSource::begin() {
  header_ = stream_.camera().file_header();
  decoder_ = std::make_unique<EventStreamDecoder>();
  bytes_ = {reinterpret_cast<const std::uint8_t*>(header_.data()), header_.size()};
}

Span<const Event> CameraSource::read() {
  while (true) {
    if (bytes_.empty() && !next_bytes()) return {};
    std::size_t count = 0;
    const std::uint64_t begin_ns = host::thread_cpu_ns();
    const Status status = decoder_->decode(&bytes_, events_, &count);
    decode_cpu_ns_ += host::thread_cpu_ns() - begin_ns;
    if (is_error(status))
      fail({std::string("the camera sent what cannot be decoded: expected ") + decoder_->error().expected});
    if (count == 0) continue;
    for (std::size_t i = 0; i < count; ++i) events_[i].t_us += shift_us_;
    last_us_ = events_[count - 1].t_us;
    return {events_.data(), count};
  }
}

bool CameraSource::next_bytes() {
  if (Interrupt::came()) {  // now, not once all that waits is worked on
    stream_.abandon();
    return false;
  }
  bytes_ = std::exchange(held_, {});
  if (bytes_.empty()) bytes_ = stream_.read();
  // What waits behind a gap has gaps as well; without it the next stretch is a whole one.
  if (stream_.has_gap()) {
    stream_.skip_waiting();
    bytes_ = stream_.read();
  }
  if (stream_.restarts() != restarts_) {
    restarts_ = stream_.restarts();
    add_counts(decoder_->stats(), &before_);
    shift_us_ = last_us_ + kRestartGapUs;
    held_ = bytes_;
    begin();
  }
  return !bytes_.empty();
}

DecoderStats CameraSource::stats() const {
  DecoderStats all = before_;
  add_counts(decoder_->stats(), &all);
  return all;
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
    report->diagnostics.dropped.push_back({"buffers", source.stream().dropped()});
    const std::string& fault = source.stream().fault();
    if (!fault.empty()) std::fprintf(stderr, "lecalib: %s: calibrated from what came before\n", fault.c_str());
    std::fputs(source.stream().losses().c_str(), stderr);
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
