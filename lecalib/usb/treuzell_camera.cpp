// SPDX-License-Identifier: MIT
#include "lecalib/usb/treuzell_camera.hpp"

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <utility>

#include "lecalib/host/sensor_size.hpp"
#include "lecalib/usb/imx636_sequences.hpp"
#include "lecalib/usb/recording_header.hpp"
#include "lecalib/usb/treuzell_link.hpp"

namespace lecalib::usb {
namespace {

using host::Error;
using host::MaybeError;
using host::Result;

constexpr SensorSize kSensorSize = {1280, 720};
constexpr std::uint8_t kSystemGen41 = 0x30;
constexpr std::uint8_t kSystemImx636 = 0x31;
constexpr std::uint32_t kMinFirmware = 0x030800;
constexpr std::uint32_t kChipIdRegister = 0x0014;
constexpr std::uint32_t kChipId = 0xA0401806;
constexpr std::uint32_t kChipVariantRegister = 0xF128;  // its two lowest bits are 0 in an IMX636

constexpr std::uint32_t kErcPeriodUs = 200;
constexpr std::uint32_t kMinEventRate = 1'000'000 / kErcPeriodUs;
constexpr std::uint32_t kMaxErcEvents = (1U << 22) - 1;

constexpr unsigned kDrainTimeoutMs = 50;
constexpr int kMaxDrains = 16;
constexpr std::size_t kDrainBytes = std::size_t{1} << 16;

std::string version_text(std::uint32_t version) {
  const auto part = [&](unsigned bit) { return std::to_string(version >> bit & 0xFFU); };
  return part(16) + "." + part(8) + "." + part(0);
}

std::string serial_text(const std::vector<std::uint32_t>& words) {
  char text[20];
  const std::uint64_t high = words.size() > 1 ? words[1] : 0;
  std::snprintf(text, sizeof text, "%08" PRIx64, high << 32U | words[0]);
  return text;
}

using RegisterSteps = std::vector<RegisterStep>;

class TreuzellCamera : public Camera {
 public:
  TreuzellCamera(std::unique_ptr<Transport> transport, const char* name)
      : transport_(std::move(transport)), link_(transport_.get()) {
    info_.device = transport_->info();
    info_.name = name;
  }
  ~TreuzellCamera() override { TreuzellCamera::stop(); }

  MaybeError identify();

  [[nodiscard]] const CameraInfo& info() const override { return info_; }
  [[nodiscard]] SensorSize sensor() const override { return kSensorSize; }
  [[nodiscard]] std::string file_header() const override;
  [[nodiscard]] std::size_t word_bytes() const override { return sizeof(std::uint16_t); }
  MaybeError start(const CameraSettings& settings, StreamSink* sink) override;
  void stop() override;
  [[nodiscard]] StreamStats stream_stats() const override { return transport_->stream_stats(); }

 private:
  MaybeError set_up(const CameraSettings& settings);
  MaybeError run(Span<const RegisterStep> steps);
  MaybeError write(const RegisterStep& step);
  template <class Value>
  MaybeError fill(const RegisterBlock& block, Value&& value);
  MaybeError set_rate_limit(std::uint32_t max_events_per_s);
  MaybeError set_roi(const std::optional<Roi>& roi);
  MaybeError set_bias(const BiasOffset& wanted);
  UsbStatus drain();

  std::unique_ptr<Transport> transport_;
  TreuzellLink link_;
  CameraInfo info_;
  std::uint8_t system_id_ = 0;
  std::vector<RegisterStep> biases_before_;  ///< values to go back to
  bool is_running_ = false;
};

MaybeError TreuzellCamera::identify() {
  const Result<std::uint8_t> system = link_.system_id();
  if (!system.ok()) return system.error();
  system_id_ = system.value();
  const auto release = link_.ask(TreuzellLink::kRelease, {});
  if (!release.ok()) return release.error();
  const auto serial = link_.ask(TreuzellLink::kSerial, {});
  if (!serial.ok()) return serial.error();
  if (release.value().empty() || serial.value().empty()) return Error{"the camera's answer is too short"};
  info_.firmware = version_text(release.value()[0]);
  info_.serial = serial_text(serial.value());
  if (release.value()[0] < kMinFirmware) {
    return Error{"its firmware " + info_.firmware + " is older than " + version_text(kMinFirmware) +
                 ": update it with its maker's tool"};
  }
  const Result<std::uint32_t> chip = link_.read_register(kChipIdRegister);
  if (!chip.ok()) return chip.error();
  const Result<std::uint32_t> variant = link_.read_register(kChipVariantRegister);
  if (!variant.ok()) return variant.error();
  if (system_id_ != kSystemImx636 || chip.value() != kChipId || (variant.value() & 3U) != 0) {
    return Error{std::string("its sensor is ") + (system_id_ == kSystemGen41 ? "a Gen4.1" : "not known") +
                 ", expected an IMX636"};
  }
  return std::nullopt;
}

std::string TreuzellCamera::file_header() const {
  return recording_header(
      kSensorSize,
      {{"sensor_name", "IMX636"}, {"serial_number", info_.serial}, {"system_ID", std::to_string(system_id_)}});
}

Result<Imx636Bias> find_bias(const std::string& name) {
  std::string names;
  for (const Imx636Bias& bias : imx636_biases()) {
    if (bias.name == name) return bias;
    names += (names.empty() ? "" : ", ") + std::string(bias.name);
  }
  return Error{"no bias is called " + name + ": there are " + names};
}

MaybeError check(const CameraSettings& settings) {
  for (const BiasOffset& wanted : settings.biases) {
    const Result<Imx636Bias> bias = find_bias(wanted.name);
    if (!bias.ok()) return bias.error();
    const auto [lowest, highest] = std::pair(bias.value().min_offset, bias.value().max_offset);
    if (wanted.offset < lowest || wanted.offset > highest) {
      return Error{"bias " + wanted.name + " takes offsets from " + std::to_string(lowest) + " to " +
                   std::to_string(highest) + ", not " + std::to_string(wanted.offset)};
    }
  }
  if (settings.roi) {
    const Roi& roi = *settings.roi;
    const bool fits = roi.width > 0 && roi.height > 0 && roi.x + roi.width <= kSensorSize.width &&
                      roi.y + roi.height <= kSensorSize.height;
    if (!fits) return Error{"the region of interest leaves the sensor of " + host::to_string(kSensorSize) + " px"};
  }
  if (settings.max_events_per_s > 0 && settings.max_events_per_s < kMinEventRate) {
    return Error{"the camera's own limit is at least " + std::to_string(kMinEventRate) + " events per second"};
  }
  return std::nullopt;
}

MaybeError TreuzellCamera::start(const CameraSettings& settings, StreamSink* sink) {
  stop();
  if (MaybeError error = check(settings)) return error;
  if (MaybeError error = set_up(settings)) return error;
  UsbStatus status = transport_->clear_halt(link_.data_endpoint());
  if (status == UsbStatus::ok) status = drain();
  StreamOptions stream;
  stream.endpoint = link_.data_endpoint();
  // The transfers wait before the first word comes.
  if (status == UsbStatus::ok) status = transport_->start_stream(stream, sink);
  if (status != UsbStatus::ok) return Error{to_string(status), {}, 0, 0, {}, Status::io_error};
  is_running_ = true;
  MaybeError error = run(imx636_start());
  if (error) stop();
  return error;
}

/// Everything but the start. Stop and destroy first: they bring a running sensor to a known state.
MaybeError TreuzellCamera::set_up(const CameraSettings& settings) {
  biases_before_.clear();
  for (const auto& steps : {imx636_stop(), imx636_destroy(), imx636_init(), imx636_plain_output()}) {
    if (MaybeError error = run(steps)) return error;
  }
  if (MaybeError error = fill(kImx636PixelMasks, [](std::uint32_t) { return 0U; })) return error;
  if (MaybeError error = set_rate_limit(settings.max_events_per_s)) return error;
  if (MaybeError error = set_roi(settings.roi)) return error;
  for (const BiasOffset& bias : settings.biases) {
    if (MaybeError error = set_bias(bias)) return error;
  }
  return std::nullopt;
}

void TreuzellCamera::stop() {
  if (!std::exchange(is_running_, false)) return;
  // The first step that fails ends it: a camera that is gone answers none of the others.
  if (!run(imx636_stop()) && !run(biases_before_)) (void)run(imx636_destroy());
  transport_->stop_stream();
}

MaybeError TreuzellCamera::run(Span<const RegisterStep> steps) {
  for (const RegisterStep& step : steps) {
    if (MaybeError error = write(step)) return error;
  }
  return std::nullopt;
}

MaybeError TreuzellCamera::write(const RegisterStep& step) {
  std::uint32_t value = step.value;
  if (step.mask != 0) {
    const Result<std::uint32_t> before = link_.read_register(step.address);
    if (!before.ok()) return before.error();
    value = (before.value() & ~step.mask) | (step.value & step.mask);
  }
  if (MaybeError error = link_.write_register(step.address, value)) return error;
  if (step.wait_us > 0) transport_->wait_us(step.wait_us);
  return std::nullopt;
}

template <class Value>
MaybeError TreuzellCamera::fill(const RegisterBlock& block, Value&& value) {
  for (std::uint32_t i = 0; i < block.count; ++i) {
    if (MaybeError error = link_.write_register(block.address + 4 * i, value(i))) return error;
  }
  return std::nullopt;
}

MaybeError TreuzellCamera::set_rate_limit(std::uint32_t max_events_per_s) {
  const std::uint32_t on = max_events_per_s > 0 ? 1 : 0;
  if (MaybeError error = write(kImx636ErcHold)) return error;
  if (MaybeError error = link_.write_register(kImx636ErcInput, on)) return error;
  if (on != 0) {
    const std::uint64_t events = std::uint64_t{max_events_per_s} * kErcPeriodUs / 1'000'000;
    const auto per_period = static_cast<std::uint32_t>(std::min<std::uint64_t>(events, kMaxErcEvents));
    if (MaybeError error = run(RegisterSteps{{kImx636ErcPeriod, kErcPeriodUs}, {kImx636ErcEvents, per_period}})) {
      return error;
    }
  }
  if (MaybeError error = run(RegisterSteps{{kImx636ErcEnable, 2 | on}, {kImx636ErcReserved, 1}})) return error;
  if (MaybeError error = fill(kImx636ErcWeights, [](std::uint32_t) { return 0x08080808U; })) return error;
  if (MaybeError error = link_.write_register(kImx636ErcReserved, 2)) return error;
  const auto drop = [](std::uint32_t i) { return (2 * i + 1) << 16U | 2 * i; };
  if (MaybeError error = fill(kImx636ErcDropTable, drop)) return error;
  return run(
      RegisterSteps{{kImx636ErcDropTime, on}, {kImx636ErcDropColumns, 0}, {kImx636ErcDropRows, 0}, kImx636ErcRun});
}

/// Word `word` of a mask in which the bits outside of [begin, begin + size) are set.
std::uint32_t outside_bits(std::uint32_t word, std::uint32_t begin, std::uint32_t size) {
  std::uint32_t bits = 0;
  for (std::uint32_t bit = 0; bit < 32; ++bit) {
    const std::uint32_t at = 32 * word + bit;
    if (at < begin || at >= begin + size) bits |= 1U << bit;
  }
  return bits;
}

MaybeError TreuzellCamera::set_roi(const std::optional<Roi>& wanted) {
  const Roi roi = wanted.value_or(Roi{0, 0, kSensorSize.width, kSensorSize.height});
  const auto columns = [&](std::uint32_t i) { return outside_bits(i, roi.x, roi.width); };
  const auto rows = [&](std::uint32_t i) { return outside_bits(i, roi.y, roi.height); };
  if (MaybeError error = fill(kImx636RoiColumns, columns)) return error;
  if (MaybeError error = fill(kImx636RoiRows, rows)) return error;
  return write(kImx636RoiTake);
}

MaybeError TreuzellCamera::set_bias(const BiasOffset& wanted) {
  const Result<Imx636Bias> bias = find_bias(wanted.name);
  if (!bias.ok()) return bias.error();
  const std::uint32_t address = bias.value().address;
  const Result<std::uint32_t> before = link_.read_register(address);
  if (!before.ok()) return before.error();
  const int usual = static_cast<int>(before.value() & 0xFFU);
  const int value = usual + wanted.offset;
  if (value < 0 || value > 255) {
    return Error{"bias " + wanted.name + " stands at " + std::to_string(usual) + " of 0 to 255: its offset can be " +
                 std::to_string(-usual) + " to " + std::to_string(255 - usual)};
  }
  biases_before_.push_back({address, before.value()});
  return link_.write_register(address, kImx636BiasWord | static_cast<std::uint32_t>(value));
}

/// Takes what an earlier stream has left behind.
UsbStatus TreuzellCamera::drain() {
  std::vector<std::uint8_t> bytes(kDrainBytes);
  for (int i = 0; i < kMaxDrains; ++i) {
    std::size_t count = 0;
    const UsbStatus status = transport_->read(link_.data_endpoint(), bytes, kDrainTimeoutMs, &count);
    if (status == UsbStatus::timeout || (status == UsbStatus::ok && count == 0)) break;
    if (status != UsbStatus::ok) return status;
  }
  return UsbStatus::ok;
}

}  // namespace

Result<std::unique_ptr<Camera>> open_treuzell(std::unique_ptr<Transport> transport, const char* name) {
  auto camera = std::make_unique<TreuzellCamera>(std::move(transport), name);
  if (MaybeError error = camera->identify()) return *std::move(error);
  return std::unique_ptr<Camera>(std::move(camera));
}

}  // namespace lecalib::usb
