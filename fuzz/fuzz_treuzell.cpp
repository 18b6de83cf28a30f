// SPDX-License-Identifier: MIT
// A camera that answers anything: opening and starting it works or ends with a message of one line. The input is cut
// into answers, each behind a byte with its length.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "lecalib/usb/treuzell_camera.hpp"

namespace {

using namespace lecalib;
using usb::UsbStatus;

void require(bool sound) {
  if (!sound) __builtin_trap();
}

class AnyDevice : public usb::Transport {
 public:
  explicit AnyDevice(Span<const std::uint8_t> answers) : answers_(answers) {}
  [[nodiscard]] const usb::DeviceInfo& info() const override { return info_; }
  UsbStatus control(const usb::ControlRequest& /*request*/, Span<std::uint8_t> data, std::size_t* count) override {
    return answer(data, count);
  }
  UsbStatus write(std::uint8_t /*endpoint*/, Span<const std::uint8_t> /*bytes*/) override { return UsbStatus::ok; }
  UsbStatus read(std::uint8_t /*endpoint*/, Span<std::uint8_t> room, unsigned /*ms*/, std::size_t* count) override {
    return answer(room, count);
  }
  UsbStatus clear_halt(std::uint8_t /*endpoint*/) override { return UsbStatus::ok; }
  UsbStatus start_stream(const usb::StreamOptions& /*options*/, usb::StreamSink* /*sink*/) override {
    return UsbStatus::ok;
  }
  void stop_stream() override {}
  [[nodiscard]] usb::StreamStats stream_stats() const override { return {}; }
  void wait_us(std::uint32_t /*time_us*/) override {}

 private:
  UsbStatus answer(Span<std::uint8_t> room, std::size_t* count) {
    *count = 0;
    if (answers_.empty()) return UsbStatus::timeout;
    const std::size_t size = answers_[0];
    const Span<const std::uint8_t> bytes = answers_.subspan(1, size);
    answers_ = answers_.subspan(1 + size);
    if (bytes.size() > room.size()) return UsbStatus::overflow;
    std::copy(bytes.begin(), bytes.end(), room.begin());
    *count = bytes.size();
    return UsbStatus::ok;
  }

  usb::DeviceInfo info_;
  Span<const std::uint8_t> answers_;
};

class NoSink : public usb::StreamSink {
 public:
  void take(Span<const std::uint8_t> /*bytes*/) override {}
  void end(UsbStatus /*why*/) override {}
};

void require_one_line(const host::Error& error) {
  require(!error.message.empty());
  require(host::to_string(error).find('\n') == std::string::npos);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  auto opened = usb::open_treuzell(std::make_unique<AnyDevice>(Span<const std::uint8_t>(data, size)), "camera");
  if (!opened.ok()) {
    require_one_line(opened.error());
    return 0;
  }
  NoSink sink;
  usb::CameraSettings settings;
  settings.biases = {{"diff_on", 30}};
  if (const auto error = opened.value()->start(settings, &sink)) require_one_line(*error);
  return 0;
}
