// SPDX-License-Identifier: MIT
#include "lecalib/usb/fx3_camera.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "lecalib/host/sensor_size.hpp"
#include "lecalib/usb/evt3_stream.hpp"
#include "lecalib/usb/inivation_sequences.hpp"
#include "lecalib/usb/recording_header.hpp"

namespace lecalib::usb {
namespace {

using host::Error;
using host::MaybeError;
using host::Result;

constexpr std::uint8_t kUsualDataEndpoint = 0x82;
constexpr std::uint32_t kEarlyPacketUs = 1000;

/// What tells the two cameras apart.
struct Fx3Kind {
  const char* chip;
  SensorSize chip_size;
  unsigned min_firmware;  ///< lower byte of the device's release
  std::uint32_t logic;    ///< version of what runs in its FPGA
  std::uint32_t min_logic_patch;
  bool is_davis;
};

constexpr Fx3Kind kDavis346 = {"DAVIS346", {346, 260}, 6, 18, 1, true};
constexpr Fx3Kind kDvxplorer = {"DVXplorer", {640, 480}, 8, 18, 2, false};

class Fx3Camera : public Camera {
 public:
  Fx3Camera(std::unique_ptr<Transport> transport, const char* name, const Fx3Kind& kind)
      : transport_(std::move(transport)), link_(transport_.get()), kind_(kind) {
    sequences_ = kind.is_davis ? davis346_sequences() : dvxplorer_sequences();
    info_.device = transport_->info();
    info_.name = name;
    info_.serial = info_.device.serial.empty() ? "00000000" : info_.device.serial;
    const std::vector<std::uint8_t>& found = info_.device.bulk_endpoints;
    const auto in = std::find_if(found.begin(), found.end(), [](std::uint8_t e) { return (e & kDeviceAnswers) != 0; });
    if (in != found.end()) data_endpoint_ = *in;
  }
  ~Fx3Camera() override { Fx3Camera::stop(); }

  MaybeError identify();

  [[nodiscard]] const CameraInfo& info() const override { return info_; }
  [[nodiscard]] SensorSize sensor() const override { return facts_.size; }
  [[nodiscard]] std::string file_header() const override;
  [[nodiscard]] std::size_t word_bytes() const override { return sizeof(std::uint16_t); }
  MaybeError start(const CameraSettings& settings, StreamSink* sink) override;
  void stop() override;
  [[nodiscard]] StreamStats stream_stats() const override { return transport_->stream_stats(); }

 private:
  MaybeError check_versions();
  MaybeError read(Fx3Parameter parameter, std::uint32_t* value);
  MaybeError run(Span<const ParameterStep> steps);
  [[nodiscard]] MaybeError check(const CameraSettings& settings) const;
  MaybeError set_up(const CameraSettings& settings);
  MaybeError set_roi(const std::optional<Roi>& wanted);
  MaybeError set_early_packets();
  MaybeError begin_stream(StreamSink* sink);

  std::unique_ptr<Transport> transport_;
  Fx3Link link_;
  Fx3Kind kind_;
  InivationSequences sequences_;
  CameraInfo info_;
  InivationFacts facts_;
  std::uint8_t data_endpoint_ = kUsualDataEndpoint;
  std::optional<Evt3Stream> stream_;  ///< outlives the transport's stream
  bool is_running_ = false;
};

MaybeError Fx3Camera::identify() {
  if (MaybeError error = check_versions()) return error;
  std::uint32_t columns = 0, rows = 0, orientation = 0, imu_type = 0, imu_orientation = 0;
  if (MaybeError error = read(kFx3Columns, &columns)) return error;
  if (MaybeError error = read(kFx3Rows, &rows)) return error;
  if (MaybeError error = read(kFx3Orientation, &orientation)) return error;
  if (MaybeError error = read(kFx3ImuType, &imu_type)) return error;
  if (MaybeError error = read(kFx3ImuOrientation, &imu_orientation)) return error;
  if (columns != kind_.chip_size.width || rows != kind_.chip_size.height) {
    return Error{"its sensor has " + std::to_string(columns) + "x" + std::to_string(rows) + " px, expected " +
                 host::to_string(kind_.chip_size)};
  }
  facts_.swaps_axes = (orientation & 4U) != 0;
  facts_.size = kind_.chip_size;
  if (facts_.swaps_axes) std::swap(facts_.size.width, facts_.size.height);
  for (unsigned axis = 0; axis < 3; ++axis) facts_.flips_imu[axis] = (imu_orientation >> (2 - axis) & 1U) != 0;
  facts_.imu_type = static_cast<std::uint8_t>(imu_type);
  return std::nullopt;
}

MaybeError Fx3Camera::check_versions() {
  constexpr const char* kUpdate = ": update it with its maker's tool";
  const unsigned firmware = info_.device.release & 0xFFU;
  info_.firmware = std::to_string(firmware);
  if (firmware < kind_.min_firmware) {
    return Error{"its firmware " + info_.firmware + " is older than " + std::to_string(kind_.min_firmware) + kUpdate};
  }
  std::uint32_t logic = 0, patch = 0;
  if (MaybeError error = read(kFx3Logic, &logic)) return error;
  if (MaybeError error = read(kFx3LogicPatch, &patch)) return error;
  const std::string found = std::to_string(logic) + "." + std::to_string(patch);
  info_.firmware += ", logic " + found;
  const std::string wanted = std::to_string(kind_.logic) + "." + std::to_string(kind_.min_logic_patch);
  if (logic > kind_.logic) return Error{"its logic " + found + " is newer than what is known here, " + wanted};
  if (logic == kind_.logic && patch >= kind_.min_logic_patch) return std::nullopt;
  return Error{"its logic " + found + " is older than " + wanted + kUpdate};
}

std::string Fx3Camera::file_header() const {
  return recording_header(facts_.size, {{"sensor_name", kind_.chip}, {"serial_number", info_.serial}});
}

MaybeError Fx3Camera::check(const CameraSettings& settings) const {
  if (!settings.biases.empty()) return Error{"the biases of this camera cannot be changed from here"};
  if (settings.max_events_per_s > 0) return Error{"this camera has no limit of its own for its rate"};
  if (!settings.roi) return std::nullopt;
  if (!kind_.is_davis) return Error{"the region of interest of this camera cannot be set from here"};
  const Roi& roi = *settings.roi;
  const bool fits =
      roi.width > 0 && roi.height > 0 && roi.x + roi.width <= sensor().width && roi.y + roi.height <= sensor().height;
  if (fits) return std::nullopt;
  return Error{"the region of interest leaves the sensor of " + host::to_string(sensor()) + " px"};
}

MaybeError Fx3Camera::start(const CameraSettings& settings, StreamSink* sink) {
  stop();
  if (MaybeError error = check(settings)) return error;
  if (MaybeError error = set_up(settings)) return error;
  if (MaybeError error = begin_stream(sink)) return error;
  is_running_ = true;
  MaybeError error = run(sequences_.run);
  if (error) stop();
  return error;
}

/// Everything off first: that brings a running camera to a known state.
MaybeError Fx3Camera::set_up(const CameraSettings& settings) {
  if (MaybeError error = run(sequences_.stop)) return error;
  if (MaybeError error = run(sequences_.set_up)) return error;
  if (MaybeError error = set_roi(settings.roi)) return error;
  return set_early_packets();
}

MaybeError Fx3Camera::set_roi(const std::optional<Roi>& wanted) {
  if (!kind_.is_davis) return std::nullopt;
  std::uint32_t has_roi = 0;
  if (MaybeError error = read(kDavisHasRoi, &has_roi)) return error;
  if (has_roi == 0) return wanted ? MaybeError(Error{"this camera has no region of interest"}) : std::nullopt;
  Roi roi = wanted.value_or(Roi{0, 0, sensor().width, sensor().height});
  if (facts_.swaps_axes) roi = {roi.y, roi.x, roi.height, roi.width};
  const ParameterStep steps[] = {{kDavisRoiBeginColumn, roi.x},
                                 {kDavisRoiBeginRow, roi.y},
                                 {kDavisRoiLastColumn, roi.x + roi.width - 1U},
                                 {kDavisRoiLastRow, roi.y + roi.height - 1U}};
  return run(steps);
}

/// Transfers that do not fill go after a while: so late come the events of a still scene.
MaybeError Fx3Camera::set_early_packets() {
  std::uint32_t clock_mhz = 0, deviation = 0;
  if (MaybeError error = read(kFx3UsbClock, &clock_mhz)) return error;
  if (MaybeError error = read(kFx3ClockDeviation, &deviation)) return error;
  constexpr std::uint64_t kDeviationUnit = 1000;
  const std::uint64_t cycles = std::uint64_t{kEarlyPacketUs} * clock_mhz * deviation / kDeviationUnit;
  return link_.write(kFx3EarlyPacket, static_cast<std::uint32_t>(cycles));
}

/// The transfers wait before the first word comes.
MaybeError Fx3Camera::begin_stream(StreamSink* sink) {
  if (kind_.is_davis) {
    stream_.emplace(DavisUsbDecoder(DavisUsbFormat(facts_)), facts_.size, sink);
  } else {
    stream_.emplace(DvxplorerUsbDecoder(DvxplorerUsbFormat(facts_)), facts_.size, sink);
  }
  StreamOptions options;
  options.endpoint = data_endpoint_;
  UsbStatus status = transport_->clear_halt(data_endpoint_);
  if (status == UsbStatus::ok) status = transport_->start_stream(options, &*stream_);
  if (status == UsbStatus::ok) return std::nullopt;
  return Error{to_string(status), {}, 0, 0, {}, Status::io_error};
}

void Fx3Camera::stop() {
  if (!std::exchange(is_running_, false)) return;
  (void)run(sequences_.stop);  // ends with the first step that fails: a camera that is gone answers none of the others
  transport_->stop_stream();
}

MaybeError Fx3Camera::read(Fx3Parameter parameter, std::uint32_t* value) {
  const Result<std::uint32_t> answer = link_.read(parameter);
  if (!answer.ok()) return answer.error();
  *value = answer.value();
  return std::nullopt;
}

MaybeError Fx3Camera::run(Span<const ParameterStep> steps) {
  for (const ParameterStep& step : steps) {
    if (MaybeError error = link_.write(step.parameter, step.value)) return error;
    if (step.wait_us > 0) transport_->wait_us(step.wait_us);
  }
  return std::nullopt;
}

Result<std::unique_ptr<Camera>> open(std::unique_ptr<Transport> transport, const char* name, const Fx3Kind& kind) {
  auto camera = std::make_unique<Fx3Camera>(std::move(transport), name, kind);
  if (MaybeError error = camera->identify()) return *std::move(error);
  return std::unique_ptr<Camera>(std::move(camera));
}

}  // namespace

Result<std::unique_ptr<Camera>> open_davis346(std::unique_ptr<Transport> transport, const char* name) {
  return open(std::move(transport), name, kDavis346);
}

Result<std::unique_ptr<Camera>> open_dvxplorer(std::unique_ptr<Transport> transport, const char* name) {
  return open(std::move(transport), name, kDvxplorer);
}

}  // namespace lecalib::usb
